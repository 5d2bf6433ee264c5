"""The picture of a scene: what is drawn where, and that any scene can be drawn."""

import math
from pathlib import Path

import chebclear as cc
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from refusals import refuses

ANGLE = 0.8
# The paper's slider-crank at that angle.
PIN = np.array([0.05 * math.cos(ANGLE), 0.05 * math.sin(ANGLE)])
SLIDER = np.array([PIN[0] + math.sqrt(0.12**2 - PIN[1] ** 2), 0.0])


@pytest.fixture
def ax():
    return Figure().subplots()


def texts(ax):
    return [text.get_text() for text in ax.texts if text.get_text()]


def circles(ax):
    return [patch for patch in ax.patches if isinstance(patch, Circle)]


def test_draws_on_the_given_axes_with_equal_scales_and_leaves_settings_alone(ax):
    before = dict(mpl.rcParams)
    assert cc.plots.plot_scene(cc.mechanisms.slider_crank(), ax=ax) is ax
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")
    assert dict(mpl.rcParams) == before
    other = cc.plots.plot_scene(cc.mechanisms.slider_crank())
    assert other is not ax and other.figure is not ax.figure


@pytest.mark.parametrize("factor", [1.0, 100.0])
def test_journal_and_bearing_have_their_radii_and_places(ax, factor):
    scene = cc.mechanisms.slider_crank(crank_angle=ANGLE, clearance_at=("crank_pin", "wrist"))
    cc.plots.plot_scene(scene, ax=ax, exaggerate=factor)
    for place in (PIN, SLIDER):
        radii = [
            circle.radius for circle in circles(ax) if np.allclose(circle.center, place, rtol=0.0, atol=1e-12)
        ]
        assert max(radii) == pytest.approx(9.8e-3 + factor * 2e-5, rel=1e-12)
        assert any(radius == 9.8e-3 for radius in radii)
    said = [text for text in texts(ax) if "times larger" in text]
    assert said == ([] if factor == 1.0 else ["clearances drawn 100 times larger"])


def test_bodies_reach_from_pin_to_pin(ax):
    cc.plots.plot_scene(cc.mechanisms.slider_crank(crank_angle=ANGLE, clearance_at=()), ax=ax)
    shapes = [patch for patch in ax.patches if isinstance(patch, Polygon)]
    for ends in (((0.0, 0.0), PIN), (PIN, SLIDER)):
        assert any(
            all(shape.get_path().contains_point(point) for point in (*ends, 0.5 * np.add(*ends)))
            for shape in shapes
        )


def test_the_coupler_of_a_six_bar_is_a_plate(ax):
    scene = cc.mechanisms.six_bar()
    cc.plots.plot_scene(scene, ax=ax)
    facts = scene.check()
    x, y, angle = facts.poses[facts.bodies.index("coupler")]
    turned = np.exp(1j * angle) * np.array([0.0, 0.10, 0.05 + 0.06j])
    corners = np.column_stack((x + turned.real, y + turned.imag))
    assert any(
        all(shape.get_path().contains_point(corner) for corner in corners)
        for shape in ax.patches
        if isinstance(shape, Polygon)
    )


@pytest.mark.parametrize("speed", [10.0, -10.0])
def test_the_arrow_of_a_drive_turns_the_way_of_its_speed(ax, speed):
    cc.plots.plot_scene(cc.mechanisms.four_bar(crank_speed=speed), ax=ax)
    arcs = [np.column_stack(line.get_data()) for line in ax.lines if len(line.get_xdata()) > 10]
    (arc,) = arcs
    np.testing.assert_allclose(np.hypot(*arc.T), np.hypot(*arc[0]), rtol=1e-12)  # about the crank's bearing
    step = np.diff(arc, axis=0)
    assert (np.sign(arc[:-1, 0] * step[:, 1] - arc[:-1, 1] * step[:, 0]) == np.sign(speed)).all()


