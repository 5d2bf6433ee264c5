"""Links of PMKS+: positions are those of closed forms, and what no scene has is refused by name.

PMKS+ does not run here. The links are written by the description of the format in its repository
(PMKS-Web/PMKSWeb, services/transcoding); one was published there, with the positions that it stands for.
"""

import cmath
import math

import chebclear as cc
import numpy as np
import pytest

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
SAMPLES = 37


def coded(value):
    """A number in thousandths."""
    left, text = abs(round(1000 * value)), ""
    while left or not text:
        left, digit = divmod(left, 64)
        text = DIGITS[digit] + text
    return "0" * (value < 0) + text


def joint(name, x, y, *, flags=0, angle=0.0, slot="", speed=None):
    """Flags: 1 slides, 2 input, 4 on ground, 8 welded, 32 cylinder."""
    more = f",{slot}" * bool(slot) + f"{',,,' * (not slot)},{coded(speed or 0)}" * bool(speed)
    text = f"{DIGITS[flags]}{name},{name},{coded(x)},{coded(y)},{coded(angle)}{more}."
    return name, complex(x, y), text


def link(name, pins=None, kind="YR", mass=0.0, inertia=0.0, x=0.0, y=0.0, parts=""):
    numbers = ",".join(map(coded, (mass, inertia, x, y)))
    return f"{kind}{name},{name},{numbers},c5cae9,{','.join(pins or name)},,{parts}."


def url(joints, links, forces="", *, unit=1, bits="0", speed=20, rest="N"):
    records = "".join(text for _, _, text in joints), "".join(links), forces, rest
    text = ".".join((bits, "Fe", f"{coded(speed / 1000)},0", f"{unit}01", *records))
    return f"https://app.pmksplus.com/?{text}{DIGITS[len(text) % 62]}"


PIVOT, CRANK = joint("A", 0, 0, flags=6), joint("B", 1, 0.4)
ROCKER = [PIVOT, CRANK, joint("C", 2.8, 2.3), joint("D", 3.1, 0.2, flags=4)]
BARS = [link("AB"), link("BC"), link("CD")]
ON_ROCKER = ("arc", "C", "B", "D")
PISTON = link("CE", kind="YP", mass=2.0)


# Of each: joints and links, the ways to find its pins one after another, more of the text.
LINKAGES = {
    "crank and rocker": (ROCKER, BARS, [ON_ROCKER], {}),
    "inches, clockwise": (ROCKER, BARS, [ON_ROCKER], {"unit": 0, "bits": "1", "speed": 35}),
    "speed of its own": ([joint("A", 0, 0, flags=6, speed=-7), *ROCKER[1:]], BARS, [ON_ROCKER], {"unit": 2}),
    "coupler point": (
        [*ROCKER, joint("P", 2, 2.9)], [link("AB"), link("BCP"), link("CD")],
        [ON_ROCKER, ("on", "P", "B", "C")], {},
    ),
    "welded rocker": (
        [*ROCKER, joint("P", 4, 2.9, flags=0)],
        [link("AB"), link("BC"), link("CDP", parts="CD,DP"), link("CD", kind="NR"), link("DP", kind="NR")],
        [ON_ROCKER, ("on", "P", "C", "D")], {},
    ),
    "six bars": (
        [*ROCKER, joint("P", 2, 2.9), joint("Q", 1, 4.5), joint("R", -1.5, 3, flags=4)],
        [link("AB"), link("BCP"), link("CD"), link("PQ"), link("QR")],
        [ON_ROCKER, ("on", "P", "B", "C"), ("arc", "Q", "P", "R")], {},
    ),
    "slider with a block": (
        [PIVOT, CRANK, joint("C", 3.5, -0.3), joint("E", 3.5, -0.3, flags=5, angle=0.2)],
        [link("AB"), link("BC"), PISTON], [("line", "C", "B", 0.2)], {},
    ),
    "slider that is a joint": (
        [PIVOT, CRANK, joint("C", 0.3, 3.5, flags=5, angle=1.571)],
        [link("AB"), link("BC")], [("line", "C", "B", 1.571)], {},
    ),
    "lever with a slot": (
        [PIVOT, joint("B", 1, 0, flags=1, slot="CD,C,D"), joint("C", 0, -3, flags=4), joint("D", 1.5, 1.5)],
        [link("AB"), link("CD")], [("through", "D", "C", "B")], {},
    ),
    "slider of the rocker": (
        [*ROCKER, joint("F", 6.5, 1, flags=5)], [*BARS, link("CF")], [ON_ROCKER, ("line", "F", "C", 0.0)], {}
    ),
}  # fmt: skip


