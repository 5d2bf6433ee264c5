"""Scene files: quantities, expressions, TOML and its places, templates."""

import importlib.resources
import json
import math
import random
import tomllib
from pathlib import Path

import chebclear as cc
import jsonschema
import numpy as np
import pytest
from chebclear.base.units import UnitError, convert, is_quantity
from chebclear.scene.structure import Structures, unpacked
from chebclear.templates.expressions import ExpressionError, parse
from chebclear.templates.reference.json_schema import scene_file_schema
from chebclear.templates.toml_text import read_toml, write_toml
from refusals import refuses

ROOT = Path(__file__).parents[3]

HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__[0]",
    "a.b",
    "a[0]",
    "lambda: 1",
    "[x for x in (1,)]",
    "x if x else 1",
    "f'{a}'",
    "'a' * 9",
    "1j",
    "True",
    "a := 1",
    "abs(*a)",
    "abs(x=1)",
    "eval(1)",
    "a = 1",
    "1, 2",
    "a) + (b",
    "1 # comment",
    "1\n+ 1",
    "１ + 1",
    "",
    "   ",
    "(" * 200 + "1" + ")" * 200,
    "-" * 299 + "1",
    "+".join(["1"] * 149),
    "1" * 301,
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_an_expression_holds_arithmetic_only(text):
    with pytest.raises(ExpressionError):
        parse(text).evaluate({"a": 1.0, "b": 2.0, "x": 3.0})


@pytest.mark.parametrize(
    "text", ["9**9**9", "1e999", "10**400", "1/0", "log(0)", "sqrt(-1)", "(-8)**(1/3)", "exp(1e4)", "0**-1"]
)
def test_a_value_is_a_finite_real_number(text):
    with pytest.raises(ExpressionError):
        parse(text).evaluate({})


def test_expressions_compute_what_python_computes():
    values = {"mass": 0.21, "length": 0.12, "angle": 0.3}
    for text in [
        "mass * length**2 / 12",
        "-length / 2 + 1e-3",
        "2**-1 * (1 - 3) ** 2",
        "cos(angle) * length - hypot(length, mass)",
        "max(length, mass, 1) * atan2(mass, length) + pi",
    ]:
        known = {name: getattr(math, name) for name in ("cos", "hypot", "atan2", "pi")}
        assert parse(text).evaluate(values) == eval(text, {"max": max, **known, **values})


def test_an_error_says_where():
    with pytest.raises(ExpressionError) as caught:
        parse("mass * lenth").evaluate({"mass": 1.0, "length": 2.0})
    assert caught.value.column == 7
    for text in ("sine(1)", "min(2)"):
        with pytest.raises(ExpressionError):
            parse(text)


def test_quantities_have_the_bits_of_their_literals():
    for number in range(1, 1000):
        assert convert(f"{number} um", "m") == float(f"{number}e-6")
        assert convert(f"{number}.5 mm", "m") == float(f"{number}.5e-3")
    assert convert("2000 rpm", "rad/s") == cc.rpm(2000)
    assert convert("30 deg", "rad") == math.radians(30)
    assert convert("7 \u00b5m", "m") == convert("7 \u03bcm", "m") == 7e-6
    assert convert("210 GPa", "Pa") == 210e9
    assert convert("3 kg mm2", "kg m²") == 3e-6
    assert convert("12 N mm/deg", "N m/rad") == pytest.approx(12e-3 * 180 / math.pi, rel=1e-15)


@pytest.mark.parametrize("text", ["0.3 * length", "2 - x", "1 / 3", "2 ** x", "3 + (1)", "mass"])
def test_a_calculation_is_no_quantity(text):
    assert not is_quantity(text)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        *(("5 mm", "kg"), ("5 mg", "m"), ("30 deg", "rad/s"), ("2000 rpm", "rad"), ("3 N", "N/m")),
        *(("5 mm", "-"), ("5 mmm", "m"), ("1e400 m", "m"), ("3 deg2", "rad"), ("3 N/m/s", "N s/m")),
        *(("3 m^99", "m"), ("1e9999 mm", "m")),
    ],
)
def test_a_wrong_unit_is_refused(text, unit):
    with pytest.raises(UnitError):
        convert(text, unit)