def test_labels_name_bodies_and_joints_and_can_be_left_out(ax):
    scene = cc.mechanisms.quick_return(gravity=9.81)
    cc.plots.plot_scene(scene, ax=ax)
    found = {name for text in texts(ax) for name in text.replace("\n", " ").split(", ")}
    parts = [*scene.bodies, *scene.joints]
    assert {part.name.replace("_", " ") for part in parts} <= found
    assert "9.81 m/s²" in found
    assert texts(cc.plots.plot_scene(scene, labels=False)) == ["9.81 m/s²"]


PRESS = cc.load(Path(__file__).parents[3] / "examples" / "toggle_press.toml").scene()
SCENES = {
    name: getattr(cc.mechanisms, name)() for name in ("four_bar", "six_bar", "quick_return", "slider_crank")
}


@pytest.mark.parametrize("size", [(2.4, 2.4), (3.5, 2.45), (6.4, 4.8)])
@pytest.mark.parametrize("scene", [PRESS, *SCENES.values()], ids=["press", *SCENES])
def test_labels_lie_apart_and_within_the_axes(scene, size):
    figure = Figure(figsize=size, layout="constrained")
    with mpl.rc_context({"font.size": 8.0}):
        ax = cc.plots.plot_scene(scene, ax=figure.subplots(), exaggerate=20.0)
    figure.draw_without_rendering()
    boxes = [text.get_tightbbox() for text in ax.texts if text.get_text()]
    held = ax.get_window_extent()
    for index, one in enumerate(boxes):
        assert held.padded(2.0).containsx(one.x0) and held.padded(2.0).containsx(one.x1)
        assert held.padded(2.0).containsy(one.y0) and held.padded(2.0).containsy(one.y1)
        for other in boxes[:index]:
            across = min(one.x1, other.x1) - max(one.x0, other.x0)
            up = min(one.y1, other.y1) - max(one.y0, other.y0)
            # Boxes are a little larger than the letters in them.
            assert min(across, up) < 0.25 * min(one.height, other.height)


def test_labels_of_pins_lie_on_no_bar():
    scene = cc.mechanisms.six_bar(crank_angle=0.9, clearance_at=())
    ax = cc.plots.plot_scene(scene)
    bars = [patch.get_path() for patch in ax.patches if isinstance(patch, Polygon) and len(patch.xy) > 10]
    names = {joint.name.replace("_", " ") for joint in scene.joints}
    anchors = [text.get_position() for text in ax.texts if text.get_text() in names]
    assert len(anchors) == len(names)
    assert not any(bar.contains_point(anchor) for bar in bars for anchor in anchors)


LAW = cc.laws.Hertz(1e11)
CHAIN = [
    cc.Body("cart", 2.0, 0.1),
    cc.Body("arm", 1.0, 0.1, points={"P": (0.0, 0.0), "Q": (0.2, 0.0)}, angle=-0.5),
    cc.Body("plate", 1.0, 0.1, points={"A": (0.0, 0.0), "B": (0.1, 0.0), "C": (0.1, 0.1)}),
    cc.Body("bob", 1.0, 0.1),
]
ODD = {
    "a lone body": cc.Scene([cc.Body("a", 1.0, 0.1)], []),
    "no ground": cc.Scene(
        [cc.Body("a", 1.0, 0.1, points={"P": (0.1, 0.0)}), cc.Body("b", 1.0, 0.1)],
        [cc.ClearanceRevolute("pin", "a.P", "b", 0.01, 1e-3, LAW)],
    ),
    "welds and rails": cc.Scene(
        CHAIN,
        [
            cc.Prismatic("rail", "ground", "cart", axis=(1.0, 0.3)),
            cc.Revolute("hinge", "cart", "arm.P"),
            cc.Fixed("weld", "arm.Q", "plate.A", angle=0.4),
            cc.Prismatic("piston", "plate.C", "bob", axis=(0.0, 1.0)),
        ],
        [cc.Gravity((0.0, -9.81)), cc.Gravity((3.0, 0.0))],
    ),
    "a rail that moves past ground": cc.Scene(
        [cc.Body("bar", 1.0, 0.1, points={"P": (0.1, 0.0)})],
        [cc.Prismatic("rail", "bar.P", "ground.O", axis=(1.0, 0.0))],
        ground={"O": (0.0, 0.0)},
    ),
    "everything in one point": cc.Scene(
        [cc.Body("a", 1.0, 0.1), cc.Body("b", 1.0, 0.1)],
        [cc.Revolute("r", "ground", "a"), cc.Revolute("s", "a", "b")],
    ),
    "micrometers": cc.mechanisms.four_bar(
        ground_length=1.2e-4,
        crank_length=0.5e-4,
        coupler_length=1e-4,
        rocker_length=0.8e-4,
        journal_radius=1e-5,
        clearance=1e-7,
    ),
    "free journal": cc.mechanisms.free_journal(),
    "pendulum": cc.mechanisms.pendulum_in_bearing(),
    "Flores": cc.mechanisms.flores_slider_crank(),
    "no ram": cc.mechanisms.quick_return(ram=False, clearance_at=("lever_bearing",)),
}


