"""The rule of widened bands, by its definition, slow, in NumPy alone; docs/theory.md states it."""

import numpy as np

LONGEST = 1 / 12
"""Longest window to either side, a share of the duration."""
ERRORS = 1.0
"""Standard errors that are added to what n rows estimate."""
PART = 0.5
"""Part of the share that may be outside which the fitted tail uses."""


def windows_of(samples):
    longest = LONGEST * (samples - 1)
    return sorted({0, *(int(longest / 1.5**power) for power in range(12))})


def window(at, half, samples, joined):
    """Samples within `half` of one; of revolutions, whose ends are one sample, around these too."""
    places = np.arange(at - half, at + half + 1)
    return places % (samples - 1) if joined else places[(places >= 0) & (places < samples)]


def spread_of(reach, joined):
    """Mean of the straight lines through `reach` over the longest window, plus its mean."""
    samples, half = len(reach), int(LONGEST * (len(reach) - 1))
    found = np.empty(samples)
    for at in range(samples):
        places = np.arange(at - half, at + half + 1)
        values = (
            reach[places % (samples - 1)] if joined else reach[places[(places >= 0) & (places < samples)]]
        )
        found[at] = (
            (values.sum() - 0.5 * (values[0] + values[-1])) / (len(values) - 1)
            if len(values) > 1
            else values[0]
        )
    return np.maximum(found + reach.mean(), 1e-300)


def widened(values, alpha, limits, joined=False):
    """Bounds and the share of held-out samples inside; values are runs x rows of a run x samples."""
    runs, rows, samples = values.shape
    mean = values.mean(axis=(0, 1))
    halves = windows_of(samples)
    sides = []
    for sign in (-1.0, 1.0):
        away = sign * (values - mean)
        of_runs = away.max(axis=1)
        spread = spread_of(of_runs.max(axis=0), joined)
        hulls, without = np.empty((len(halves), samples)), np.empty((len(halves), runs, samples))
        for index, half in enumerate(halves):
            for at in range(samples):
                largest = of_runs[:, window(at, half, samples, joined)].max(axis=1)
                hulls[index, at] = largest.max()
                for run in range(runs):
                    without[index, run, at] = np.delete(largest, run).max()
        outside = np.maximum(away[None] - without[:, :, None], 0.0) / spread
        sides.append((sign, away, spread, hulls, without, outside))
    pooled = np.concatenate([side[-1].ravel() for side in sides])
    pooled = pooled[pooled > 0.0]
    average, variance = pooled.mean(), pooled.var()
    shape = 0.5 * (1.0 - average**2 / variance)
    scale = average * (1.0 - shape)
    error = ERRORS / np.sqrt(runs * rows)
    shape += error
    shares = np.array([[(one > 0.0).mean() for one in side[-1]] for side in sides])
    levels = scale / shape * (np.maximum(shares / (PART * alpha / 2.0), 1.0) ** shape - 1.0)
    bounds = [side[3] + level[:, None] * side[2] for side, level in zip(sides, levels, strict=True)]
    widths = (bounds[0] + bounds[1]).mean(axis=1)
    chosen = widths <= widths.min() * (1.0 + error)
    ends, missed = [], 0.0
    for side, level, bound, limit in zip(sides, levels, bounds, limits, strict=True):
        sign, away, spread, _, without, _ = side
        mean_level = level[chosen].mean()
        end = sign * mean + bound[chosen].mean(axis=0)
        inner = without[chosen].mean(axis=0) + mean_level * spread
        missed += (away - inner[:, None] > 1e-12 * spread).mean()  # a mean of equal numbers is rounded
        largest = (sign * values).max(axis=(0, 1))
        beyond = (largest >= sign * limit).any() & (end + mean_level * spread > sign * limit)
        end = np.where(beyond, sign * limit, np.minimum(end, sign * limit))
        ends.append(sign * np.maximum(end, largest))
    return ends[0], ends[1], 1.0 - missed
