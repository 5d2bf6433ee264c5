"""Linkages of pylinkage move as pylinkage moves them, and what no scene has is refused by name."""

import json
import math

import chebclear as cc
import numpy as np
import pytest

pl = pytest.importorskip("pylinkage")
from pylinkage import mechanism as pm  # noqa: E402

STEPS = 48
GIVEN = {"length_unit": "cm", "crank_speed": math.tau, "cross_section": 1e-4}


def crank(radius=1.0, angle=0.4):
    pivot = pl.Ground(0.0, 0.0, name="O")
    return pivot, pl.Crank(pivot, radius, math.tau / STEPS, angle, name="A")


def grounds(*places):
    return [pl.Ground(x, y, name=f"G{number}") for number, (x, y) in enumerate(places)]


def four_bar(radius, coupler, rocker, place, *more):
    """A four-bar linkage and what is joined to it."""
    pivot, driven = crank(radius)
    (ground,) = grounds(place)
    dyad = pl.RRRDyad(driven.output, ground, coupler, rocker, name="B")
    parts = [pivot, driven, ground, dyad]
    for make in more:
        parts += make(parts)
    return pl.Linkage(parts, name="four-bar")


def slider(length, *line, anchor=1):
    def make(parts):
        ends = [pl.Ground(*place, name=f"L{number}") for number, place in enumerate(line)]
        return [*ends, pl.RRPDyad(parts[anchor], *ends, length, name="S")]

    return make


def coupler_point(parts):
    return [pl.FixedDyad(parts[1].output, parts[3], 1.3, 0.7, name="P"),
            pl.PointTracker(parts[2], parts[3], 0.8, -1.0, name="Q")]  # fmt: skip


def dyad_on_coupler(parts):
    point = pl.FixedDyad(parts[1].output, parts[3], 1.3, 0.7, name="P")
    ground = pl.Ground(-1.5, 2.5, name="H")
    return [point, ground, pl.RRRDyad(point, ground, 2.5, 2.5, name="C")]


def block_on_coupler(parts):
    """A pin that slides on the line of the coupler, on a bar that turns about ground."""
    ground = pl.Ground(1.0, -1.0, name="H")
    return [ground, pl.RRPDyad(ground, parts[1], parts[3], 2.8, name="S")]


def slider_crank(length, *line):
    pivot, driven = crank()
    return pl.Linkage([pivot, driven, *slider(length, *line)([pivot, driven])], name="slider-crank")


def mechanism(*, sliding):
    """One of pylinkage's mechanisms, of joints and links."""
    pivot, ground = pm.GroundJoint("O", (0.0, 0.0)), pm.GroundJoint("G", (3.0, 0.2))
    pin = pm.RevoluteJoint("A", (math.cos(0.4), math.sin(0.4)))
    end = (
        pm.RevoluteJoint("B", (3.2, 2.6))
        if not sliding
        else pm.PrismaticJoint("B", (3.5, 0.35), axis=(2.0, 0.2))
    )
    tracked = pm.TrackerJoint("P", (1.0, 1.0), ref_joint1_id="A", ref_joint2_id="B", distance=0.9, angle=0.6)
    links = [
        pm.GroundLink("frame", [pivot, ground]),
        pm.DriverLink(
            "crank", [pivot, pin], motor_joint=pivot, angular_velocity=math.tau / STEPS, initial_angle=0.4
        ),
        pm.Link("coupler", [pin, end]),
    ]
    links += [] if sliding else [pm.Link("rocker", [end, ground])]
    return pm.Mechanism("of joints", [pivot, ground, pin, end, tracked], links)