TRICKY = '''# comment
format = 1
"a b".'c.d' = { x = 1, y = [1, "x,]", { z = 2 }] }
text = """one
"two" """
[parameters]
rod = { nominal = "120 mm", tol = "0.2 mm" } # after
[[bodies]]
name = 'C:\\path # no comment'
points.A = [
  1, # first
  2
]
[bodies.more]
k=1
[[bodies]]
[[bodies.sub]]
x=1
[[bodies.sub]]
x =  2
'''


def test_every_value_of_a_file_is_found_where_it_stands():
    values, places = read_toml(TRICKY)
    assert values == tomllib.loads(TRICKY)
    lines = TRICKY.split("\n")

    def walk(value, path):
        if isinstance(value, dict):
            for key, item in value.items():
                yield from walk(item, (*path, key))
        elif isinstance(value, list):
            for index, item in enumerate(value):
                yield from walk(item, (*path, index))
        else:
            yield path, value

    for path, value in walk(values, ()):
        place = places[path]
        written = lines[place.line - 1][place.column - 1 :]
        start = json.dumps(value)[:2] if not isinstance(value, str) else written[0]
        assert written.startswith(start[: 1 if isinstance(value, str) else 2]), (path, written)
    assert places["bodies", 1, "sub", 1, "x"][:2] == (20, 6)
    assert places["parameters", "rod", "tol"] == (7, 35, 29)


@pytest.mark.parametrize(
    "text",
    [
        *("x = 5 mm", "x = 5.", "x = .5", "x = [1", "a = 1\na = 2", "x = " + "[" * 5000, "a." * 30 + "b = 1"),
        "x = 1" + "0" * 5000,
    ],
    ids=range(8),
)
def test_what_is_no_toml_is_refused(text):
    with pytest.raises(cc.errors.SceneError):
        read_toml(text)


def test_written_numbers_come_back_to_the_last_bit():
    source = random.Random(3)
    numbers = [math.ldexp(source.uniform(-1, 1), source.randint(-1070, 1020)) for _ in range(5000)]
    numbers += [5e-324, -0.0, 1.7976931348623157e308, 1e22]
    names = ["plain", "with blank", 'q"uote', "umlaut ü", "a.b", "", "new\nline", "\x07"]
    values = {
        "numbers": numbers,
        "texts": names,
        "table": {name: index for index, name in enumerate(names)},
        "tables": [{"a": 1, "deep": {"b": [1.5, {"c": True}]}}, {"sub": [{"x": 1}, {"x": 2}]}],
    }
    again = tomllib.loads(write_toml(values))
    assert again == values
    assert [math.copysign(1, one) for one in again["numbers"]] == [math.copysign(1, one) for one in numbers]


SLIDER_CRANK = """
format = 1
title = "Slider-crank"

[parameters]
crank_length = { nominal = "50 mm", rel = 0.1 }
rod_length = { nominal = "120 mm", plus = "1 mm", minus = "0.5 mm", note = "center to center" }
rod_mass = 0.21
clearance = { limits = ["15 um", "25 um"] }
half = "rod_length / 2"

[[bodies]]
name = "crank"
mass = 0.1
inertia = 1e-5
points = { A = [0, 0], B = ["crank_length", 0] }

[[bodies]]
name = "rod"
mass = "rod_mass"
inertia = "rod_mass * rod_length**2 / 12"
center_of_mass = ["half", 0]
points = { B = [0, 0], C = ["rod_length", 0] }

[[bodies]]
name = "slider"
mass = "140 g"
inertia = 1e-5

[[joints]]
type = "revolute"
name = "bearing"
a = "ground"
b = "crank.A"

[[joints]]
type = "revolute"
name = "crank_pin"
a = "crank.B"
b = "rod.B"

[[joints]]
type = "clearance_revolute"
name = "wrist"
bearing = "rod.C"
journal = "slider"
journal_radius = "9.8 mm"
clearance = "clearance"
contact = { law = "lankarani_nikravesh", stiffness = 3.3e11, restitution = 0.9 }

[[joints]]
type = "prismatic"
name = "guide"
a = "ground"
b = "slider"
axis = [1, 0]

[[drives]]
type = "speed"
name = "drive"
joint = "bearing"
speed = "2000 rpm"

[run]
duration = "3 ms"
samples = 31
outputs = ["slider.x", "wrist.normal_force"]
"""