@pytest.mark.parametrize("name", ODD)
def test_any_scene_can_be_drawn(name, tmp_path):
    scene = ODD[name]
    ax = cc.plots.plot_scene(scene, exaggerate=10.0)
    ax.figure.savefig(tmp_path / "scene.png")
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    facts = scene.check()
    for x, y, _ in facts.poses:
        assert left < x < right and low < y < high
    for body in scene.bodies:
        assert body.name in texts(ax)


def test_scenes_that_cannot_be_assembled_and_wrong_factors_are_refused(ax):
    with pytest.raises(cc.errors.SceneError):
        cc.plots.plot_scene(cc.mechanisms.slider_crank(rod_length=0.03, crank_angle=1.5), ax=ax)
    for factor in (0.0, math.inf, "10"):
        with refuses("exaggerate"):
            cc.plots.plot_scene(cc.mechanisms.slider_crank(), exaggerate=factor)


RODS = [
    cc.Body(
        name, 1.0, 0.01, center_of_mass=(0.15, 0.0), points={"P": (0.0, 0.0), "Q": (0.3, 0.0)}, angle=angle
    )
    for name, angle in (("upper", -1.0), ("lower", 0.2))
]
ELBOW = 0.3 * np.array([math.cos(-1.0), math.sin(-1.0)])
TIP = ELBOW + 0.3 * np.array([math.cos(0.2), math.sin(0.2)])
WALL = np.array([0.4, 0.5])


def with_force(*forces, drives=()):
    pins = [cc.Revolute("shoulder", "ground", "upper.P"), cc.Revolute("elbow", "upper.Q", "lower.P")]
    return cc.Scene(RODS, pins, forces, drives, {"W": tuple(WALL)})


def added(*forces, drives=()):
    """Lines and filled shapes that a scene has more with forces than without; names that are written."""
    bare, full = Figure().subplots(), Figure().subplots()
    cc.plots.plot_scene(with_force(), ax=bare, labels=False)
    cc.plots.plot_scene(with_force(*forces, drives=drives), ax=full, labels=False)
    named = Figure().subplots()
    cc.plots.plot_scene(with_force(*forces, drives=drives), ax=named)
    lines = [np.array(line.get_data()).T for line in full.lines[len(bare.lines) :]]
    shapes = [patch.get_xy() for patch in full.patches[len(bare.patches) :] if isinstance(patch, Polygon)]
    return lines, shapes, " ".join(texts(named))


def ends(line):
    return line[0], line[-1]


@pytest.mark.parametrize(
    "force, pieces",
    [
        (cc.Spring("s", "ground.W", "lower.Q", 9.0, 0.1), 1),
        (cc.Damper("s", "ground.W", "lower.Q", 2.0), 4),
        (cc.Spring("s", "ground.W", "lower.Q", 9.0, 0.1, 2.0), 9),
        (cc.Spring("s", "ground.W", "lower.Q", 0.0, 0.1, 2.0), 4),
    ],
    ids=["spring", "damper", "both", "spring without stiffness"],
)
def test_springs_and_dampers_reach_from_point_to_point(force, pieces):
    lines, _, words = added(force)
    assert "s" in words.split()
    # The rest is the hatched wall at their end on ground.
    drawn = [line for line in lines if not np.allclose(line.mean(axis=0), WALL, rtol=0.0, atol=0.03)]
    touching = [point for line in lines for point in line]
    for place in (WALL, TIP):
        assert min(np.hypot(*(point - place)) for point in touching) < 1e-9
    assert len(drawn) == pieces
    way = (TIP - WALL) / np.hypot(*(TIP - WALL))
    across = np.abs([way[0] * (p - WALL)[1] - way[1] * (p - WALL)[0] for line in drawn for p in line])
    assert 0.005 < across.max() < 0.08


