"""The examples in the docstrings of the package are true, and texts use known terms."""

import doctest
import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import chebclear
import pytest

MODULES = [
    module.name
    for module in pkgutil.walk_packages(chebclear.__path__, "chebclear.")
    if module.name not in ("chebclear._core", "chebclear.__main__")
]


@pytest.mark.parametrize("module", MODULES)
def test_examples(module):
    results = doctest.testmod(importlib.import_module(module))
    assert results.failed == 0


def test_every_public_name_exists_and_is_documented():
    assert chebclear.__all__ == sorted(chebclear.__all__)
    for name in chebclear.__all__:
        assert getattr(chebclear, name).__doc__, name


def test_only_public_names_are_listed():
    assert {name for name in dir(chebclear) if not name.startswith("__")} <= set(chebclear.__all__)


def test_every_public_function_has_an_example():
    public = [getattr(chebclear, name) for name in chebclear.__all__]
    public += [getattr(chebclear.mechanisms, name) for name in chebclear.mechanisms.__all__]
    without = [one.__name__ for one in public if inspect.isfunction(one) and ">>>" not in (one.__doc__ or "")]
    assert not without


# Files that must name what earlier versions wrote, that another tool writes, and this list.
UNCHECKED = {"trajectory.py", "test_files.py", "chebclear.bash", "test_docstrings.py"}
BRITISH = (
    "neighbour behaviour colour favour honour centre metre towards whilst artefact catalogue grey "
    "modelling labelled travelled fulfil(?!l) licence defence"
).split()
BRITISH_ENDINGS = (
    r"(real|linear|normal|general|regular|optim|factor|recogn|summar|initial|minim|maxim|parallel|discret"
    r"|character|local|serial|random|stabil|equal)is(e|ed|es|ing|ation|able)\b"
)
# Coinages of earlier versions. Today: relocation, diverged, at the floor, noise, initial guess of the
# angle, energy balance, exchanged energy.
COINAGES = (
    r"landings? parted floored drowned glance reliance rough.angles? books.of.energy energy.at.play"
).split()
AVOIDED = re.compile(
    "|".join([*BRITISH, BRITISH_ENDINGS, *(rf"(?<![a-z]){word}(?![a-z])" for word in COINAGES)]),
    re.IGNORECASE,
)


def test_spelling_is_american_and_coinages_do_not_come_back():
    for word in (
        "Neighbour",
        "linearisation",
        "fulfils",
        "centres",
        "a landing",
        "floored_latches",
        "rough angle",
    ):
        assert AVOIDED.search(word), word
    for word in (
        "center",
        "linearization",
        "fulfills",
        "planning",
        "parametric",
        "departed",
        "through angles",
    ):
        assert not AVOIDED.search(word), word
    root = Path(__file__).parents[3]
    folders = ("rust", "python", "tests", "docs", "examples", "benchmarks")
    texts = [path for folder in folders for path in (root / folder).rglob("*.*")]
    texts = [
        path for path in [root / "README.md", *texts] if path.suffix in (".rs", ".py", ".pyi", ".md", ".toml")
    ]
    texts = [path for path in texts if path.name not in UNCHECKED]
    assert len(texts) > 300
    found = [
        f"{path.relative_to(root)}:{number}: {match[0]}"
        for path in texts
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for match in AVOIDED.finditer(line)
    ]
    assert not found, "\n".join(found)
