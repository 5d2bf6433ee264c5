"""The product against the same mechanics in another formulation: see `cartesian.py`.

Impacts are chaotic, so a comparison needs a window. It is given: the motion up to a number of changes of
contact, few enough that no rounding of either code has grown to a tenth of the tolerance by then.
"""

import dataclasses
import math

import cartesian
import chebclear as cc
import loops
import numpy as np
import pytest

# Impacts at the velocity floor are intended here; both codes have them.
pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

CHANGES = 9  # of contact that are compared
FLOOR = 3e-3  # [m/s], of the latched impact velocity: explicit, so that both codes use the same
STEEL = cc.laws.hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3)
EQ_11 = cc.laws.ModifiedCoulomb(0.04, 0.03, 1e-3, 1.5e-3)
LANKARANI = cc.laws.LankaraniNikravesh(STEEL, 0.9)


# --- comparison -------------------------------------------------------------------------------------------


def scales(solution):
    """What a deviation of each column is relative to: the largest value of its quantity."""
    groups = {}
    for name in solution.columns:
        owner, what = name.split(".")
        joint = f"{owner}.penetration" in solution.columns
        kind = what.removesuffix("_x").removesuffix("_y")
        if not joint and what in ("x", "y", "vx", "vy", "ax", "ay"):
            kind = what[:-1]
        if what == "penetration":
            kind = "eccentricity"
        if what == "friction_force":
            kind = "normal_force"
        groups[name] = (owner if joint else "", kind)
    largest = {}
    for name, group in groups.items():
        largest[group] = max(largest.get(group, 0.0), np.abs(solution[name]).max())
    largest["", "angle"] = 1.0
    # Pins carry no moment: a rounding error is not compared with another.
    if ("", "reaction_torque") in largest:
        arm = 1e-2 * largest["", "reaction"]
        largest["", "reaction_torque"] = max(largest["", "reaction_torque"], arm)
    # A quantity that is zero for all bodies is compared absolutely.
    return {name: largest[group] or 1.0 for name, group in groups.items()}


def deviations(solution, other, samples):
    """Largest deviation of every column over the first samples, relative to its scale."""
    scale = scales(solution)
    return {
        name: np.abs(solution[name][:samples] - other[name][:samples])[first(name) :].max() / scale[name]
        for name in compared(solution)
        if name in other.columns
    }


def compared(solution):
    """The columns that can be compared; contacts are compared as events."""
    return [name for name in solution.columns if not name.endswith(".contact")]


def first(name):
    """First sample of a column: a joint that starts concentric, to rounding, has no normal there."""
    return 1 if name.endswith((".penetration_rate", ".sliding_velocity")) else 0


def assert_same_motion(scene, duration, samples, changes=CHANGES, tolerance=2e-6):
    """The product, with either kind of method, agrees event for event and in every column until the next."""
    solution = cartesian.simulate(scene, duration, samples, rtol=1e-13, max_events=changes + 1)
    assert solution.residual < 1e-11
    count = len(solution.t)
    events = solution.events[:changes]
    assert len(events) == changes
    for method in ("rodas5p", "dop853"):
        run = cc.simulate(scene, duration=duration, samples=samples, rtol=1e-11, method=method)
        errors = deviations(solution, run, count)
        worst = max(errors, key=errors.get)
        print(f"{method}: to {solution.t[-1]:.2e} s, at most {errors[worst]:.1e} ({worst})")
        seen = range(changes)
        assert [(run.events.joint[k], run.events.kind[k]) for k in seen] == [event[1:] for event in events]
        # A clip is located where the damping has taken all but 1e-4 of the force, whatever the tolerance.
        np.testing.assert_allclose(
            run.events.time[seen], [event[0] for event in events], atol=2e-5 * duration
        )
        assert errors[worst] < tolerance, worst
    return events


# --- scenes -----------------------------------------------------------------------------------------------


def pin(name, bearing, journal, contact=LANKARANI, friction=None, sliding="surface", floor=FLOOR):
    return cc.ClearanceRevolute(
        name,
        bearing,
        journal,
        journal_radius=9.8e-3,
        clearance=2e-5,
        contact=contact,
        friction=friction,
        sliding=sliding,
        impact_velocity_floor=floor,
    )


