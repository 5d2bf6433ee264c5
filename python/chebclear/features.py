"""Scalar results of a run: what to ask of `simulate` and `Study`."""

from .run.features import (
    Extremum,
    Feature,
    contact_share,
    impacts,
    impulse,
    loss,
    lowest,
    mean,
    peak,
    peak_to_peak,
    rms,
    time_of_lowest,
    time_of_peak,
    wear,
)

__all__ = [
    "Extremum",
    "Feature",
    "contact_share",
    "impacts",
    "impulse",
    "loss",
    "lowest",
    "mean",
    "peak",
    "peak_to_peak",
    "rms",
    "time_of_lowest",
    "time_of_peak",
    "wear",
]
