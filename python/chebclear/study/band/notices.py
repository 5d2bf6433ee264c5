"""What is said of bands: too few runs, polynomials that do not follow, holes, starting transients."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...base.shown import of_many
from ...notices import Notice
from ...run.features import settling_time
from ...scene.scene import Scene
from ..polynomials.holes import HoleFit
from ..polynomials.points import on_cube, unfilled
from .band import Band
from .margin import RESOLVED
from .requirement import Requirement, exact_runs

TOO_FEW_RUNS, SETTLING = "too_few_runs", "settling"
"""Codes of the notices of bands of too few runs, and of those that are widest in the starting transient."""


def remarks(bands: Mapping[str, Band], requirement: Requirement) -> list[Notice]:
    """Notices of the bands of too few runs."""
    short = [name for name, band in bands.items() if band.verdict == "too few runs"]
    if not short:
        return []
    runs, failed = requirement.runs, requirement.failed
    names, share = ", ".join(short), f"{100.0 * requirement.coverage:.10g} %"
    wanted = f"{share} inside at any one instant"

    def told(about: list[str], text: str, **numbers: float) -> Notice:
        return Notice(TOO_FEW_RUNS, f"too few runs: {text}", tuple(about), numbers)

    if requirement.succeeded < requirement.coverage:
        text = f"{failed} of {runs + failed} runs failed and count as outside, which {wanted} does not allow"
        return [told(short, text, failed=failed)]
    if requirement.independent:
        needed = exact_runs(requirement.coverage, requirement.confidence)
        text = f"{runs} runs do not prove {wanted} for {names}, {needed} do"
        return [told(short, text, needed=needed)]
    band = bands[short[0]]
    if requirement.finished and unfilled(on_cube(band.intervals, band.parameters[:runs])):
        text = f"the table has no runs in a part of the box, so that nothing is known of {names} there"
        return [told(short, text)]
    worst = min(bands[name].coverage for name in short)
    # What a further run may be outside for stays, the share of the others falls about as one over the runs.
    needed = math.ceil((runs + failed + 1) * (1.0 - worst) / (1.0 - requirement.coverage)) - 1
    text = (
        f"{runs} runs show that {of_many(worst)} further mechanisms are in the band of {names} at any one "
        f"instant, {share} were required; about {needed} runs would show it"
    )
    return [told(short, text, needed=needed, coverage=worst)]


def told_holes(holes: HoleFit) -> list[Notice]:
    """Notice that polynomials were fitted to fewer runs than the grid has."""
    count = len(holes.missing) + len(holes.known)
    without = f"without {holes.dropped.sum()} of {len(holes.dropped)} terms, those of the highest degree, "
    text = (
        f"holes: the polynomials are fitted by least squares to {len(holes.known)} of {count} runs, "
        f"{without if holes.dropped.any() else ''}with the condition number {holes.condition:.3g}: at the "
        "missing runs they are not checked"
    )
    numbers = {"runs": len(holes.missing), "of_runs": count, "condition": holes.condition}
    return [Notice("holes", text, numbers=numbers)]


def early_widths(bands: Mapping[str, Band], scene: Scene | None) -> list[Notice]:
    """One notice for all bands that are widest before the starting transient of a scene has decayed; those
    that end before it are left out."""
    settled = -math.inf if scene is None else settling_time(scene)
    early = [
        name
        for name, band in bands.items()
        if band.t[int(np.argmax(band.width))] < settled < band.t[-1] and band.max_width > 0.0
    ]
    if not early:
        return []
    text = (
        f"settling: {', '.join(early)}: the band is widest in the first revolution, in the starting "
        f"transient; skip {settled:.4g} s to leave it out"
    )
    return [Notice(SETTLING, text, tuple(early), {"settled": settled})]


def doubts(bands: Mapping[str, Band]) -> list[Notice]:
    """Notices of the outputs that no polynomial follows, or not in all of the box."""
    lost = {
        name: band.margin.error
        for name, band in bands.items()
        if band.surrogate is not None and not band.resolved
    }
    unseen = [name for name, error in lost.items() if error <= RESOLVED]
    found = []
    if unseen:
        text = (
            f"not resolved: {', '.join(unseen)}: more than {100.0 * RESOLVED:g} % of the runs failed, and "
            "where they did the polynomial is not checked: ask for a box in which runs succeed"
        )
        found.append(Notice("not_resolved", text, tuple(unseen)))
    errors = [100.0 * error for error in lost.values() if error > RESOLVED]
    if not errors:
        return found
    others = tuple(name for name in lost if name not in unseen)
    least, most = f"{min(errors):.3g}", f"{max(errors):.3g}"
    size = f"is {most} %" if least == most else f"is {least} to {most} %"
    told = f"{size} of the width of the band" if math.isfinite(max(errors)) else "cannot be told from so few"
    text = (
        f"not resolved: {', '.join(others)}: the error of the polynomial at runs that it was not made from "
        f"{told}. The response may leave its bounds, and neither worst case nor sensitivity is that of the "
        "response. A higher degree helps where the response is smooth; where impacts scatter, "
        "use bands of all runs (kind band) and features instead"
    )
    return [*found, Notice("not_resolved", text, others, {"error": 0.01 * max(errors)})]