LINKAGES = {
    "crank and rocker": lambda: four_bar(1.0, 3.0, 2.0, (3.0, 0.5)),
    "drag link": lambda: four_bar(2.0, 2.2, 2.5, (0.7, 0.0)),
    "points of coupler and rocker": lambda: four_bar(1.0, 3.0, 2.0, (3.0, 0.5), coupler_point),
    "six bars": lambda: four_bar(1.0, 3.0, 2.0, (3.0, 0.5), dyad_on_coupler),
    "slider of the rocker": lambda: four_bar(
        1.0, 3.0, 2.0, (3.0, 0.5), slider(4.0, (2.0, -1.0), (5.0, -1.2), anchor=3)
    ),
    "slider on the coupler": lambda: four_bar(1.0, 3.0, 2.0, (3.0, 0.5), block_on_coupler),
    "slider-crank": lambda: slider_crank(2.5, (0.0, 0.0), (1.0, 0.0)),
    "inclined slider-crank": lambda: slider_crank(3.0, (0.0, -0.5), (1.0, 0.3)),
    "mechanism": lambda: mechanism(sliding=False),
    "mechanism with a slide": lambda: mechanism(sliding=True),
}


def names(source):
    return [part.name for part in (source.components if hasattr(source, "components") else source.joints)]


@pytest.mark.parametrize("name", LINKAGES)
def test_every_pin_moves_as_in_pylinkage(name, tmp_path):
    source = LINKAGES[name]()
    template = cc.read_linkage(source, **GIVEN)
    scene = cc.load(template.save(tmp_path / "linkage")).scene()
    assert scene == template.scene()
    moving = [f"{body.name}.{pin}" for body in scene.bodies for pin in body.points if pin in names(source)]
    outputs = [f"{point}.{axis}" for point in moving for axis in "xy"]
    run = cc.simulate(scene, duration=1.0, samples=STEPS + 1, outputs=outputs)
    places = np.array([*source.step(STEPS)])
    assert {point.split(".")[1] for point in moving} | set(scene.ground) >= set(names(source))
    for point in moving:
        wanted = 0.01 * places[:, names(source).index(point.split(".")[1])]
        for axis, column in zip("xy", wanted.T, strict=True):
            assert run[f"{point}.{axis}"][1:] == pytest.approx(column, rel=0, abs=1e-9), point


def test_files_and_objects_are_the_same(tmp_path):
    source = mechanism(sliding=True)
    pm.mechanism_to_json(source, tmp_path / "linkage.json")
    assert cc.read_linkage(tmp_path / "linkage.json", **GIVEN) == cc.read_linkage(source, **GIVEN)


def test_components_without_names_get_some_and_names_stand_once():
    pivot, ground = pl.Ground(0.0, 0.0), pl.Ground(3.0, 0.5)
    driven = pl.Crank(pivot, 1.0)
    linkage = pl.Linkage([pivot, driven, ground, pl.RRRDyad(driven, ground, 3.0, 2.0)])
    assert [body.name for body in cc.read_linkage(linkage, **GIVEN).scene().bodies] == [
        "Crank2_link", "RRRDyad4_link1", "RRRDyad4_link2"]  # fmt: skip
    pivot.name = ground.name = "O"
    assert [problem.path for problem in refused(linkage)] == ["O"]


def test_bars_have_the_mass_and_inertia_of_bars():
    scene = cc.read_linkage(LINKAGES["six bars"](), density=2700.0, **GIVEN).scene()
    rocker = next(body for body in scene.bodies if body.name == "B_link2")
    assert rocker.mass == pytest.approx(2700.0 * 1e-4 * 0.02)
    assert rocker.inertia == pytest.approx(rocker.mass * 0.02**2 / 12)
    assert rocker.center_of_mass == pytest.approx((0.01, 0.0))
    assert scene.bodies[1].mass > 2700.0 * 1e-4 * 0.03  # a third pin beside the line


def refused(source, error=cc.errors.SceneError, **changes):
    with pytest.raises(error) as raised:
        cc.read_linkage(source, **(GIVEN | changes))
    return getattr(raised.value, "problems", None)


