"""Scalar results of a run: what to ask of `simulate` and `Study`."""

from .decisions.kinematics import least_transmission_angle, transmission_angles
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
from .study.features.traces import BandPower, Crossings, MagnitudeQuantile

__all__ = [
    "BandPower",
    "Crossings",
    "Extremum",
    "Feature",
    "MagnitudeQuantile",
    "contact_share",
    "impacts",
    "impulse",
    "least_transmission_angle",
    "loss",
    "lowest",
    "mean",
    "peak",
    "peak_to_peak",
    "rms",
    "time_of_lowest",
    "time_of_peak",
    "transmission_angles",
    "wear",
]
