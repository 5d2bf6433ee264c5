"""Spans of time in which clearance hardly affects a sensitivity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base import files as records
from ...base.arguments import Checks
from ...base.rows import Array
from .band import Band, half_window, running_maximum


@dataclass(frozen=True, eq=False, repr=False)
class RestraintZones(records.ArrayRecord):
    """Spans in which clearance hardly affects a sensitivity: the paper's clearance effect restraint zones.

    Attributes
    ----------
    deviation : Array
        Sensitivity minus that without clearance, in its unit, shape (samples,).
    envelope : Array
        Running maximum of the absolute deviation, shape (samples,).
    threshold : float
        Threshold of the envelope.
    spans : tuple[tuple[float, float], ...]
        First and last abscissa of every span on which the envelope is below the threshold; in seconds, or in
        the unit of the abscissa of the zones.
    """

    deviation: Array
    envelope: Array
    threshold: float
    spans: tuple[tuple[float, float], ...]

    def __repr__(self) -> str:
        return f"<RestraintZones: {len(self.spans)} spans>"


def restraint_zones(
    band: Band, ideal: Band, parameter: str, *, window: float, threshold: float = 0.5
) -> RestraintZones:
    """Zones in which clearance hardly affects the sensitivity of an output to a parameter.

    The paper identifies them in its Figs. 10 and 11: there the sensitivity oscillates less about that of the
    mechanism without clearance, and the interval of the output is widened less. Here the running maximum of
    the difference of both is compared with a share of its largest value.

    Parameters
    ----------
    band : Band
        With clearance, of a Chebyshev study.
    ideal : Band
        The same output of the same mechanism without clearance, at the same instants.
    parameter : str
        Name of the parameter, an interval in both.
    window : float
        Length of the running maximum [s], such as a few contacts; at least two samples.
    threshold : float
        Share of the largest deviation [-], above 0 and at most 1.

    Returns
    -------
    RestraintZones
        Its spans are times [s].

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong or the instants differ; all problems are listed.

    Examples
    --------
    >>> import chebclear as cc
    >>> options = {"outputs": ["slider.x"], "duration": 0.01, "samples": 201, "skip": 0.03}
    >>> sides = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> build = cc.mechanisms.slider_crank
    >>> loose = cc.Study(build, sides, **options).chebyshev(degree=2)
    >>> ideal = cc.Study(build, sides, fixed={"clearance_at": ()}, **options).chebyshev(degree=2)
    >>> zones = cc.restraint_zones(loose["slider.x"], ideal["slider.x"], "rod_length", window=1e-3)
    """
    checks = Checks()
    for name, given in (("band", band), ("ideal", ideal)):
        if not isinstance(given, Band):
            checks.add(name, f"must be a Band, got {given!r}", wrong_type=True)
    checks.finish()
    spacing = float(band.t[-1] - band.t[0]) / (len(band.t) - 1)
    length = checks.real("window", window, "s", least=2.0 * spacing)
    share = checks.real("threshold", threshold, "-", above=0.0, most=1.0)
    if band.t.shape != ideal.t.shape or not np.allclose(band.t, ideal.t, rtol=0.0, atol=1e-9 * spacing):
        checks.add("band", "and ideal must have the same instants")
    checks.finish()
    deviation = band.sensitivity(parameter) - ideal.sensitivity(parameter)
    return zones_of(deviation, band.t, half_window(band.t, length), share)


def zones_of(deviation: Array, abscissa: Array, half: int, share: float = 0.5) -> RestraintZones:
    """Zones of the deviation of a sensitivity, by a running maximum over `half` samples to either side and a
    share of the largest deviation [-]."""
    envelope = running_maximum(np.abs(deviation), half)
    threshold = share * float(np.abs(deviation).max())
    return RestraintZones(deviation, envelope, threshold, tuple(spans_below(abscissa, envelope, threshold)))


def spans_below(abscissa: Array, values: Array, threshold: float) -> list[tuple[float, float]]:
    """First and last abscissa of each span on which values stay below the threshold."""
    below = np.concatenate([[False], values < threshold, [False]])
    edges = np.flatnonzero(below[1:] != below[:-1]).reshape(-1, 2)
    return [(float(abscissa[first]), float(abscissa[last - 1])) for first, last in edges]
