"""Contacts with a damper beside the spring: closed forms, and SciPy."""

import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused

MASS, SPEED, CLEARANCE = 0.3, 0.4, 1e-3
METHODS = ["rodas5p", "rodas4", "dop853", "adams"]


def impact(law, method="dop853"):
    """A journal that flies head-on into its bearing, without weight, until it has left it again."""
    scene = cc.Scene(
        [cc.Body("journal", MASS, 1e-4)],
        [cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, CLEARANCE, law)],
        start=[cc.ClearanceStart("bearing", (0.0, 0.0), (SPEED, 0.0))],
    )
    return cc.simulate(
        scene, duration=8e-3, samples=801, rtol=1e-10, method=method, outputs=["*", "energy.*"]
    )


class TestKelvinVoigt:
    @pytest.mark.parametrize("method", METHODS)
    @pytest.mark.parametrize("ratio", [0.02, 0.2, 0.6])
    def test_the_rebound_is_that_of_the_closed_form(self, ratio, method):
        """The force ends where it would pull: exp(-b/w (pi - atan2(2 b w, w^2 - b^2)))."""
        stiffness = 1e7
        natural = math.sqrt(stiffness / MASS)
        run = impact(cc.laws.KelvinVoigt(stiffness, 2.0 * ratio * natural * MASS), method)
        b, w = ratio * natural, natural * math.sqrt(1.0 - ratio**2)
        expected = math.exp(-b / w * (math.pi - math.atan2(2.0 * b * w, w**2 - b**2)))
        assert -run["journal.vx"][-1] / SPEED == pytest.approx(expected, rel=1e-6)
        assert [str(kind) for kind in run.events.kind] == ["onset", "clip", "separation"]
        assert run.contacts.impact_velocity[0] == pytest.approx(SPEED, rel=1e-9)
        assert np.max(np.abs(run["energy.balance"])) < 1e-6 * 0.5 * MASS * SPEED**2

    def test_the_force_jumps_where_the_contact_begins(self):
        law = cc.laws.KelvinVoigt(1e7, 2000.0)
        run = impact(law)
        touched = run["bearing.contact"] > 0.5
        first = np.flatnonzero(touched)[0]
        delta, rate = run["bearing.penetration"][first], run["bearing.penetration_rate"][first]
        assert run["bearing.normal_force"][first] == pytest.approx(1e7 * delta + 2000.0 * rate, rel=1e-9)
        assert run["bearing.normal_force"].min() == 0.0

    def test_without_damping_it_is_elastic(self):
        run = impact(cc.laws.KelvinVoigt(1e7, 0.0))
        assert -run["journal.vx"][-1] / SPEED == pytest.approx(1.0, rel=1e-9)


class TestImpact:
    @pytest.mark.parametrize("method", METHODS)
    @pytest.mark.parametrize("depth", [2e-6, 1e-4])
    def test_the_motion_is_that_of_an_independent_integration(self, depth, method):
        integrate = pytest.importorskip("scipy.integrate")
        stiffness, damping, exponent = 1e9, 400.0, 1.4

        def force(delta, rate):
            x = min(max(delta / depth, 0.0), 1.0)
            return stiffness * max(delta, 0.0) ** exponent + damping * x * x * (3.0 - 2.0 * x) * rate

        def pulls(t, y):
            return force(*y) if t > 1e-9 else 1.0

        pulls.terminal = True
        found = integrate.solve_ivp(
            lambda t, y: [y[1], -force(*y) / MASS],
            [0.0, 1.0],
            [0.0, SPEED],
            events=pulls,
            rtol=1e-11,
            atol=[1e-16, 1e-12],
            method="DOP853",
            max_step=1e-5,
        )
        run = impact(cc.laws.Impact(stiffness, damping, depth, exponent), method)
        assert -run["journal.vx"][-1] == pytest.approx(-found.y[1, -1], rel=2e-6)
        peak = max(force(*y) for y in found.y.T)
        assert run.contacts.peak_force[0] == pytest.approx(peak, rel=1e-3)
        # Where the damper has its full force, the second derivative of the law jumps inside a step.
        assert np.max(np.abs(run["energy.balance"])) < 3e-6 * 0.5 * MASS * SPEED**2


class TestBadInput:
    @pytest.mark.parametrize(
        ("law", "field"),
        [
            (cc.laws.KelvinVoigt(1e7, -1.0), "damping"),
            (cc.laws.Impact(1e7, 1.0, 0.0), "depth"),
            (cc.laws.Impact(1e7, 1.0, 1e-5, 0.5), "exponent"),
            (cc.laws.KelvinVoigt(0.0, 1.0), "stiffness"),
        ],
    )
    def test_numbers_that_no_contact_has(self, law, field):
        assert list(refused(cc.mechanisms.slider_crank(contact=law))) == [f"joints[3].contact.{field}"]
