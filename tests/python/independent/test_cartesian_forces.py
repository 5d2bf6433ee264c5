"""Springs, dampers, given forces and motions: the product against the independent formulation."""

import chebclear as cc
import pytest
from test_cartesian import (
    FLOOR,
    IDEAL_FOUR_BAR,
    STEEL,
    assert_same_motion,
    double_pendulum,
    four_bar,
    pendulum,
    pin,
)

# One impact of the four-bar is slower than the floor, in both codes.
pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

WAVE = cc.motions.Harmonic(0.3, 9.0, phase=0.4, mean=-0.1)
TABLE = cc.motions.Table((0.0, 0.1, 0.25, 0.5, 0.7, 1.0), (0.0, 0.02, -0.05, 0.08, 0.01, 0.0))


def with_elements(scene, forces=(), drives=(), ground=None):
    return cc.Scene(
        scene.bodies,
        scene.joints,
        [*scene.forces, *forces],
        [*scene.drives, *drives],
        ground={**scene.ground, **(ground or {})},
    )


ELEMENTS = {
    "spring_between_bodies": [cc.Spring("s", "upper.top", "lower.B", 60.0, 0.7, damping=0.8)],
    "spring_to_ground": [
        cc.Spring("s", "ground.W", "lower.B", 40.0, 0.2),
        cc.Damper("d", "lower.B", "ground.W", 2.0),
    ],
    "torsion": [
        cc.TorsionSpring("k", "upper", "lower", 3.0, 0.4, damping=0.05),
        cc.TorsionDamper("c", "ground", "upper", 0.2),
    ],
    "force_on_ground_axes": [cc.Force("f", "lower.B", 2.0, WAVE)],
    "force_that_turns": [
        cc.Force("f", "lower.B", cc.motions.Polynomial((0.5, -2.0, 3.0)), 1.5, frame="body")
    ],
    "torque_between_bodies": [cc.Torque("m", "lower", WAVE, reaction="upper"), cc.Torque("n", "upper", 0.4)],
    "table": [
        cc.Torque("m", "lower", cc.motions.Table(TABLE.points, tuple(20.0 * value for value in TABLE.values)))
    ],
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_forces_agree(name):
    scene = with_elements(double_pendulum(), ELEMENTS[name], ground={"W": (1.5, 0.2)})
    assert_same_motion(scene, 1.0, 101, changes=0, tolerance=1e-8)


@pytest.mark.parametrize(
    "motion", [WAVE, TABLE, cc.motions.Polynomial((0.1, 0.2, -0.5, 0.3))], ids=["wave", "table", "cubic"]
)
@pytest.mark.parametrize("joint", ["elbow", "rail"])
def test_prescribed_motions_agree(joint, motion):
    """The second joint of a free arm moves as told, as a hinge or as an inclined rail."""
    second = (
        cc.Revolute("elbow", "upper.end", "lower.A")
        if joint == "elbow"
        else cc.Prismatic("rail", "upper.end", "lower.A", axis=(1.0, 0.7), angle=-0.5)
    )
    arm = double_pendulum()
    scene = cc.Scene(
        arm.bodies,
        [arm.joints[0], second],
        arm.forces,
        [cc.motions.Motion("push", joint, motion)],
        arm.ground,
        [cc.JointStart("O", position=0.4, velocity=0.3)],
    )
    assert_same_motion(scene, 1.0, 101, changes=0, tolerance=1e-8)


STARTS = {
    "joint": (
        double_pendulum(),
        [cc.JointStart("elbow", position=-0.7, velocity=2.0), cc.BodyStart("upper", 0.2, 0.5)],
    ),
    "body": (
        double_pendulum(),
        [cc.BodyStart("lower", angle=-1.0, angular_velocity=-3.0), cc.JointStart("O", 0.3, 0.0)],
    ),
    "loop": (four_bar(IDEAL_FOUR_BAR, forces=[cc.Gravity((0.0, -9.81))]), [cc.JointStart("O", 0.7, 20.0)]),
}


@pytest.mark.parametrize("name", STARTS)
def test_given_starts_agree(name):
    scene, start = STARTS[name]
    scene = cc.Scene(scene.bodies, scene.joints, scene.forces, scene.drives, scene.ground, start)
    assert_same_motion(scene, 0.5, 101, changes=0, tolerance=1e-8)


def test_eccentric_start_agrees():
    scene = pendulum(pin("P", "ground.P", "bob.P"))
    start = [cc.ClearanceStart("P", (1e-5, -5e-6), (0.01, 0.02)), cc.BodyStart("bob", -0.9, 1.0)]
    scene = cc.Scene(scene.bodies, scene.joints, scene.forces, scene.drives, scene.ground, start)
    assert_same_motion(scene, 0.01, 201)


def test_spring_loaded_loop_with_a_loose_joint_agrees():
    """A torque-driven four-bar with a spring and play at one coupler joint."""
    joints = [
        pin("B", "crank.B", "coupler.A", contact=cc.laws.LankaraniNikravesh(STEEL, 0.9)),
        *IDEAL_FOUR_BAR[1:],
    ]
    scene = four_bar(
        joints,
        forces=[
            cc.Spring("s", "ground.W", "rocker.B", 2000.0, 0.05, damping=3.0),
            cc.Torque("m", "crank", 5.0),
        ],
        ground={"W": (0.2, 0.05)},
    )
    assert FLOOR == joints[0].impact_velocity_floor
    assert_same_motion(scene, 0.01, 201)
