"""Runs from which is taken what requirements look at, and what requests for them have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..base.arguments import Checks
from ..base.rows import Array
from ..errors import ArgumentError
from ..notices import Notice
from ..study.conforming import Watched, extremes_of, watching_for
from ..study.requirements.specification import Specification
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from .trace import made_at


@dataclass(eq=False)
class WatchedRuns:
    """Makes runs for requirements, counts them, and keeps what they warn of."""

    runner: Runner
    """The study with what its runs must keep for the requirements."""
    asked: Mapping[str, Specification]
    """The requirements."""
    watched: dict[str, Watched]
    """What is taken from the runs."""
    made: int = 0
    """Runs made [-]."""
    notices: dict[object, Notice] = field(default_factory=dict)
    """Warnings of the runs, each kind once."""

    def __post_init__(self) -> None:
        # Which end of which quantity: 0 the lower, 1 the upper.
        self.limits = [
            (name, end)
            for name, one in self.watched.items()
            for end in (0, 1)
            if math.isfinite(one.limits[end])
        ]

    @classmethod
    def checked(cls, checks: Checks, runner: Runner, asked: Mapping[str, Specification]) -> Self:
        """Those of a study, after raising all problems; a table of finished runs is one for the caller."""
        watching: Runner = runner
        watched: dict[str, Watched] = {}
        if asked and not isinstance(runner.model, FinishedRuns):
            try:
                watching, watched = watching_for(runner, asked)
            except ArgumentError as error:  # limits of another dimension, unknown outputs
                for problem in error.problems:
                    checks.add(*problem)
        checks.finish()
        return cls(watching, asked, watched)

    def extremes(self, points: Array) -> list[Array]:
        """The lowest and the highest value of each limited quantity in runs, NaN where one failed."""
        runs = made_at(self.runner, points)
        self.made += len(points)
        self.notices = {(one.code, one.about): one for one in runs.notices} | self.notices
        return [
            extremes_of(runs, name, one, self.watched[name], len(points)) for name, one in self.asked.items()
        ]

    def deviations(self, extremes: list[Array]) -> Array:
        """The deviation of each limited quantity in runs; 1 where it has none."""
        by_name = dict(zip(self.asked, extremes, strict=True))
        found = np.array([float(np.nanstd(by_name[name][end])) for name, end in self.limits])
        return np.asarray(np.where(found > 0.0, found, 1.0))

    def excess(self, extremes: list[Array], scales: Array) -> Array:
        """What runs exceed each limit by, over its scale; infinite where one failed, shape (runs, limits)."""
        by_name = dict(zip(self.asked, extremes, strict=True))
        columns = []
        for name, end in self.limits:
            limit, values = self.watched[name].limits[end], by_name[name][end]
            columns.append(values - limit if end else limit - values)
        excess = np.array(columns).T / scales
        return np.asarray(np.where(np.isnan(excess), np.inf, excess))


def check_all_are_made(checks: Checks, runner: Runner) -> None:
    """Refuse a study whose time limit would leave out runs that an answer needs."""
    if runner.execution.max_seconds is not None:
        checks.add("max_seconds", "of the study would end runs of which all are needed: leave it out")
