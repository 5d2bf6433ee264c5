"""Starter files: a commented scene file for every ready-made mechanism, to be adapted by the user."""

from __future__ import annotations

from importlib import resources

from ..base.arguments import did_you_mean
from ..errors import ArgumentError


def starter_names() -> tuple[str, ...]:
    """Names of the mechanisms with a starter file."""
    folder = resources.files(__package__) / "starters"
    names = (entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))
    return tuple(sorted(names))


def starter(mechanism: str) -> str:
    """The text of a starter file; with it `loads` gives the mechanism with its default values."""
    names = starter_names()
    if mechanism not in names:
        known = did_you_mean(mechanism, names) or f"; there are {', '.join(names)}"
        raise ArgumentError(f'unknown mechanism "{mechanism}"{known}')
    return (resources.files(__package__) / "starters" / f"{mechanism}.toml").read_text(encoding="utf-8")
