"""Running extremes in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def running_maximum(values: Array, half: int) -> Array:
    """Largest value within `half` samples to both sides; windows are truncated at the ends."""
    # Maxima over spans of 1, 2, 4, ... samples; two overlapping ones of the longest span cover the window.
    size, width, span = len(values), 2 * half + 1, 1
    reach = np.pad(values, half, constant_values=-np.inf)
    while 2 * span <= width:
        reach = np.maximum(reach[:-span], reach[span:])
        span *= 2
    return np.maximum(reach[:size], reach[width - span : width - span + size])
