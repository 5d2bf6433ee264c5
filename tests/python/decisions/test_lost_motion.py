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


@pytest.mark.parametrize("corners", ["b", "a"])
@pytest.mark.parametrize("face", [None, 0.06])
def test_a_scotch_yoke_moves_as_far_as_a_search_of_all_poses_finds(corners, face):
    """Guide and slot at the ends of their play: every tilt and offset with which no corner is in a face."""
    of_guide, of_slot, length, place, tip, angle = 1e-6, 2e-6, 0.08, (0.03, 0.02), (-0.02, 0.05), 0.7
    law = cc.laws.Hertz(1e9)
    yoke = cc.Body("yoke", 1.0, 1e-3, points={"S": place, "T": tip})
    size = {"length": length, "height": 0.02, "clearance": of_guide, "corners": corners, "face_length": face}
    guide = cc.ClearancePrismatic("guide", "ground.G", "yoke", (1.0, 0.0), contact=law, **size)
    slot = cc.PinInSlot("slot", "yoke.S", "crank.A", (0.2, 1.0), 0.005, of_slot, law)
    scene = cc.Scene(
        [cc.Body("crank", 1.0, 1e-3, points={"A": (0.025, 0.0)}), yoke],
        [cc.Revolute("main", "ground", "crank"), guide, slot],
        drives=[cc.motions.Speed("motor", "main", 10.0, angle)],
        ground={"G": (-0.025, 0.0)},
    )
    pin = 0.025 * np.array([np.cos(angle), np.sin(angle)])
    normal = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)

    def shift(offset, tilt, across):
        """Where yoke and tip are along the guide, with the pin at a distance from the middle of the slot."""
        cosine, sine = np.cos(tilt), np.sin(tilt)
        turned = np.array([[cosine, -sine], [sine, cosine]])
        world = turned @ normal
        x = (world @ (pin - np.array([0.0, offset])) - normal @ place - across) / world[0]
        return x, x + (turned @ tip)[0]

    middle = shift(0.0, 0.0, 0.0)[0] + 0.025
    own, end = length / 2, np.inf if face is None else face / 2
    sleeve, rod = (own, end) if corners == "a" else (end, own)
    rear, front = max(-sleeve, middle - rod) - middle, min(sleeve, middle + rod) - middle
    found = []
    for at_rear in np.linspace(-of_guide, of_guide, 9):
        for at_front in np.linspace(-of_guide, of_guide, 9):
            tilt = (at_front - at_rear) / (front - rear)
            offset = at_front - tilt * front
            found += [shift(offset, tilt, across)[1] for across in (-of_slot, 0.0, of_slot)]
    lost = cc.lost_motion(scene, "yoke.T", (1.0, 0.0), angles=2)
    assert list(lost) == ["guide", "slot"]
    assert lost.total[0] == pytest.approx(max(found) - min(found), rel=1e-5)


def test_the_picture_has_a_layer_for_each_joint():
    found = cc.lost_motion(crank(), "slider", (1.0, 0.0), clearances=ALL, angles=37)
    ax = found.plot(unit="µm")
    assert len(ax.collections) == 3 and ax.get_ylabel() == "lost motion of slider [µm]"
    assert "most at 90 degrees" in str(found)


class TestBadInput:
    @pytest.mark.parametrize(
        "arguments",
        [
            {"at": 3},
            {"direction": (0.0, 0.0)},
            {"direction": (1.0,)},
            {"clearances": {"pins": 1e-5}},
            {"clearances": {"pin": -1e-5}},
            {"clearances": {"guide": 1e-5}},
            {"clearances": None},
            {"angles": 1},
            {"at": "slidr"},
        ],
    )
    def test_arguments(self, arguments):
        given = {"at": "slider", "direction": (1.0, 0.0), "clearances": ALL} | arguments
        with pytest.raises(cc.ChebclearError):
            cc.lost_motion(crank(), given.pop("at"), given.pop("direction"), **given)

    def test_mechanisms(self):
        pendulum = cc.mechanisms.pendulum_in_bearing()
        with pytest.raises(cc.errors.ArgumentError):
            cc.lost_motion(pendulum, pendulum.bodies[0].name)
        with pytest.raises(cc.errors.ArgumentTypeError):
            cc.lost_motion(3, "slider")
