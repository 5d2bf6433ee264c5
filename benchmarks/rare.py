"""Coverage of rare shares on problems of known truth: a row for each, from repetitions with other seeds.

``python benchmarks/rare.py --seeds 100`` prints how often intervals hold the truth where there is an answer,
how often there is none and why, and what it takes. ``--small`` takes half the particles and proposals and
1000 first draws.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Callable
from statistics import NormalDist

import numpy as np
from chebclear.decisions.splitting import Rounds, Split, is_doubtful, split
from numpy.random import default_rng
from numpy.typing import NDArray

Array = NDArray[np.float64]
Problem = tuple[int, float, Callable[[Array], Array]]


def tail(distance: float) -> float:
    """Probability beyond so many standard deviations [-]."""
    return 0.5 * math.erfc(distance / math.sqrt(2.0))


def along(z: Array) -> Array:
    """The coordinate in the direction of all parameters."""
    return np.asarray(z.sum(axis=1) / math.sqrt(z.shape[1]))


def linear(dimension: int, share: float) -> Problem:
    level = -NormalDist().inv_cdf(share)
    return dimension, share, lambda z: along(z) - level


def rp28(z: Array) -> Array:
    return np.asarray(146.14 - (78064.4 + 11709.7 * z[:, 0]) * (0.0104 + 0.00156 * z[:, 1]))


def rp25(z: Array) -> Array:
    x, y = z.T
    return -np.maximum(x**2 - 8.0 * y + 16.0, -16.0 * x + y + 32.0)


def rp33(z: Array) -> Array:
    return -np.minimum(3.0 * math.sqrt(3.0) - z.sum(axis=1), 3.0 - z[:, 2])


def four_branches(distance: float, far: float) -> Callable[[Array], Array]:
    def badness(z: Array) -> Array:
        x, y = z.T
        near = distance + 0.1 * (x - y) ** 2 - np.abs(x + y) / math.sqrt(2.0)
        return -np.minimum(near, far / math.sqrt(2.0) - np.abs(x - y))

    return badness


def noisy(deviation: float, limit: float) -> Callable[[Array], Array]:
    """Scatter as after many impacts, a normal number that is a hash of all digits, beside a linear
    response."""

    def badness(z: Array) -> Array:
        whole = 43758.5453 * np.sin(1e7 * z @ np.sqrt(np.arange(1.0, 1.0 + z.shape[1])))
        part = np.clip(whole - np.floor(whole), 1e-12, 1.0 - 1e-12)
        scatter = np.array([NormalDist().inv_cdf(float(one)) for one in part])
        return np.asarray(along(z) + deviation * scatter - limit)

    return badness


def breitung(z: Array) -> Array:
    """Two planes: nearly all draws point to the farther one, of which the badness grows first."""
    x, y = z.T
    nearer = np.where(x > 3.5, 4.0 - x, 0.85 - 0.1 * x)
    farther = np.where(y > 2.0, 0.5 - 0.1 * y, 2.3 - y)
    return -np.minimum(nearer, farther)


PROBLEMS: dict[str, Problem] = {
    **{f"linear, d {d}, {p:g}": linear(d, p) for p in (1e-3, 1e-5, 1e-7) for d in (2, 5, 20)},
    "RP107": (10, tail(5.0), lambda z: along(z) - 5.0),
    "RP28": (2, 1.4526e-7, rp28),
    "RP25": (2, 4.1486e-5, rp25),
    "RP31": (2, 3.22668e-3, lambda z: z[:, 1] - 2.0 - 256.0 * z[:, 0] ** 4),
    "RP33": (3, 2.575598e-3, rp33),
    "RP111": (2, 8.0351e-7, lambda z: np.abs(z[:, 0] * z[:, 1]) - 12.5),
    "four branches": (2, 2.222795e-3, four_branches(3.0, 7.0)),
    "four branches, rare": (2, 6.57782e-6, four_branches(4.5, 9.4)),
    "two regions": (5, tail(4.5) + tail(4.7), lambda z: np.maximum(along(z) - 4.5, -along(z) - 4.7)),
    "steps": (5, tail(4.5), lambda z: np.floor(2.0 * along(z)) / 2.0 - 4.5),
    "plateau": (5, tail(4.5), lambda z: np.maximum(along(z), 1.5) - 4.5),
    "jump": (2, tail(4.5) * tail(-2.5) + tail(2.5) ** 2, lambda z: z[:, 0] + 2.0 * (z[:, 1] > 2.5) - 4.5),
    "noise of half": (5, tail(math.sqrt(20.0)), noisy(0.5, 5.0)),
    "noise of twice": (5, tail(math.sqrt(20.0)), noisy(2.0, 10.0)),
    "Breitung": (2, tail(4.0) + tail(5.0), breitung),
}
"""Number of parameters, true share, and badness of standard normal draws."""


def found(problem: Problem, seed: int, small: bool) -> tuple[Split, int]:
    """The answer as `rare_share` gives it, without counting, and the draws that it took."""
    dimension, _, badness = problem
    rounds, draws = (Rounds(8, 25, 3, 5), 1000) if small else (Rounds(), 2000)
    made = 0

    def counted(z: Array) -> Array:
        nonlocal made
        made += len(z)
        return badness(z)

    one = None
    for look in range(2):
        if one is not None:
            if small or not is_doubtful(one):
                break
            rounds = rounds.doubled
        scores = default_rng([seed, look, dimension]).standard_normal((draws, dimension))
        one = split(counted, scores, counted(scores), rounds, seed + 1_000_000 * look)
    assert one is not None
    return one, made


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--seeds", type=int, default=20)
    reader.add_argument("--small", action="store_true")
    reader.add_argument("--only", help="name of a problem, or its beginning")
    options = reader.parse_args()
    print(f"{'problem':22} {'holds':>9} {'none':>5} {'draws':>7} {'inflation':>9}  why none")
    total = held = 0
    for name, problem in PROBLEMS.items():
        if options.only and not name.startswith(options.only):
            continue
        pairs = [found(problem, seed, options.small) for seed in range(options.seeds)]
        answers = [one for one, _ in pairs if one.verdict != "unknown"]
        holds = sum(one.lower <= problem[1] <= one.upper for one in answers)
        why = Counter(one.reason for one, _ in pairs if one.verdict == "unknown")
        inflation = float(np.mean([one.inflation for one, _ in pairs]))
        draws = float(np.mean([made for _, made in pairs]))
        words = ", ".join(f"{reason} {count}" for reason, count in why.items())
        none = options.seeds - len(answers)
        print(
            f"{name:22} {holds:4}/{len(answers):4} {none:5} {draws:7.0f} {inflation:9.2f}  {words}",
            flush=True,
        )
        total, held = total + len(answers), held + holds
    print(f"pooled {held}/{total} = {held / max(total, 1):.3f}")


if __name__ == "__main__":
    main()