def link(name, length, mass, angle, first="A", second="B"):
    """A slender uniform rod from one point to the other."""
    return cc.Body(
        name,
        mass,
        mass * length**2 / 12.0,
        (0.5 * length, 0.0),
        points={first: (0.0, 0.0), second: (length, 0.0)},
        angle=angle,
    )


CRANK, COUPLER, ROCKER, BASE = 0.05, 0.12, 0.08, 0.10


def four_bar_angles(crank_angle):
    """Angles of coupler and rocker of the four-bar, open branch, from the diagonal's two triangles."""
    x, y = BASE - CRANK * math.cos(crank_angle), -CRANK * math.sin(crank_angle)
    diagonal, direction = math.hypot(x, y), math.atan2(y, x)
    coupler = math.acos((COUPLER**2 + diagonal**2 - ROCKER**2) / (2.0 * COUPLER * diagonal))
    rocker = math.acos((ROCKER**2 + diagonal**2 - COUPLER**2) / (2.0 * ROCKER * diagonal))
    return direction + coupler, direction + math.pi - rocker


def four_bar(joints, drives=(), forces=(), crank_angle=0.7, bodies=(), ground=None):
    coupler, rocker = four_bar_angles(crank_angle)
    return cc.Scene(
        ground={"O": (0.0, 0.0), "D": (BASE, 0.0), **(ground or {})},
        bodies=[
            link("crank", CRANK, 0.30, crank_angle),
            link("coupler", COUPLER, 0.21, coupler),
            link("rocker", ROCKER, 0.25, rocker),
            *bodies,
        ],
        joints=[cc.Revolute("O", "ground.O", "crank.A"), *joints],
        drives=drives,
        forces=forces,
    )


def driven(speed, crank_angle=0.7):
    return [cc.motions.Speed("drive", "O", speed, angle=crank_angle)]


def loose_slider_crank(loose, crank_angle=0.0, **laws):
    """The paper's slider-crank with play at any of crank pin and wrist."""
    scene = cc.mechanisms.slider_crank(crank_angle=crank_angle, impact_velocity_floor=FLOOR)
    ends = {"crank_pin": ("crank.B", "rod.B"), "wrist": ("rod.C", "slider.C")}
    joints = []
    for joint in scene.joints:
        name = joint.name
        if name in loose:
            joint = pin(name, *ends[name], **laws)
        elif name in ends:
            joint = cc.Revolute(name, *ends[name])
        joints.append(joint)
    return cc.Scene(scene.bodies, joints, scene.forces, scene.drives, scene.ground)


# --- ideal joints -----------------------------------------------------------------------------------------


def double_pendulum():
    first, second = 0.4, -0.8
    return cc.Scene(
        ground={"O": (0.3, -0.1)},
        bodies=[
            cc.Body(
                "upper",
                1.2,
                0.10,
                (0.25, 0.03),
                inertia_about="top",
                points={"top": (0.0, 0.0), "end": (0.5, 0.0)},
                angle=first,
            ),
            link("lower", 0.4, 0.7, second),
        ],
        joints=[cc.Revolute("O", "ground.O", "upper.top"), cc.Revolute("elbow", "upper.end", "lower.A")],
        forces=[cc.Gravity((0.0, -9.81))],
    )


def welded_rod_in_a_sleeve():
    """A driven crank turns a rod that slides in a sleeve on a pivot; a bracket is welded to the rod."""
    crank, base, angle = 0.05, 0.15, 1.1
    x, y = crank * math.cos(angle) + base, crank * math.sin(angle)
    rod = math.atan2(y, x)
    return cc.Scene(
        ground={"O": (0.0, 0.0), "P": (-base, 0.0)},
        bodies=[
            link("crank", crank, 0.3, angle),
            cc.Body("rod", 0.2, 4e-4, (-0.03, 0.01), points={"B": (0.0, 0.0)}, angle=rod),
            cc.Body("sleeve", 0.4, 1e-4, (0.0, -0.02), points={"P": (0.0, 0.0)}, angle=rod),
            cc.Body("bracket", 0.1, 5e-5, (0.02, 0.0), points={"foot": (0.01, 0.0)}, angle=rod + 0.5),
        ],
        joints=[
            cc.Revolute("O", "ground.O", "crank.A"),
            cc.Revolute("B", "crank.B", "rod.B"),
            cc.Revolute("P", "ground.P", "sleeve.P"),
            cc.Prismatic("guide", "sleeve.P", "rod.B", axis=(2.0, 0.0)),
            cc.Fixed("weld", "rod.B", "bracket.foot", angle=0.5),
        ],
        forces=[cc.Gravity((1.0, -9.81))],
    )


