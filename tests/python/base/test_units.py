"""Units as engineers type them: their sizes, and what is refused that would be read as another number."""

import math

import chebclear as cc
import pytest
from chebclear.base.units import UnitError, convert, misfit, si_unit, written


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        # One pound is 0.45359237 kg, standard gravity 9.80665 m/s2, one inch 25.4 mm, all by definition.
        ("1 lb", "kg", 0.45359237),
        ("1 lbf", "N", 0.45359237 * 9.80665),
        ("1 kgf", "N", 9.80665),
        ("12 inch", "m", 0.3048),
        ("1 ft", "m", 0.3048),
        ("1 mil", "m", 25.4e-6),
        ("1 psi", "Pa", 0.45359237 * 9.80665 / 0.0254**2),
        ("1 bar", "Pa", 1e5),
        ("1 lbf/in", "N/m", 0.45359237 * 9.80665 / 0.0254),
        ("5 Nm", "N m", 5.0),
        ("100 cP", "Pa s", 0.1),
        ("6 arcmin", "rad", math.radians(0.1)),
        ("0.25 rev", "rad", math.pi / 2),
        ("5 mm/rev", "- or m", 5e-3 / math.tau),
        ("50 Hz", "1/s", 50.0),
        ("50 Hz", "rad/s", 100 * math.pi),
        ("30 rev/s", "rad/s", 60 * math.pi),
        ("60 rad/min", "rad/s", 1.0),
    ],
)
def test_units_have_their_size(text, unit, value):
    assert convert(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("unit", ["r/min", "rev/min", "U/min", "turn/min", "rev / min"])
def test_revolutions_in_a_minute_are_rpm_to_the_last_bit(unit):
    assert convert(f"1234.5 {unit}", "rad/s") == cc.rpm(1234.5)
    assert si_unit(unit) == "rad/s"
    assert written(cc.rpm(45), unit) == f"45 {unit}"


@pytest.mark.parametrize("text", ["45 1/min", "1 1/s", "45 min-1", "45 min^-1"])
def test_an_angular_velocity_says_what_is_counted(text):
    with pytest.raises(UnitError, match=r"say what is counted, turns in rpm, rev/s or Hz, angles in rad/s"):
        convert(text, "rad/s")


@pytest.mark.parametrize(
    ("text", "unit", "meant"),
    [
        ("30 deg", "-", "%"),
        ("5 %", "rad", "deg"),
        ("45 rpm", "1/s", "Hz"),
        ("5 rad", "m", "mm"),
        ("5 lb", "N", "lbf"),
        ("5 lb/in", "N/m", "lbf/in"),
    ],
)
def test_what_would_be_another_number_is_refused_with_what_is_meant(text, unit, meant):
    with pytest.raises(UnitError, match=meant):
        convert(text, unit)


def test_a_quantity_in_an_expression_says_what_to_write():
    with pytest.raises(UnitError, match=r'give "20 mm" a name in \[parameters\], or write "0.02 - lash"'):
        convert("20 mm - lash", "m")


def test_units_of_one_dimension_fit():
    assert misfit("mm", "m") == misfit("N m", "N m/rad") == misfit("deg", "rad or m") == ""
    assert "not of the dimension of [rad/s]" in misfit("Hz", "rad/s")


def test_records_take_texts_with_units():
    body = cc.Body("bob", mass="2 lb", inertia="1 kg mm2", points={"A": ("10 cm", 0)}, angle="30 deg")
    assert body == cc.Body(
        "bob", mass=0.90718474, inertia=1e-6, points={"A": (0.1, 0)}, angle=math.radians(30)
    )
    law = cc.laws.LankaraniNikravesh("5 N/mm^1.5", 0.9)
    assert law.stiffness == pytest.approx(5 * 1000**1.5, rel=1e-15)
    table = cc.motions.Table(["0 deg", "90 deg"], ["0 N", "1 kN"], over="crank.angle")
    assert (table.points, table.values) == ((0.0, math.pi / 2), (0.0, 1000.0))
    force = cc.Force("push", "bob.A", x="800 N", y="2*bob.x")
    assert (force.x, force.y.text) == (800.0, "2*bob.x")


def test_a_record_of_another_unit_is_refused_with_what_is_accepted():
    scene = cc.Scene(
        bodies=[cc.Body("bob", mass="2 m", inertia=1.0, points={"A": (0.1, "3 s")})],
        joints=[cc.Revolute("pin", "ground", "bob.A")],
        drives=[cc.motions.Speed("motor", "pin", "45 1/min")],
    )
    with pytest.raises(cc.errors.SceneError) as caught:
        scene.check()
    said = {problem.path: problem.message for problem in caught.value.problems}
    assert list(said) == ["bodies[0].mass", "bodies[0].points.A[1]", "drives[0].speed"]
    assert "may be given in kg" in said["bodies[0].mass"]
    assert "may be given in m, mm" in said["bodies[0].points.A[1]"]
    assert "turns in rpm" in said["drives[0].speed"]


def test_functions_take_texts_with_units():
    given = cc.mechanisms.slider_crank(
        crank_length="50 mm", clearance={"wrist": "20 um"}, crank_speed="2000 rpm"
    )
    assert given == cc.mechanisms.slider_crank(crank_length=0.05, clearance=2e-5, crank_speed=cc.rpm(2000))
    assert cc.simulate(given, duration="1 ms", samples=11).t[-1] == 1e-3
    by_text = cc.mechanisms.hertz_stiffness("9.8 mm", "20 um", "207 GPa", 0.3)
    assert by_text == cc.mechanisms.hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3)
    with pytest.raises(cc.errors.SceneError, match=r"crank_speed: .* turns in rpm"):
        cc.mechanisms.slider_crank(crank_speed="45 1/min")
    with pytest.raises(ValueError, match=r"duration must be a number \[s\].*may be given in s, ms"):
        cc.simulate(given, duration="5 mm", samples=11)