def test_unknown_parts_are_refused_by_name(tmp_path):
    pivot, driven = crank()
    (ground,) = grounds((3.0, 0.5))
    ram = pl.LinearActuator(ground, 0.0, 1.0, 0.1, name="ram")
    swing = pl.ArcCrank(ground, 1.0, 0.1, name="swing")
    loose = pl.FixedDyad(driven.output, ground, 1.0, 0.5, name="loose")
    astray = pl.RRPDyad(ground, driven, pivot, 2.0, name="fine")
    across = pl.RRPDyad(pivot, driven, ground, 2.0, name="across")
    linkage = pl.Linkage([pivot, driven, ground, ram, swing, loose, astray, across])
    assert [problem.path for problem in refused(linkage)] == ["ram", "swing", "loose", "across"]
    values = pm.mechanism_to_dict(mechanism(sliding=False))
    values["joints"][3] |= {"type": "gear"}
    values["links"][1] |= {"initial_angle": 0.5}
    values["links"][2] |= {"type": "arc_driver"}
    (tmp_path / "wrong.json").write_text(json.dumps(values))
    assert [problem.path for problem in refused(tmp_path / "wrong.json")] == [
        "joints.B", "links.crank", "links.coupler"]  # fmt: skip
    for text in (
        "{",
        "{}",
        '{"joints": [1], "links": []}',
        '{"joints": [{"id": "A", "position": "x"}], "links": []}',
    ):
        (tmp_path / "wrong.json").write_text(text)
        assert refused(tmp_path / "wrong.json")


def test_missing_units_masses_and_wrong_numbers_are_refused():
    source = LINKAGES["crank and rocker"]()
    for name in ("length_unit", "crank_speed"):
        refused(source, cc.errors.ArgumentError, **{name: None})
    refused(source, cc.errors.ArgumentError, density=0.0)
    refused(source, cc.errors.ArgumentError, cross_section="1 cm")
    refused(source, cc.errors.ArgumentTypeError, cross_section="thin")
    assert [problem.path for problem in refused(source, cross_section=None)] == [
        "links.A_link", "links.B_link1", "links.B_link2"]  # fmt: skip


def test_mechanisms_of_the_builder_are_read():
    """It calls joints after the ports that they join, with dots: ``"coupler.0_crank.tip"``."""
    four_bar = (
        pm.MechanismBuilder("four-bar")
        .add_ground_link("ground", ports={"O1": (0, 0), "O2": (3, 0)})
        .add_driver_link("crank", length=1.0, motor_port="O1", omega=0.1, initial_angle=math.pi / 2)
        .add_link("coupler", length=2.5)
        .add_link("rocker", length=2.0)
        .connect("crank.tip", "coupler.0")
        .connect("coupler.1", "rocker.0")
        .connect("rocker.1", "ground.O2")
        .build()
    )
    scene = cc.read_linkage(four_bar, **GIVEN).scene()
    # Where circles about crank pin and rocker bearing meet, by the triangle over the line between them.
    start = cc.simulate(scene, duration=1e-3, samples=2, outputs=["coupler.*", "rocker.*"])
    place = {
        name: [start[f"{name}.coupler_1_rocker_0.{axis}"][0] for axis in "xy"]
        for name in ("coupler", "rocker")
    }
    assert place["coupler"] == pytest.approx(place["rocker"], abs=1e-12)
    assert math.dist(place["coupler"], (0.0, 0.01)) == pytest.approx(0.025, rel=1e-12)
    assert math.dist(place["coupler"], (0.03, 0.0)) == pytest.approx(0.02, rel=1e-12)


def test_names_that_differ_by_dots_alone_are_refused(tmp_path):
    values = {"name": "", "joints": [{"id": "a.b", "position": [0, 0]}, {"id": "a_b", "position": [1, 0]}]}
    with pytest.raises(ValueError, match="must have ids that differ, also with _ in the place of dots"):
        path = tmp_path / "twice.json"
        path.write_text(json.dumps(values | {"links": []}))
        cc.read_linkage(path, **GIVEN)