IDEAL_FOUR_BAR = [
    cc.Revolute("B", "crank.B", "coupler.A"),
    cc.Revolute("C", "coupler.B", "rocker.B"),
    cc.Revolute("D", "ground.D", "rocker.A"),
]
GRAVITY = [cc.Gravity((0.0, -9.81))]


@pytest.mark.parametrize(
    ("scene", "duration"),
    [
        pytest.param(loose_slider_crank([]), 0.03, id="slider_crank"),
        pytest.param(four_bar(IDEAL_FOUR_BAR, driven(30.0)), 0.2, id="driven_four_bar"),
        pytest.param(four_bar(IDEAL_FOUR_BAR, forces=GRAVITY), 0.6, id="free_four_bar"),
        pytest.param(double_pendulum(), 1.0, id="double_pendulum"),
        pytest.param(welded_rod_in_a_sleeve(), 0.8, id="sleeve"),
    ],
)
def test_ideal_mechanisms_agree(scene, duration):
    assert_same_motion(scene, duration, 101, changes=0, tolerance=1e-8)


# --- clearance --------------------------------------------------------------------------------------------


def pendulum(joint, angle=-0.9):
    return cc.Scene(
        ground={"P": (0.1, 0.2)},
        bodies=[cc.Body("bob", 0.5, 1e-3, (0.2, 0.0), points={"P": (0.0, 0.0)}, angle=angle)],
        joints=[joint],
        forces=GRAVITY,
    )


def four_bar_and_slider():
    """An ideal four-bar whose rocker moves a slider by a rod: a closed loop beside a pin with play."""
    crank_angle, rod = 0.7, 0.15
    angle = four_bar_angles(crank_angle)[1]
    rise = ROCKER * math.sin(angle)
    return four_bar(
        [
            *IDEAL_FOUR_BAR,
            cc.Revolute("E", "rocker.B", "rod.A"),
            pin("wrist", "rod.B", "slider"),
            cc.Prismatic("guide", "ground.D", "slider", axis=(1.0, 0.0)),
        ],
        driven(60.0),
        bodies=[link("rod", rod, 0.15, -math.asin(rise / rod)), cc.Body("slider", 0.2, 1e-4, (0.005, 0.0))],
    )


CLEARANCE_SCENES = {
    "wrist": (loose_slider_crank(["wrist"]), 0.004),
    # Not to 2 ms: the ninth change begins a long contact, in which errors go on growing.
    "wrist_with_friction": (loose_slider_crank(["wrist"], friction=EQ_11), 0.0012),
    # Flores' mechanism of `benchmarks/flores.py`.
    "wrist_at_5000_rpm": (
        cc.mechanisms.slider_crank(
            clearance=5e-4,
            journal_radius=9.5e-3,
            crank_speed=cc.rpm(5000),
            friction=None,
            impact_velocity_floor=FLOOR,
        ),
        0.008,
    ),
    "crank_pin": (loose_slider_crank(["crank_pin"]), 0.004),
    "floating_rod": (loose_slider_crank(["crank_pin", "wrist"]), 0.004),
    "floating_rod_with_friction": (loose_slider_crank(["crank_pin", "wrist"], friction=EQ_11), 0.004),
    "four_bar_first_coupler_joint": (
        four_bar([pin("B", "crank.B", "coupler.A"), *IDEAL_FOUR_BAR[1:]], driven(100.0)),
        0.004,
    ),
    "four_bar_second_coupler_joint": (
        four_bar([IDEAL_FOUR_BAR[0], pin("C", "coupler.B", "rocker.B"), IDEAL_FOUR_BAR[2]], driven(100.0)),
        0.004,
    ),
    "four_bar_both_coupler_joints": (
        four_bar(
            [pin("B", "crank.B", "coupler.A"), pin("C", "coupler.B", "rocker.B"), IDEAL_FOUR_BAR[2]],
            driven(100.0),
        ),
        0.004,
    ),
    "four_bar_loose_at_ground": (
        four_bar([*IDEAL_FOUR_BAR[:2], pin("D", "ground.D", "rocker.A", friction=EQ_11)], driven(100.0)),
        0.004,
    ),
    "loop_and_clearance": (four_bar_and_slider(), 0.008),
    "pendulum_in_bearing": (pendulum(pin("P", "ground.P", "bob.P", friction=EQ_11)), 0.02),
    "pendulum_on_pin": (pendulum(pin("P", "bob.P", "ground.P", friction=EQ_11)), 0.02),
}


