"""What a measured trace says of a study: how much of it is inside the bands, and the parameters that fit."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..decisions.identification import Identification, identify
from ..decisions.measured import Agreement, Measured, load_measured as load_measured
from ..report.document import Items, Picture, Section
from ..study.results import StudyResult
from ..study.study import Study
from .output import Rows

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class TraceFit:
    """What a measured trace says of a study."""

    agreements: dict[str, Agreement]
    """The outputs that were measured."""
    found: Identification | None
    """The parameters, if they were asked for."""

    def __str__(self) -> str:
        return "\n".join(map(str, [*self.agreements.values(), *([self.found] if self.found else [])]))

    @property
    def rows(self) -> Rows:
        """A row for every output."""
        return [
            {"output": name, "inside": one.share, "samples": len(one.places), "outside": one.outside}
            for name, one in self.agreements.items()
        ]

    @property
    def region(self) -> dict[str, Any] | None:
        """The parameters as JSON has them."""
        if self.found is None:
            return None
        names = ("status", "confidence", "ranges", "best", "directions", "open_ends", "deviations", "seed")
        return {name: getattr(self.found, name) for name in names}

    @property
    def section(self) -> Section:
        """The same with pictures."""
        one = self.found
        pictures = [
            Picture(f"{found}.", found.plot, name=f"measured_{name}")
            for name, found in self.agreements.items()
        ]
        if one is not None:
            pictures.append(Picture(f"{one}.", one.plot, name="identified"))
        return Section("What was measured", [Items(str(self).split("\n")), *pictures])


def fit_of(made: Study, result: StudyResult, trace: Measured, options: argparse.Namespace) -> TraceFit:
    """The trace beside the bands of a study, and the parameters if they are asked for."""
    found = None
    if options.identify:
        found = identify(made, trace, options.identify, noise=dict(options.noise))
    return TraceFit(trace.compare(result), found)