def test_a_template_gives_scenes_and_studies():
    template = cc.loads(SLIDER_CRANK)
    assert template.title == "Slider-crank"
    assert list(template.intervals) == ["crank_length", "rod_length", "clearance"]
    assert template.intervals["rod_length"] == cc.Interval(0.1195, 0.121, 0.12)
    scene = template(rod_length=0.13)
    rod = scene.bodies[1]
    assert rod.inertia == 0.21 * 0.13**2 / 12
    assert (rod.center_of_mass, rod.points["C"]) == ((0.065, 0.0), (0.13, 0.0))
    assert scene.bodies[2].mass == 0.14
    assert scene.joints[2].clearance == 0.5 * 15e-6 + 0.5 * 25e-6
    assert scene.drives[0].speed == cc.rpm(2000)
    run = template.simulate(samples=4)
    assert (run.columns, len(run.t), run.t[-1]) == (("slider.x", "wrist.normal_force"), 4, 3e-3)
    result = template.study(samples=3).chebyshev(degree=1)
    assert result.parameter_names == ("crank_length", "rod_length", "clearance")
    with pytest.raises(cc.errors.ArgumentTypeError):
        template(rod_lenth=1.0)


def test_a_saved_template_is_the_same(tmp_path):
    template = cc.loads(SLIDER_CRANK)
    path = template.save(tmp_path / "press")
    assert path.name == "press.toml" and [file.name for file in tmp_path.iterdir()] == ["press.toml"]
    again = cc.load(path)
    assert again == template and again() == template() and again.parameters == template.parameters


@pytest.mark.parametrize(
    "make", [cc.mechanisms.six_bar, cc.mechanisms.slider_crank, cc.mechanisms.free_journal]
)
def test_a_scene_in_json_is_a_template_without_parameters(make, tmp_path):
    scene = make()
    (tmp_path / "scene.json").write_text(scene.to_json(indent=1), encoding="utf-8")
    template = cc.load(tmp_path / "scene.json")
    assert template() == scene
    assert cc.load(template.save(tmp_path / "scene"))() == scene
    with pytest.raises(cc.errors.ArgumentError):
        template.study()


def test_all_problems_are_reported_with_their_lines():
    wrong = SLIDER_CRANK
    for right, mistake in [
        ("rel = 0.1 }", 'tol = "0.2 mm" }'),
        ('"rod_mass * rod', '"rod_mas * rod'),
        ('journal = "slider"', 'journal = "slider.D"'),
        ("samples = 31", "sample = 31"),
        ('"140 g"', '"140 gg"'),
        ('[[drives]]\ntype = "speed"', '[[drives]]\ntype = "sped"'),
    ]:
        assert right in wrong
        wrong = wrong.replace(right, mistake)
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(wrong, "press.toml")
    lines = wrong.split("\n")
    expected = {
        'tol = "0.2': "parameters.crank_length.tol",
        "rod_mas *": "bodies[1].inertia",
        '"140 gg"': "bodies[2].mass",
        "sample = 31": "run.sample",
        '"sped"': "drives[0].type",
    }
    found = {problem.path for problem in caught.value.problems}
    for written, path in expected.items():
        number = next(index for index, line in enumerate(lines, 1) if written in line)
        column = lines[number - 1].index(written) + 1
        assert f"press.toml:{number}:{column}: {path}" in found, found