@pytest.mark.parametrize("name", CLEARANCE_SCENES)
def test_mechanisms_with_clearance_agree(name):
    scene, duration = CLEARANCE_SCENES[name]
    assert_same_motion(scene, duration, 201)


# Until 2 ms; the law of Flores brings five changes by then.
LAWS = {
    "flores": (5, dict(contact=cc.laws.Flores(STEEL, 0.85), friction=cc.laws.SmoothedCoulomb(0.1, 1e-2))),
    "hunt_crossley": (
        CHANGES,
        dict(contact=cc.laws.HuntCrossley(STEEL, 0.5), friction=EQ_11, sliding="contact_point"),
    ),
    "hertz": (
        CHANGES,
        dict(
            contact=cc.laws.Hertz(STEEL), friction=cc.laws.SmoothedCoulomb(0.1, 1e-2), sliding="contact_point"
        ),
    ),
    "other_exponent": (
        CHANGES,
        dict(contact=cc.laws.LankaraniNikravesh(3e10, 0.95, exponent=1.3), friction=EQ_11),
    ),
    "at_the_floor": (CHANGES, dict(floor=0.5)),
}


@pytest.mark.parametrize("name", LAWS)
def test_laws_agree(name):
    changes, laws = LAWS[name]
    assert_same_motion(loose_slider_crank(["wrist"], **laws), 0.002, 201, changes)


def test_contacts_pulled_apart_agree():
    """Three loose joints in a row; the strong damping of one contact would pull when another is hit."""
    law = cc.laws.Flores(STEEL, 0.1)
    joints = [
        pin("B", "crank.B", "coupler.A", contact=law),
        pin("C", "coupler.B", "rocker.B", contact=law),
        pin("D", "ground.D", "rocker.A", contact=law),
    ]
    events = assert_same_motion(four_bar(joints, driven(300.0)), 0.001, 201)
    assert {"clip", "unclip"} <= {kind for _, _, kind in events}


# --- bodies without mass ----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(20))
def test_massless_bodies_move_as_in_the_augmented_system_or_are_refused_where_it_is_singular(seed):
    rng = np.random.default_rng(seed)
    make, joint = [(loops.slider_crank, "bearing"), (loops.four_bar, "A")][seed % 2]
    loads = [cc.Gravity((0.0, -9.81)), cc.Force("load", "crank.Q", *rng.normal(0.0, 10.0, 2))]
    given = cc.JointStart(joint, position=rng.normal(0.6, 0.1), velocity=rng.normal(0.0, 20.0))
    scene = make(loads, start=[given])
    light = [{}, {"mass": 0.0, "inertia": 0.0}, {"mass": 0.0}, {"inertia": 0.0}]
    bodies = [dataclasses.replace(body, **light[rng.integers(0, 4)]) for body in scene.bodies]
    joints = list(scene.joints)
    if seed % 3 == 0:
        joints[2] = pin(joints[2].name, joints[2].a, joints[2].b)
    scene = dataclasses.replace(scene, bodies=bodies, joints=joints)
    model = cartesian.Model(scene)
    try:
        run = cc.simulate(scene, duration=1e-6, samples=2, outputs=["*"])
    except cc.errors.SceneError:
        system = model.residuals(0.0, cartesian.Motion(model, *cartesian.split(model.start())))
        zeros = np.zeros((len(system.gamma),) * 2)
        matrix = np.block([[model.mass, system.jacobian.T], [system.jacobian, zeros]])
        assert np.linalg.matrix_rank(matrix) < len(matrix)
        return
    names = [("x", "y", "angle"), ("vx", "vy", "angular_velocity")]
    state = [run[f"{body.name}.{name}"][0] for part in names for body in bodies for name in part]
    solution = cartesian.Solution(np.zeros(1), {})
    cartesian.fill(model, solution, [(np.array(state), (cartesian.Phase(),) * len(model.clearance))])
    loose = {joint.name for joint in model.clearance}
    for name, scale in scales(solution).items():
        if name.split(".")[0] not in loose:
            assert abs(solution[name][0] - run[name][0]) < 1e-9 * scale, name
