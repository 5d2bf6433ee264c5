"""Lost motion by the play of joints, against closed forms and against the geometry of the worst play."""

import math

import chebclear as cc
import numpy as np
import pytest

RADIUS, LENGTH, PLAY = 0.05, 0.12, 2e-5


def crank(angle=0.0, speed=10.0):
    return cc.Scene(
        [
            cc.Body("crank", 0.3, 1e-4, points={"O": (0.0, 0.0), "A": (RADIUS, 0.0)}),
            cc.Body("rod", 0.2, 1e-4, (0.06, 0.0), points={"A": (0.0, 0.0), "B": (LENGTH, 0.0)}),
            cc.Body("slider", 0.1, 1e-4),
        ],
        [
            cc.Revolute("main", "ground", "crank.O"),
            cc.Revolute("pin", "crank.A", "rod.A"),
            cc.Revolute("wrist", "rod.B", "slider"),
            cc.Prismatic("guide", "ground", "slider", (1.0, 0.0)),
        ],
        [cc.Gravity((0.0, -9.81)), cc.Force("load", "slider", 500.0, 3.0)],
        [cc.motions.Speed("motor", "main", speed, angle)],
    )


ALL = dict.fromkeys(("main", "pin", "wrist"), PLAY)


class TestSliderCrank:
    def test_each_joint_adds_its_play_over_the_cosine_of_the_rod(self):
        found = cc.lost_motion(crank(), "slider", (1.0, 0.0), clearances=ALL)
        cosine = np.sqrt(1.0 - (RADIUS * np.sin(found.angle) / LENGTH) ** 2)
        for name in ALL:
            np.testing.assert_allclose(found[name], 2.0 * PLAY / cosine, rtol=1e-9)
        np.testing.assert_allclose(found.total, 6.0 * PLAY / cosine, rtol=1e-9)
        assert (found.unit, list(found)) == ("m", ["main", "pin", "wrist"])

    def test_at_one_radian_it_is_the_known_number(self):
        found = cc.lost_motion(crank(angle=1.0), "slider", (-2.0, 0.0), clearances={"wrist": PLAY}, angles=2)
        assert found["wrist"][0] == pytest.approx(4.2711293e-5, abs=2e-12)

    def test_it_is_how_far_the_slider_can_be_shifted(self):
        """The slider at the ends of the play of the wrist, from the law of cosines, to first order."""
        found = cc.lost_motion(crank(angle=1.0), "slider", (1.0, 0.0), clearances={"wrist": PLAY}, angles=2)

        def reach(length):
            return RADIUS * math.cos(1.0) + math.sqrt(length**2 - (RADIUS * math.sin(1.0)) ** 2)

        shift = reach(LENGTH + PLAY) - reach(LENGTH - PLAY)
        assert found["wrist"][0] == pytest.approx(shift, rel=1e-6)

    def test_the_clearances_of_the_scene_are_those_that_count(self):
        scene = cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist"), clearance=3e-5)
        found = cc.lost_motion(scene, "slider", (1.0, 0.0), angles=13)
        assert found.clearances == {"crank_pin": 3e-5, "wrist": 3e-5}
        assert found.total[0] == pytest.approx(4.0 * 3e-5, rel=1e-9)
        # The clearance of the scene, masses and gravity do not count.
        same = cc.lost_motion(
            crank(), "slider", (1.0, 0.0), clearances={"pin": 3e-5, "wrist": 3e-5}, angles=13
        )
        np.testing.assert_allclose(found.total, same.total, rtol=1e-6)

    def test_the_drive_may_turn_backwards(self):
        there = cc.lost_motion(crank(), "slider", (1.0, 0.0), clearances=ALL, angles=25)
        back = cc.lost_motion(crank(speed=-3.0), "slider", (1.0, 0.0), clearances=ALL, angles=25)
        np.testing.assert_allclose(back.total, there.total[::-1], rtol=1e-9)
        assert back.angle[-1] == pytest.approx(-2.0 * math.pi)


def test_a_rocker_turns_by_its_play_over_the_sine_of_the_transmission_angle():
    """Of the two pins of the coupler each 2 c / (b sin(mu)), b the length of the rocker."""
    scene = cc.mechanisms.four_bar(clearance_at=("crank_pin", "rocker_pin"))
    found = cc.lost_motion(scene, "rocker", angles=37)
    run = cc.simulate(
        cc.mechanisms.four_bar(clearance_at=()),
        duration=scene.period,
        samples=37,
        outputs=["coupler.angle", "rocker.angle"],
    )
    rocker = next(body for body in scene.bodies if body.name == "rocker")
    ends = [np.array(point) for point in rocker.points.values()]
    length = float(np.hypot(*(ends[1] - ends[0])))
    along = math.atan2(*(ends[1] - ends[0])[::-1])
    coupler = next(body for body in scene.bodies if body.name == "coupler")
    points = [np.array(point) for point in coupler.points.values()]
    line = math.atan2(*(points[1] - points[0])[::-1])
    transmission = run["coupler.angle"] + line - run["rocker.angle"] - along
    for name, clearance in found.clearances.items():
        expected = 2.0 * clearance / (length * np.abs(np.sin(transmission)))
        np.testing.assert_allclose(found[name], expected, rtol=1e-6, err_msg=name)
    assert found.unit == "rad"


def test_the_picture_has_a_layer_for_each_joint():
    found = cc.lost_motion(crank(), "slider", (1.0, 0.0), clearances=ALL, angles=37)
    ax = found.plot(unit="µm")
    assert len(ax.collections) == 3 and ax.get_ylabel() == "lost motion of slider [µm]"
    assert "most at 90 degrees" in str(found)


class TestBadInput:
    @pytest.mark.parametrize(
        ("arguments", "problem"),
        [
            ({"at": 3}, "at must be a point or a body"),
            ({"direction": (0.0, 0.0)}, "direction must be finite and not zero"),
            ({"direction": (1.0,)}, "direction must be a pair"),
            ({"clearances": {"pins": 1e-5}}, 'unknown revolute joint; did you mean "pin"'),
            ({"clearances": {"pin": -1e-5}}, ">= 0"),
            ({"clearances": {"guide": 1e-5}}, "unknown revolute joint"),
            ({"clearances": None}, "has no joint with clearance"),
            ({"angles": 1}, "angles must be"),
            ({"at": "slidr"}, 'unknown body "slidr"; did you mean "slider"'),
        ],
    )
    def test_arguments(self, arguments, problem):
        given = {"at": "slider", "direction": (1.0, 0.0), "clearances": ALL} | arguments
        with pytest.raises((ValueError, TypeError)) as caught:
            cc.lost_motion(crank(), given.pop("at"), given.pop("direction"), **given)
        assert problem in str(caught.value)

    def test_mechanisms(self):
        pendulum = cc.mechanisms.pendulum_in_bearing()
        with pytest.raises(cc.errors.ArgumentError):
            cc.lost_motion(pendulum, pendulum.bodies[0].name)
        with pytest.raises(cc.errors.ArgumentTypeError):
            cc.lost_motion(3, "slider")
