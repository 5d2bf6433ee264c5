"""The examples in the docstrings of the package are true, and texts use known terms."""

import doctest
import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import chebclear
import pytest
from public_names import public_names

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
    for name, one in public_names().items():
        assert one.__doc__, name


def test_only_public_names_are_listed():
    assert {name for name in dir(chebclear) if not name.startswith("__")} <= set(chebclear.__all__)


def test_every_public_function_has_an_example():
    public = public_names().values()
    without = [one.__name__ for one in public if inspect.isfunction(one) and ">>>" not in (one.__doc__ or "")]
    assert not without


# A file that another tool writes, and this list.
UNCHECKED = {"chebclear.bash", "test_docstrings.py"}
BRITISH = (
    "neighbour behaviour colour favour honour centre metre whilst artefact catalogue grey modelling "
    "labelled travelled licence defence fulfils"
).split()
BRITISH_VERBS = (  # before -ise, -ised, -ising, -isation
    "real linear normal general regular optim factor recogn summar initial minim maxim parallel discret "
    "character local serial random stabil equal"
).split()
# Words for which the field has terms: relocation, diverged, at the floor, noise, initial guess of the angle,
# energy balance; chance, prior, lower bound, recent, more expensive, trusted.
COINAGES = (
    "landing landings parted floored drowned glance reliance roughangle booksofenergy luck lucky surely "
    "lately dearer believed"
).split()


def avoided(text):
    """Words of a text that are spelled the British way or are coinages."""
    text = text.lower()
    found = [word for word in BRITISH if word in text]
    verbs = [f"{verb}is" for verb in BRITISH_VERBS if f"{verb}is" in text]
    found += [verb for verb in verbs if re.search(rf"{verb}(e|ed|es|ing|ation|able)\b", text)]
    text = re.sub("rough angle", "roughangle", re.sub("books of (the )?energy", "booksofenergy", text))
    known = [word for word in COINAGES if word in text]
    found += [word for word in known if re.search(rf"(?<![a-z]){word}s?(?![a-z])", text)]
    return found


def test_spelling_is_american_and_coinages_do_not_come_back():
    for wrong in ("Neighbour", "a linearisation", "centres", "a landing", "floored_latches", "Rough angles"):
        assert avoided(wrong), wrong
    for right in (
        "center",
        "linearization",
        "fulfills",
        "planning",
        "parametric",
        "departed",
        "through angles",
    ):
        assert not avoided(right), right
    root = Path(__file__).parents[3]
    folders = ("rust", "python", "tests", "docs", "examples", "benchmarks")
    suffixes = {".rs", ".py", ".pyi", ".md", ".toml"}
    paths = [path for folder in folders for path in (root / folder).rglob("*.*") if path.suffix in suffixes]
    texts = [path for path in [root / "README.md", *paths] if path.name not in UNCHECKED]
    assert len(texts) > 300
    found = {}
    for path in texts:
        place = path.relative_to(root)
        if words := avoided(path.read_text(encoding="utf-8")):
            found[str(place)] = words
    assert not found
