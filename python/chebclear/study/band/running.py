"""Running extremes in time."""

from __future__ import annotations

import math

import numpy as np

from ...base.arguments import as_number
from ...base.rows import Array
from ...errors import ArgumentError, ArgumentTypeError


def running_maximum(values: Array, half: int) -> Array:
    """Largest value within `half` samples to both sides; windows are truncated at the ends."""
    # Maxima over spans of 1, 2, 4, ... samples; two overlapping ones of the longest span cover the window.
    size, width, span = len(values), 2 * half + 1, 1
    reach = np.pad(values, half, constant_values=-np.inf)
    while 2 * span <= width:
        reach = np.maximum(reach[:-span], reach[span:])
        span *= 2
    return np.maximum(reach[:size], reach[width - span : width - span + size])


def half_window(t: Array, window: float) -> int:
    """Number of samples to either side in a window of a given length [s], at most all."""
    number = as_number(window)
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    # A tolerance, so that rounding does not remove one of an exact number of samples.
    known = number if number is not None and math.isfinite(number) else 0.0
    half = int(min(0.5 * known / spacing + 1e-6, len(t)))
    if half < 1:
        kind = ArgumentTypeError if number is None else ArgumentError
        raise kind(f"window must be a finite number >= {2.0 * spacing:.6g} [s], two samples, got {window!r}")
    return min(half, len(t) - 1)
