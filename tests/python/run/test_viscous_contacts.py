"""Contacts with a damper beside the spring: closed forms, and SciPy."""

import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused

MASS, SPEED, CLEARANCE, GRAVITY = 0.3, 0.4, 1e-3, 9.81
METHODS = ["rodas5p", "rodas4", "dop853", "adams"]
IMPLICIT = ["auto", "rodas4", "rodas5p"]


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


def block_on_table(law, amplitude, frequency):
    """A block of 1 kg that rests on a shaking table by the law of their contact."""
    return cc.Scene(
        [cc.Body("table", 1.0, 1e-3), cc.Body("block", 1.0, 1e-3)],
        [
            cc.Prismatic("lift", "ground", "table", axis=(0.0, 1.0)),
            cc.Prismatic("guide", "ground", "block", axis=(0.0, 1.0)),
            cc.Stop("seat", "table", "block", normal=(0.0, 1.0), contact=law),
        ],
        [cc.Gravity((0.0, -GRAVITY))],
        [cc.motions.Motion("shaker", "lift", f"{amplitude}*sin({frequency}*time)")],
    )


@pytest.mark.parametrize("method", IMPLICIT)
class TestAtRest:
    """Contacts that damp far faster than the motion changes: their force is that of the motion."""

    @pytest.mark.parametrize("rtol", [1e-4, 1e-6])
    @pytest.mark.parametrize(("stiffness", "damping"), [(1e7, 1e4), (1e7, 1e5), (1e7, 1e6), (1e8, 1e6)])
    def test_samples_peak_and_balance_are_those_of_the_closed_form(self, stiffness, damping, rtol, method):
        amplitude, frequency = 0.01, 10.0
        run = cc.simulate(
            block_on_table(cc.laws.KelvinVoigt(stiffness, damping), amplitude, frequency),
            duration=1.0,
            samples=501,
            # The block creeps into the table at the rate k / c.
            skip=10.0 * damping / stiffness,
            outputs=["seat.normal_force", "energy.*"],
            features=[cc.features.peak("seat.normal_force")],
            method=method,
            rtol=rtol,
        )
        transmitted = stiffness + 1j * damping * frequency
        motion = amplitude * transmitted / (transmitted - frequency**2)
        acceleration = -(frequency**2) * np.imag(motion * np.exp(1j * frequency * run.t))
        error = np.abs(run["seat.normal_force"] - (GRAVITY + acceleration)) / GRAVITY
        assert np.median(error) < 1e-3
        assert np.max(error) < 1e-2
        assert run.features[0, 0] == pytest.approx(GRAVITY + frequency**2 * abs(motion), rel=1e-2)
        work = np.max(np.abs(run["energy.input"] - run["energy.input"][0]))
        assert np.max(np.abs(run["energy.balance"])) < 1e-3 * work

    def test_hysteresis_damping_against_an_independent_integration(self, method):
        integrate = pytest.importorskip("scipy.integrate")
        stiffness, hysteresis, amplitude, frequency = 1e10, 1e3, 0.01, 10.0

        def force(t, y):
            depth = amplitude * math.sin(frequency * t) - y[0]
            rate = amplitude * frequency * math.cos(frequency * t) - y[1]
            return stiffness * max(depth, 0.0) ** 1.5 * max(1.0 + hysteresis * rate, 0.0)

        found = integrate.solve_ivp(
            lambda t, y: [y[1], force(t, y) - GRAVITY],
            [0.0, 0.3],
            [0.0, 0.0],
            method="Radau",
            rtol=1e-9,
            atol=1e-14,
            max_step=1e-3,
            t_eval=np.linspace(0.0, 0.3, 151),
        )
        expected = np.array([force(t, y) for t, y in zip(found.t, found.y.T, strict=True)])
        law = cc.laws.HuntCrossley(stiffness, hysteresis, 1.5)
        run = cc.simulate(
            block_on_table(law, amplitude, frequency),
            duration=0.3,
            samples=151,
            outputs=["seat.normal_force"],
            method=method,
            rtol=1e-4,
        )
        error = np.abs(run["seat.normal_force"] - expected)[10:] / GRAVITY
        assert np.median(error) < 2e-3
        assert np.max(error) < 2e-2

    @pytest.mark.parametrize("rtol", [1e-4, 1e-6])
    def test_it_lifts_off_where_the_table_falls_faster(self, rtol, method):
        amplitude, frequency = 0.02, 30.0
        scene = block_on_table(cc.laws.KelvinVoigt(1e7, 1e6), amplitude, frequency)
        run = cc.simulate(scene, duration=0.03, samples=11, method=method, rtol=rtol)
        assert [str(kind) for kind in run.events.kind] == ["onset", "clip", "separation"]
        expected = math.asin(GRAVITY / (amplitude * frequency**2)) / frequency
        assert run.events.time[1] == pytest.approx(expected, abs=2e-4)


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