@pytest.mark.parametrize(
    "line",
    [
        'a = "b"\nb = "c + 1"\nc = "a"',
        "a = { nominal = 1, rel = 0.1, limits = [0, 2] }",
        "a = { nominal = 1, rel = 1.5 }",
        "a = { nominal = 1, plus = -1 }",
        "a = { nominal = 0, rel = 0.1 }",
        "a = { limits = [2, 1] }",
        "a = { limits = [1] }",
        "a = {}",
        "a = true",
        "a = nan",
        "'a b' = 1",
        'a = { nominal = 1, rel = "b" }',
        "\n".join(f'p{k} = "p{k + 1}"' for k in range(300)),
    ],
    ids=range(13),
)
def test_wrong_parameters_are_refused(line):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(f"bodies = []\njoints = []\n[parameters]\n{line}\n")
    assert any(": parameters" in problem.path for problem in caught.value.problems)


def test_a_long_chain_of_parameters_is_followed():
    chain = "\n".join(f'p{k} = "p{k + 1}"' for k in range(199))
    text = (
        f"parameters.p199 = 2\n[parameters]\n{chain}".replace("parameters.p199 = 2\n", "", 1) + "\np199 = 2\n"
    )
    text += '[[bodies]]\nname = "a"\nmass = "p0"\ninertia = 1\n[[joints]]\ntype = "revolute"\n'
    assert cc.loads(text + 'name = "pin"\na = "ground"\nb = "a"\n')().bodies[0].mass == 2.0


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "scene.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(cc.errors.SceneError):
        cc.load(tmp_path / "scene.toml")
    (tmp_path / "big.toml").write_text("#" * 1_100_000, encoding="utf-8")
    with refuses("big.toml: file", error=cc.errors.SceneError):
        cc.load(tmp_path / "big.toml")
    with pytest.raises(FileNotFoundError):
        cc.load(tmp_path / "none.toml")


def test_a_number_has_the_unit_of_its_field():
    wrong = SLIDER_CRANK.replace('"9.8 mm"', '"9.8 kg"')
    with refuses("scene:47:18: joints[2].journal_radius", error=cc.errors.SceneError):
        cc.loads(wrong)


def test_the_schema_for_editors_is_that_of_the_records():
    folder = importlib.resources.files("chebclear.templates")
    shipped = json.loads(folder.joinpath("scene.schema.json").read_text(encoding="utf-8"))
    validator = jsonschema.Draft4Validator(shipped)
    validator.check_schema(shipped)
    validator.validate(tomllib.loads(SLIDER_CRANK))
    for make in (cc.mechanisms.six_bar, cc.mechanisms.slider_crank):
        validator.validate(json.loads(make().to_json()))
    for right, mistake in [("journal_radius", "journal_radus"), ('type = "speed"', 'type = "sped"')]:
        assert not validator.is_valid(tomllib.loads(SLIDER_CRANK.replace(right, mistake)))


def test_the_shipped_schema_is_current():
    folder = importlib.resources.files("chebclear.templates")
    shipped = json.loads(folder.joinpath("scene.schema.json").read_text(encoding="utf-8"))
    assert shipped == scene_file_schema(), "run .ci/schema"


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.name)
def test_the_scene_files_of_the_examples_run(path):
    template = cc.load(path)
    jsonschema.Draft4Validator(scene_file_schema()).validate(tomllib.loads(path.read_text(encoding="utf-8")))
    run = template.simulate(duration=1e-3, skip=0.0, samples=3)
    assert run.success and template.study().intervals


ALL_FUNCTIONS = """
format = 1
parameters.a = 0.7
parameters.b = { nominal = 0.4, limits = [0.1, 0.9] }
parameters.c = "a ** b + hypot(a, b, 1)"
parameters.d = "2 * a"
ground.O = ["abs(-b) + acos(b) - asin(b) / atan(b)", "atan2(b, d) * cos(b) ** 3 - -exp(b)"]
joints = [{ type = "revolute", name = "pin", a = "ground.O", b = "bob.A" }]
drives = [{ type = "speed", name = "drive", joint = "pin", speed = "tan(b) + pi", angle = "d * 1e-3" }]
[[bodies]]
name = "bob"
mass = "c + log(b + 2)"
inertia = "max(b, 0.3) * min(b, c, 5)"
points.A = ["sin(b)", "+sqrt(b)"]
"""


