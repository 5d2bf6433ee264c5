"""Scenes in words: all parts and units, what is cut and why, and every problem of a wrong scene."""

import ast
import dataclasses
import importlib
import inspect
import itertools
import pkgutil
import re

import chebclear as cc
import pytest
from chebclear.base.units import units
from chebclear.scene.schema import Part
from refusals import refuses

MODULES = [
    importlib.import_module(module.name)
    for module in pkgutil.walk_packages(cc.__path__, "chebclear.")
    if module.name not in ("chebclear._core", "chebclear.__main__")
]
DATACLASSES = sorted(
    {
        item
        for module in MODULES
        for item in vars(module).values()
        if isinstance(item, type) and item.__module__ == module.__name__ and dataclasses.is_dataclass(item)
    },
    key=lambda item: item.__name__,
)
RECORDS = [item for item in DATACLASSES if issubclass(item, Part)]
BRACKETS = re.compile(r"\[([^\[\]]+)\]")


@pytest.mark.parametrize("record", RECORDS)
def test_every_number_of_every_record_has_a_unit(record):
    numbers = [
        field.name
        for field in dataclasses.fields(record)
        if field.type.startswith("float") or field.type in ("Vector", "Numbers", "Mapping[str, Vector]")
    ]
    assert set(numbers) <= set(units(record))


@pytest.mark.parametrize("record", RECORDS)
def test_docstrings_of_records_name_the_units_of_their_fields(record):
    assert told_in_docstring(record) == units(record)


def told_in_docstring(record):
    """Units by field from the section "Parameters" of a docstring."""
    told, names = {}, []
    for line in inspect.getdoc(record).splitlines():
        heading = re.match(r"(\w[\w, ]*) : ", line)
        names = heading[1].split(", ") if heading else names if line.startswith(" ") else []
        for symbol in BRACKETS.findall("" if heading else line):
            told |= {name: symbol for name in names if name not in told}
    told.pop("angles", None)  # of a scene: no field
    return told


@pytest.mark.parametrize("record", [item for item in DATACLASSES if item not in RECORDS])
def test_docstrings_of_results_name_the_units_of_their_fields(record):
    """A field of one unit has it as metadata: `field(metadata=unit("s"))`; counts and ratios need none."""
    own = [one for one in record.__mro__ if dataclasses.is_dataclass(one)]
    docs = {
        line.target.id: below.value.value
        for one in own
        for line, below in itertools.pairwise(ast.parse(inspect.getsource(one)).body[0].body)
        if isinstance(line, ast.AnnAssign) and isinstance(below, ast.Expr)
    }
    # Public ones have a section of their fields, which `help` shows.
    section = inspect.getdoc(record).partition("Attributes\n----------\n")[2]
    docs |= dict(re.findall(r"^(\w+) : [^\n]*\n((?:    [^\n]*\n?)+)", section, re.MULTILINE))
    told = {name: set(BRACKETS.findall(text)) - {"-", "SI unit", "SI units"} for name, text in docs.items()}
    told = {name: symbols.pop() for name, symbols in told.items() if len(symbols) == 1}
    if record is cc.Settings:  # its docstring is that of the keywords of `simulate`
        units_told = told_in_docstring(record).items()
        told = {name: symbol for name, symbol in units_told if symbol in ("s", "m", "m/s")}
    assert told == units(record)


def test_every_number_of_a_mechanism_is_described_with_a_unit():
    for build in (cc.mechanisms.slider_crank, cc.mechanisms.six_bar, cc.mechanisms.quick_return):
        text = build(gravity=9.81).describe()
        assert "?" not in text and "[N/m^1.5]" in text and "[m/s²]" in text


