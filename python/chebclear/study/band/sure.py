"""How sure a range is: one of four words, and a sentence with a number and what it rests on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ...base.files import ArrayRecord
from ...base.shown import of_many

Flag = Literal["proved", "estimated", "too few runs", "unknown"]


@dataclass(frozen=True, eq=False, repr=False)
class HowSure(ArrayRecord):
    """How sure a range over the tolerances is; ``str`` says it in a sentence.

    Attributes
    ----------
    flag : Flag
        ``"proved"``: independent runs prove that a further mechanism is inside as often as was asked for, on
        average. ``"estimated"``: runs that took no part in the range are inside as often, or a polynomial
        predicts them. ``"too few runs"``: there are too few to show it, or none in a part of the box.
        ``"unknown"``: nothing says how far other mechanisms go.
    whole : float
        Share of further mechanisms that stay inside for the whole run [-]; NaN if it is unknown.
    instant : float
        Share that is inside at any one instant, on average [-]; NaN if it is unknown.
    error : float
        Largest error of a polynomial that predicts runs it was not made from, over the width of the runs [-];
        NaN without one.
    runs : int
        Runs that it rests on [-].
    over_time : bool
        Whether the range is that of an output over time; else it is of one number for each run.
    """

    flag: Flag
    whole: float
    instant: float
    error: float
    runs: int
    over_time: bool = True

    def __str__(self) -> str:
        parts = []
        if not math.isnan(self.whole):
            where = "stay inside for the whole run" if self.over_time else "are inside"
            parts.append(f"{of_many(self.whole)} further mechanisms {where}")
        if not math.isnan(self.instant):
            at = "at any one instant"
            parts.append(
                f"{at} {of_many(self.instant)}" if parts else f"{of_many(self.instant)} are inside {at}"
            )
        if not (parts or math.isnan(self.error)):
            parts.append(f"a polynomial predicts other runs within {100.0 * self.error:.2g} % of the range")
        if not parts:
            parts.append("how far other mechanisms go is not known")
        return f"{', '.join(parts)}; {self.runs:,} runs"
