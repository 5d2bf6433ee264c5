"""The examples in the docstrings of the package are true."""

import doctest
import importlib
import pkgutil

import chebclear
import pytest

MODULES = [module.name for module in pkgutil.iter_modules(chebclear.__path__) if module.name != "_core"]


@pytest.mark.parametrize("module", MODULES)
def test_examples(module):
    results = doctest.testmod(importlib.import_module(f"chebclear.{module}"))
    assert results.failed == 0


def test_every_public_name_exists_and_is_documented():
    assert chebclear.__all__ == sorted(chebclear.__all__)
    for name in chebclear.__all__:
        assert getattr(chebclear, name).__doc__, name