def test_poses_are_shown_with_six_digits_at_any_size():
    size = 1.234567e-6
    tiny = cc.Body("tiny", 1.0, 1.0, points={"P": (-size, 0.0)})
    text = cc.Scene([tiny], [cc.Revolute("pin", "ground.O", "tiny.P")], ground={"O": (0.0, 0.0)}).describe()
    shown = text.split("assembled at")[1].splitlines()[1].split()
    assert shown == ["tiny", "1.23457e-06", "0", "0"]


def test_a_wrong_scene_is_described_with_all_its_problems():
    wrong = cc.Scene(
        [cc.Body("a", "heavy", 1.0), 3], [cc.Revolute("r", "ground", "a.Q"), 5], forces=7, drives=[None]
    )
    text = wrong.describe()
    assert "This scene cannot be simulated:" in text
    with pytest.raises(cc.errors.SceneError) as caught:
        wrong.check()
    for problem in caught.value.problems:
        assert str(problem) in text


def test_redundant_joints_and_structures_are_named():
    def bar(name, length):
        points = {"P": (0.0, 0.0), "Q": (length, 0.0)}
        return cc.Body(name, 1.0, 0.1, center_of_mass=(0.5 * length, 0.0), points=points, angle=1.0)

    plate = cc.Body("plate", 1.0, 0.1, points={"P": (0.0, 0.0), "Q": (1.0, 0.0), "S": (2.0, 0.0)})
    pins = [
        cc.Revolute(*ends)
        for ends in (
            ("A", "ground.A", "a.P"),
            ("B", "ground.B", "b.P"),
            ("C", "ground.C", "c.P"),
            ("D", "a.Q", "plate.P"),
            ("E", "b.Q", "plate.Q"),
            ("F", "c.Q", "plate.S"),
        )
    ]
    ground = {"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (2.0, 0.0)}
    cranks = [bar(name, 0.5) for name in "abc"]
    drive = [cc.motions.Speed("drive", "A", 10.0, angle=1.0)]
    with refuses("joints"):
        cc.Scene([*cranks, plate], pins, (), drive, ground).check()
    # As a parallelogram of two cranks it is fine, and as a frame on three welded feet it is a structure.
    two = cc.Scene([*cranks[:2], plate], [*pins[:2], *pins[3:5]], (), drive, ground)
    assert two.check().degrees_of_freedom == 0
    frame = cc.Scene([plate], [cc.Fixed("foot", "ground.A", "plate.P")], ground=ground)
    with refuses("joints", error=cc.errors.SceneError):
        frame.check()


def test_functions_and_starts_have_the_units_of_what_they_belong_to():
    scene = cc.Scene(
        [cc.Body("cart", 1.0, 1.0), cc.Body("arm", 1.0, 1.0)],
        [cc.Prismatic("rail", "ground", "cart", (1.0, 0.0)), cc.Revolute("pin", "cart", "arm")],
        [
            cc.Force("push", "arm", cc.motions.Harmonic(6.0, 7.0), 3.0),
            cc.Torque("motor", "arm", cc.motions.Table(range(40), range(40))),
        ],
        [cc.motions.Motion("shaker", "rail", cc.motions.Polynomial([1.0, 2.0]))],
        start=[cc.JointStart("pin", 0.5, 16.0)],
    )
    text = scene.describe()
    for words in (
        "x: harmonic, amplitude 6 [N], angular frequency 7 [rad/s], phase 0 [rad], mean 0 [N]",
        "y: 3 [N]",
        "torque: table, points (0, 1, 2, 3, 4, 5, ... 33 more ..., 39) [s]",
        "motion: polynomial, coefficients (1, 2) [m / s^k]",
        "joint pin, position 0.5 [rad], velocity 16 [rad/s]",
        "further ones by name",
    ):
        assert words in text, words
    turned = dataclasses.replace(
        scene, drives=[cc.motions.Motion("shaker", "pin", 0.25)], start=[cc.JointStart("rail", 0.5, 16.0)]
    ).describe()
    assert "motion: 0.25 [rad]" in turned and "position 0.5 [m], velocity 16 [m/s]" in turned
