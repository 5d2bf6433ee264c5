"""Sweeps over the speed: resonance curves, lift-off and whirling pendulums in closed form."""

import math

import chebclear as cc
import numpy as np
import pytest
from notices import codes
from refusals import refuses

F = cc.features
MASS, ECCENTRICITY, DAMPING, STIFFNESS = 10.0, 0.01, 20.0, 1e4
NATURAL, RATIO = math.sqrt(STIFFNESS / MASS), DAMPING / (2.0 * math.sqrt(STIFFNESS * MASS))


def shaker(crank_speed=30.0):
    """A block on a spring with an unbalanced rotor of a fifth of its mass."""
    rotor = cc.Body("rotor", 0.2 * MASS, 1e-3, (ECCENTRICITY, 0.0))
    return cc.Scene(
        [cc.Body("block", 0.8 * MASS, 1.0), rotor],
        [cc.Prismatic("rail", "ground", "block", (1.0, 0.0)), cc.Revolute("shaft", "block", "rotor")],
        [cc.Spring("spring", "ground.wall", "block", STIFFNESS, 1.0, DAMPING)],
        [cc.motions.Speed("motor", "shaft", crank_speed)],
        ground={"wall": (-1.0, 0.0)},
    )


def study(build, features, box=None, **settings):
    box = box or {"crank_speed": cc.Interval(10.0, 60.0)}
    return cc.Study(build, box, features=features, **{"duration": 1.0, "samples": 2} | settings)


def test_a_driven_oscillator_has_its_resonance_curve():
    features = {"stroke": F.peak_to_peak("block.x"), "rms": F.rms("block.x")}
    found = study(shaker, features, rtol=1e-8).sweep("crank_speed", 20.0, 44.0, 49, revolutions=8, discard=60)
    w = found.points
    force = 0.2 * MASS * ECCENTRICITY * w**2
    amplitude = force / np.hypot(STIFFNESS - MASS * w**2, DAMPING * w)
    np.testing.assert_allclose(found["stroke"], np.tile(2.0 * amplitude, (8, 1)).T, rtol=1e-3)
    np.testing.assert_allclose(found["rms"], np.tile(amplitude / np.sqrt(2.0), (8, 1)).T, rtol=1e-3)
    assert found.speeds == pytest.approx(w) and found.settled("stroke").all()
    peak = NATURAL / math.sqrt(1.0 - 2.0 * RATIO**2)
    (resonance,) = found.resonances("stroke")
    assert resonance.at == pytest.approx(peak, abs=0.1)  # a fifth of a step
    width = (resonance.upper - resonance.lower) / (2.0 * resonance.at)
    assert width == pytest.approx(RATIO, rel=0.1)  # the half-power bandwidth
    assert len(found.table.rows) == 49
    assert found.statistics["mean of stroke [m]"] == pytest.approx(2.0 * amplitude, rel=1e-3)


def test_a_transient_is_told_from_a_settled_motion():
    with pytest.warns(cc.ChebclearWarning):
        found = study(shaker, {"stroke": F.peak_to_peak("block.x")}).sweep(
            "crank_speed", 25.0, 35.0, 5, discard=0
        )
    assert not found.settled("stroke").any() and "unsettled" in codes(found)


def follower(crank_speed=100.0, lift=0.005, mass=0.5, stiffness=4e3, preload=60.0, radius=0.03):
    """A flat follower, pressed on an eccentric disk."""
    disk = cc.Body("disk", 1.0, 1e-3, points={"O": (0.0, 0.0), "center": (0.0, -lift)})
    face = cc.Stop(
        "face", "follower", "disk.center", (0.0, -1.0), cc.laws.KelvinVoigt(1e7, 2e3), radius=radius
    )
    guide = cc.Prismatic("guide", "ground", "follower", (0.0, 1.0))
    return cc.Scene(
        [disk, cc.Body("follower", mass, 1e-3)],
        [cc.Revolute("shaft", "ground", "disk.O"), guide, face],
        [cc.Spring("spring", "ground.top", "follower", stiffness, 1.0 + preload / stiffness)],
        [cc.motions.Speed("motor", "shaft", crank_speed)],
        ground={"top": (0.0, 1.0 + radius - lift)},
        start=[cc.JointStart("guide", position=radius - lift - preload / 1e7)],
    )


def test_a_flat_follower_lifts_off_where_its_spring_no_longer_accelerates_it():
    """The contact is lost at the highest point where m e w^2 = F0 + 2 k e, here at 200 rad/s."""
    found = study(follower, {"force": F.peak("face.normal_force")}).sweep(
        "crank_speed", 182.0, 218.0, 10, revolutions=8, discard=6
    )
    (lift,) = found.lift_offs
    assert (lift.joint, lift.lower, lift.upper, lift.loses) == ("face", 198.0, 202.0, True)


