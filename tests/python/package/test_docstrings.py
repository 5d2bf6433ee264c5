"""The examples in the docstrings of the package are true."""

import doctest
import importlib
import inspect
import pkgutil

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