def closed_form(start, angles, ways):
    """The places of all pins at these angles of the crank."""
    place = {pin: np.full(len(angles), z) for pin, z in start.items()}
    place["B"] = place["A"] + (start["B"] - start["A"]) * np.exp(1j * angles)
    for kind, pin, a, b in ways:
        to_a = abs(start[pin] - start[a])
        if kind == "arc":
            base, to_b = place[b] - place[a], abs(start[pin] - start[b])
            along = (to_a**2 - to_b**2 + abs(base) ** 2) / (2 * abs(base))
            side = np.sign(((start[pin] - start[a]) * (start[b] - start[a]).conjugate()).imag)
            place[pin] = place[a] + (along + 1j * side * np.sqrt(to_a**2 - along**2)) * base / abs(base)
        elif kind == "line":
            axis = cmath.rect(1.0, b)
            local = (place[a] - start[pin]) / axis
            side = np.sign((-(start[a] - start[pin]) / axis).real)
            place[pin] = start[pin] + axis * (local.real + side * np.sqrt(to_a**2 - local.imag**2))
        else:
            turn = (place[b] - place[a]) / (start[b] - start[a])
            place[pin] = place[a] + (start[pin] - start[a]) * turn / (abs(turn) if kind == "through" else 1.0)
    return place


def assert_moves(text, start, ways, unit, speed):
    scene = cc.read_linkage(text, cross_section=1e-4).scene()
    assert scene.drives[0].speed == pytest.approx(speed)
    points = [f"{body.name}.{pin}" for body in scene.bodies for pin in body.points if pin in start]
    outputs = [f"{point}.{axis}" for point in points for axis in "xy"]
    turn = 2 * math.pi / abs(speed)
    run = cc.simulate(scene, duration=turn, samples=SAMPLES, outputs=outputs)
    wanted = closed_form(start, speed * run.t, ways)
    assert {point.split(".")[1] for point in points} | set(scene.ground) >= set(start)
    for point in points:
        places = run[f"{point}.x"] + 1j * run[f"{point}.y"]
        assert abs(places - unit * wanted[point.split(".")[1]]).max() < 1e-9


@pytest.mark.parametrize("name", LINKAGES)
def test_every_pin_moves_as_in_its_closed_form(name):
    joints, links, ways, more = LINKAGES[name]
    start = {pin: place for pin, place, _ in joints if pin != "E"}
    speed = -7 if "own" in name else more.get("speed", 20) * (-1 if "clockwise" in name else 1)
    unit = (0.0254, 0.01, 1.0)[more.get("unit", 1)]
    assert_moves(url(joints, links, **more), start, ways, unit, cc.rpm(speed))


# The six-bar of the README, whose coordinates are those of SixBarVerification.m beside it.
PUBLISHED = (
    "https://app.pmksplus.com/?0P.SS.K,0.101.MA,A,0wS,0bg,0.GB,B,0gW,EE,0.GC,C,Oi,6k,0.GD,D,03m,_g,0.GE,E,1FO,1I_,"
    "0.GF,F,1-C,qM,0.KG,G,1oO,0ss,0..YRAB,AB,Fe,Fe,0oU,0Bk,c5cae9,A,B,,.YRBCD,BCD,Fe,Fe,07C,Rt,303e9f,B,C,D,,."
    "YRDE,DE,Fe,Fe,bq,18q,0d125a,D,E,,.YREF,EF,Fe,Fe,1dI,13g,B2DFDB,E,F,,.YRFCG,FCG,Fe,Fe,1Om,1Q,26A69A,F,C,G,,...JGp"
)
PLACES = {"A": (-3.74, -2.41), "B": (-2.72, 0.91), "C": (1.58, 0.43), "D": (-0.24, 4.01), "E": (5.08, 5.31),
          "F": (8.14, 3.35), "G": (7.32, -3.51)}  # fmt: skip