def test_warnings_of_the_runs_are_those_of_the_sweep():
    made = study(follower, {"force": F.peak("face.normal_force")})
    with pytest.warns(cc.ChebclearWarning):
        found = made.sweep("crank_speed", 150.0, 350.0, 3, revolutions=8)
    (notice,) = [one for one in found.notices if one.code == "feeble_spring"]
    assert notice.numbers == {"runs": 3, "of_runs": 3}


class TestSpeedWithinATurn:
    """A pendulum that whirls over the top: its speed is sqrt(w0^2 - 2 m g l / J (1 - cos a))."""

    GRAVITY = 2.0 * 1.5 * 9.81 * 0.4 / (0.02 + 1.5 * 0.4**2)

    @staticmethod
    def pendulum(speed=12.0):
        bob = cc.Body("bob", 1.5, 0.02, (0.0, -0.4), points={"pivot": (0.0, 0.0)})
        start = [cc.JointStart("pin", position=0.0, velocity=speed)]
        pin = cc.Revolute("pin", "ground", "bob.pivot")
        return cc.Scene([bob], [pin], [cc.Gravity((0.0, -9.81))], start=start)

    def sweep(self, lower, upper, **how):
        output = "pin.angular_velocity"
        features = {kind: getattr(F, kind)(output) for kind in ("mean", "rms", "lowest", "peak_to_peak")}
        made = study(self.pendulum, features, {"speed": cc.Interval(8.0, 14.0)}, duration=12.0, rtol=1e-9)
        return made.sweep("speed", lower, upper, 4, revolutions=8, discard=2, **how)

    @pytest.mark.parametrize("sense", [1.0, -1.0])
    def test_revolutions_are_those_of_the_angle(self, sense):
        angles = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
        found = self.sweep(*sorted((10.0 * sense, 12.0 * sense)), angle="pin")
        speed = np.sqrt(found.points[:, None] ** 2 - self.GRAVITY * (1.0 - np.cos(angles)))
        period = 2.0 * np.pi * np.mean(1.0 / speed, axis=1)
        slow = np.sqrt(found.points**2 - 2.0 * self.GRAVITY)
        wanted = {
            "mean": sense * 2.0 * np.pi / period,
            "rms": np.sqrt(2.0 * np.pi * np.mean(speed, axis=1) / period),
            "lowest": slow if sense > 0.0 else found.points,
            "peak_to_peak": abs(found.points) - slow,
        }
        for name, value in wanted.items():
            np.testing.assert_allclose(found[name], np.tile(value, (8, 1)).T, rtol=1e-7, err_msg=name)
        np.testing.assert_allclose(found.speeds, sense * 2.0 * np.pi / period, rtol=1e-7)

    def test_what_does_not_turn_often_enough_is_nan(self):
        with pytest.warns(cc.ChebclearWarning):
            found = self.sweep(8.0, 11.0, angle="pin")  # over the top from 9.5 rad/s on
        assert list(np.isnan(found["mean"]).all(axis=1)) == [True, True, False, False]
        with pytest.raises(ValueError):
            self.sweep(6.0, 8.0, angle="pin")

    def test_the_joint_must_be_named(self):
        with pytest.raises(cc.errors.ArgumentError):
            self.sweep(10.0, 12.0)


def test_the_picture_marks_resonance_and_lift_off():
    found = study(shaker, {"stroke": F.peak_to_peak("block.x")}).sweep(
        "crank_speed", "200 rpm", "500 rpm", 21, revolutions=8, discard=60
    )
    ax = found.plot("stroke", unit="mm", parameter_unit="r/min", parameter_scale=30.0 / np.pi)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("crank speed [r/min]", "stroke, of a revolution [mm]")
    assert ax.lines[1].get_xdata()[0] == pytest.approx(30.0 / np.pi * NATURAL, abs=15.0)
    assert "resonance" in [text.get_text() for text in ax.get_legend().get_texts()]
    with pytest.raises(KeyError):
        found.plot("strok")


def test_bad_input():
    made = study(shaker, {"stroke": F.peak_to_peak("block.x")})
    for names, arguments, how in (
        (["build"], ("crank_sped", 1.0, 2.0), {}),
        (["parameter"], (3, 1.0, 2.0), {}),
        (["lower"], ("crank_speed", 2.0, 1.0), {}),
        (["points"], ("crank_speed", 1.0, 2.0, 2), {}),
        (["revolutions", "discard"], ("crank_speed", 1.0, 2.0), {"revolutions": 7, "discard": -1}),
        (["angle"], ("crank_speed", 1.0, 2.0), {"angle": "rail"}),
    ):
        with refuses(*names):
            made.sweep(*arguments, **how)
    for features in ({"own": lambda run: 1.0}, {"when": F.time_of_peak("block.x")}):
        with pytest.raises(cc.errors.ArgumentError):
            study(shaker, features).sweep("crank_speed", 1.0, 2.0)
    own = cc.Study(lambda x: {"y": x}, {"x": cc.Interval(0.0, 1.0)})
    with pytest.raises(cc.errors.ArgumentError):
        own.sweep("x", 0.0, 1.0)