@pytest.mark.parametrize(
    "force, pieces",
    [
        (cc.TorsionSpring("s", "upper", "lower", 9.0), 1),
        (cc.TorsionDamper("s", "lower", "upper", 9.0), 3),
        (cc.TorsionSpring("s", "upper", "lower", 9.0, 0.0, 1.0), 4),
    ],
)
def test_torsion_springs_and_dampers_stand_around_the_joint(force, pieces):
    lines, _, words = added(force)
    assert len(lines) == pieces and "elbow, s" in words
    for line in lines:
        assert np.hypot(*(line - ELBOW).T).max() < 0.05


@pytest.mark.parametrize(
    "x, y, frame, direction, heads",
    [
        (3.0, 4.0, "ground", (0.6, 0.8), 1),
        (0.0, cc.motions.Polynomial([0.0, -2.0]), "ground", (0.0, -1.0), 1),
        (cc.motions.Harmonic(2.0, 5.0), 0.0, "ground", (1.0, 0.0), 2),
        (cc.motions.Table([0.0, 1.0, 2.0], [0.0, -3.0, 1.0]), 0.0, "ground", (-1.0, 0.0), 2),
        (1.0, 0.0, "body", (math.cos(0.2), math.sin(0.2)), 1),
    ],
)
def test_a_force_points_at_where_it_acts(x, y, frame, direction, heads):
    lines, shapes, words = added(cc.Force("push", "lower.Q", x, y, frame))
    assert "push" in words.split() and len(shapes) == heads and len(lines) == 1
    start, end = ends(lines[0])
    np.testing.assert_allclose((end - start) / np.hypot(*(end - start)), direction, atol=1e-12)
    tip = shapes[0][0]
    assert np.hypot(*(tip - TIP)) < 0.02 and (TIP - tip) @ np.array(direction) > 0.0


@pytest.mark.parametrize(
    "torque, clockwise", [(2.0, False), (-2.0, True), (cc.motions.Polynomial([0.0, -1.0]), True)]
)
def test_a_torque_turns_its_way(torque, clockwise):
    lines, shapes, words = added(cc.Torque("motor", "lower", torque, reaction="upper"))
    assert len(lines) == 1 and len(shapes) == 1 and "motor" in words
    around = lines[0] - ELBOW
    turn = np.sum(around[:-1, 0] * around[1:, 1] - around[:-1, 1] * around[1:, 0])
    assert (turn < 0.0) == clockwise


def test_forces_that_are_zero_are_not_drawn():
    lines, shapes, _ = added(
        cc.Force("f", "lower.Q", 0.0, 0.0), cc.Torque("t", "lower", cc.motions.Polynomial([0.0]))
    )
    assert not lines and not shapes


def test_a_motion_that_comes_back_has_two_heads():
    for motion, heads in (
        (cc.motions.Polynomial([0.0, 2.0]), 1),
        (cc.motions.Harmonic(1.0, 2.0, mean=-1.0), 2),
    ):
        assert len(added(drives=[cc.motions.Motion("d", "elbow", motion)])[1]) == heads
    slide = cc.Scene(
        [cc.Body("cart", 1.0, 1.0)],
        [cc.Prismatic("rail", "ground", "cart", (3.0, 4.0))],
        drives=[cc.motions.Motion("d", "rail", cc.motions.Harmonic(0.1, 2.0))],
    )
    ax = Figure().subplots()
    cc.plots.plot_scene(slide, ax=ax)
    arrows = [np.array(line.get_data()).T for line in ax.lines if line.get_color() == "0.1"]
    assert len(arrows) == 1
    start, end = ends(arrows[0])
    np.testing.assert_allclose((end - start) / np.hypot(*(end - start)), (0.6, 0.8), atol=1e-12)