def test_a_published_link_stands_for_its_published_places(tmp_path):
    file = tmp_path / "watt.pmks"
    file.write_text(PUBLISHED.partition("?")[2] + "\n")
    scene = cc.read_linkage(file).scene()
    assert scene == cc.read_linkage(PUBLISHED).scene()
    poses = dict(zip(scene.check().bodies, scene.check().poses, strict=True))
    for body in scene.bodies:
        x, y, angle = poses[body.name]
        for pin, point in body.points.items():
            place = complex(x, y) + complex(*point) * cmath.rect(1.0, angle)
            assert abs(place - 0.01 * complex(*PLACES[pin])) < 1e-12
    # A gram and a kilogram square centimeter; the center of mass of AB is half way.
    assert scene.bodies[0].mass == 1e-3 and scene.bodies[0].inertia == 1e-4
    assert scene.bodies[0].center_of_mass == pytest.approx((scene.bodies[0].points["B"][0] / 2, 0), abs=1e-12)
    assert scene.drives[0].speed == cc.rpm(-20)


def test_forces_act_where_and_along_what_they_are_drawn():
    force = "2F1,CD,F1,{0},{1},{0},{2},{3}.".format(*map(coded, (3, 1, 5, 250)))
    scene = cc.read_linkage(
        url(ROCKER, BARS, force + force.replace("2F1", "3F2")), cross_section=1e-4
    ).scene()
    gravity, first, second = scene.forces
    assert gravity.acceleration == (0.0, -9.81) and (first.x, first.y) == pytest.approx(
        (0.0, 250.0), abs=1e-12
    )
    (rocker,) = (body for body in scene.bodies if body.name == "CD")
    turn = cmath.rect(1.0, rocker.angle)
    assert complex(2.8, 2.3) + 100 * complex(*rocker.points["F1"]) * turn == pytest.approx(3 + 1j)
    assert second.frame == "body" and complex(second.x, second.y) * turn == pytest.approx(250j)
    weightless = cc.read_linkage(url(ROCKER, BARS, bits="40"), cross_section=1e-4).scene()
    assert not weightless.forces


def refused(text):
    with pytest.raises(cc.errors.SceneError) as raised:
        cc.read_linkage(text, cross_section=1e-4)
    return [problem.path for problem in raised.value.problems]


def test_unknown_parts_are_refused_by_name():
    joints = [
        joint("A", 0, 0, flags=6),
        joint("B", 1, 0.4),
        joint("C", 3, 0, flags=13),
        joint("D", 3, 0, flags=7),
    ]
    assert refused(url(joints, [link("AB"), link("BCD")])) == ["joints.C", "joints.D"]
    inward = f"0F1,CD,F1,{','.join(map(coded, (3, 1, 5, 2, 9)))}."
    assert refused(url(ROCKER, BARS, inward)) == ["forces.F1"]
    assert refused(url(ROCKER, BARS, rest="N.G1~abc")) == ["link"]
    assert refused(url(ROCKER, BARS, unit=4)) == ["link"]


def test_damaged_links_are_refused(tmp_path):
    whole = url(ROCKER, BARS)
    for text in (
        whole[:-7],
        whole.replace("3", "33", 1),
        "https://app.pmksplus.com/?",
        PUBLISHED[:-1] + "*3Bw7de",
    ):
        assert refused(text) == ["link"]
    (tmp_path / "other.mgn").write_text("another program")
    assert refused(tmp_path / "other.mgn") == ["link"]
