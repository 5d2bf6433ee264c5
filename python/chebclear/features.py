"""Scalar results of a run: what to ask of `simulate` and `Study`."""

from .decisions.kinematics import (
    least_transmission_angle as least_transmission_angle,
    transmission_angles as transmission_angles,
)
from .run.features import (
    Extremum as Extremum,
    Feature as Feature,
    contact_share as contact_share,
    impacts as impacts,
    impulse as impulse,
    loss as loss,
    lowest as lowest,
    mean as mean,
    peak as peak,
    peak_to_peak as peak_to_peak,
    rms as rms,
    time_of_lowest as time_of_lowest,
    time_of_peak as time_of_peak,
    wear as wear,
)
from .study.features.traces import (
    BandPower as BandPower,
    Crossings as Crossings,
    MagnitudeQuantile as MagnitudeQuantile,
)

__all__ = sorted(name for name in vars() if not name.startswith("_"))