@pytest.mark.parametrize("fixed", [{}, {"a": 0.3}, {"d": 0.2}])
def test_the_numbers_of_many_scenes_are_those_of_each_to_the_last_bit(fixed):
    template = cc.loads(ALL_FUNCTIONS)
    structure, like = Structures().flat(template(b=0.5, **fixed))
    rng = random.Random(11)
    values = np.array([rng.uniform(0.1, 0.9) for _ in range(300)])
    numbers, refused = template.scene_numbers(structure, unpacked(like), {"b": values}, fixed)
    assert not refused.any()
    for row, b in zip(numbers, values.tolist(), strict=True):
        assert row.tobytes() == Structures().flat(template(b=b, **fixed))[1]


def test_scenes_without_a_value_among_many_are_those_that_are_refused_alone():
    # No logarithm, no root, no quotient, or a step beyond all numbers whose result would be one again.
    speed = "1 / (b - 0.71) + log(b - 0.3) * (b - 0.7) ** 0.5 + exp(b * 980) ** 0"
    template = cc.loads(
        ALL_FUNCTIONS.replace("tan(b) + pi", speed).replace("nominal = 0.4", "nominal = 0.72")
    )
    values = np.array([0.1, 0.3, 0.5, 0.65, 0.7, 0.71, 0.72, 0.73, 0.8, 2.0])
    nominal = template(b=0.72)
    structure, like = Structures().flat(nominal)
    _, refused = template.scene_numbers(structure, unpacked(like), {"b": values}, {})
    alone = []
    for b in values.tolist():
        try:
            template(b=b)
            alone.append(False)
        except cc.errors.SceneError:
            alone.append(True)
    assert refused.tolist() == alone
    assert True in alone and False in alone


LOADED = """
format = 1
parameters = { stiffness = { nominal = "1.2 N/mm", rel = 0.1 }, v0 = "1 mm/s" }
bodies = [{ name = "ram", mass = 2, inertia = 1 }]
joints = [{ type = "prismatic", name = "guide", a = "ground", b = "ram", axis = [1, 0] }]

[[forces]]
type = "force"
name = "pull"
point = "ram"
x = "-stiffness*ram.x - 3*tanh(ram.vx/v0)"
y = { function = "expression", text = "k*ram.y", constants = { k = "2*stiffness" } }

[[forces]]
type = "force"
name = "push"
point = "ram"
x = { function = "table", points = ["-500 mm", 0.5], values = ["1 N", 2], over = "ram.x", beyond = "hold" }
y = "2 N"
"""


class TestLoadsOfTheMotion:
    def test_parameters_are_constants_of_formulas(self):
        scene = cc.loads(LOADED)(stiffness=1300.0)
        pull, push = scene.forces
        assert pull.x == cc.motions.Expression(
            "-stiffness*ram.x - 3*tanh(ram.vx/v0)", {"stiffness": 1300.0, "v0": 1e-3}
        )
        assert pull.y.constants == {"k": 2600.0}
        assert (push.x.points, push.x.values, push.y) == ((-0.5, 0.5), (1.0, 2.0), 2.0)

    def test_a_study_varies_them_to_the_same_bits(self):
        template = cc.loads(LOADED)
        study = template.study(duration=0.2, samples=3, outputs=["ram.x"])
        runs = study.sample(5, rng=1)
        for index, stiffness in enumerate(runs.parameters[:, 0]):
            alone = cc.simulate(template(stiffness=stiffness), duration=0.2, samples=3, outputs=["ram.x"])
            assert np.array_equal(runs.values("ram.x")[index], alone["ram.x"])

    @pytest.mark.parametrize(
        "text", ["-stifness*ram.x", "-stiffness*rma.x", "stiffnes*2", "time*stiffness*", "12 m"]
    )
    def test_a_bad_formula_is_reported_with_its_line(self, text):
        bad = LOADED.replace("-stiffness*ram.x - 3*tanh(ram.vx/v0)", text)
        with pytest.raises(cc.errors.SceneError) as caught:
            cc.loads(bad)
        assert all(problem.path.startswith("scene:11:") for problem in caught.value.problems)
