"""How often 95 % intervals of shares of the variance hold, on functions that the literature uses for it.

Ishigami and Homma 1990; the G function of Sobol' (Saltelli and Sobol' 1995); Morris 1991; Bratley, Fox and
Niederreiter 1992; the borehole (Harper and Gupta 1983), an OTL circuit (Ben-Ari and Steinberg 2007) and the
weight of a wing (Forrester, Sobester and Keane 2008), all with uniform parameters. None scatters.

    python benchmarks/shares.py [seeds]

prints the share of the intervals that hold the truth, pooled over the parameters and for the worst of them,
and in how many studies there were too few runs for any. True shares are those of conditional means, by Gauss
quadrature in one parameter and 2^14 Sobol' points in the others; 0.001 is allowed for their error.
"""

import sys
from collections.abc import Callable

import numpy as np
from chebclear import _core
from chebclear.errors import ArgumentError
from chebclear.study.features.effects import find_effects, model_of
from numpy.typing import NDArray

Array = NDArray[np.float64]
BUDGETS = (21, 41, 81, 161, 321, 641)


def ishigami(x: Array) -> Array:
    a, b, c = (2.0 * np.pi * (x.T - 0.5))[:3]
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


def g_function(x: Array) -> Array:
    weights = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])
    return np.prod((np.abs(4.0 * x - 2.0) + weights) / (1.0 + weights), axis=1)


def morris(x: Array) -> Array:
    w = 2.0 * (x - 0.5)
    for bent in (2, 4, 6):
        w[:, bent] = 2.0 * (1.1 * x[:, bent] / (x[:, bent] + 0.1) - 0.5)
    index = np.arange(1, 21)
    first = np.where(index <= 10, 20.0, (-1.0) ** index)
    second = np.where((index[:, None] <= 6) & (index <= 6), -15.0, (-1.0) ** (index[:, None] + index))
    value = w @ first + np.einsum("ni,ij,nj->n", w, np.triu(second, 1), w)
    power = [np.sum(w[:, :5] ** k, axis=1) for k in (1, 2, 3)]
    triples = (power[0] ** 3 - 3.0 * power[0] * power[1] + 2.0 * power[2]) / 6.0
    return np.asarray(value - 10.0 * triples + 5.0 * np.prod(w[:, :4], axis=1))


def bratley(x: Array) -> Array:
    signs = (-1.0) ** np.arange(1, x.shape[1] + 1)
    return np.asarray(np.cumprod(x, axis=1) @ signs)


def borehole(x: Array) -> Array:
    lower = np.array([0.05, 100.0, 63070.0, 990.0, 63.1, 700.0, 1120.0, 9855.0])
    upper = np.array([0.15, 50000.0, 115600.0, 1110.0, 116.0, 820.0, 1680.0, 12045.0])
    rw, r, tu, hu, tl, hl, length, k = (lower + (upper - lower) * x).T
    log = np.log(r / rw)
    return np.asarray(
        2.0 * np.pi * tu * (hu - hl) / (log * (1.0 + 2.0 * length * tu / (log * rw**2 * k) + tu / tl))
    )


def circuit(x: Array) -> Array:
    lower, upper = np.array([50, 25, 0.5, 1.2, 0.25, 50.0]), np.array([150, 70, 3.0, 2.5, 1.2, 300.0])
    b1, b2, f, c1, c2, beta = (lower + (upper - lower) * x).T
    gain = beta * (c2 + 9.0)
    base = 12.0 * b2 / (b1 + b2)
    return np.asarray(
        (base + 0.74) * gain / (gain + f) + 11.35 * f / (gain + f) + 0.74 * f * gain / ((gain + f) * c1)
    )


def wing(x: Array) -> Array:
    lower = np.array([150, 220, 6, -10, 16, 0.5, 0.08, 2.5, 1700, 0.025])
    upper = np.array([200, 300, 10, 10, 45, 1.0, 0.18, 6.0, 2500, 0.08])
    s, fuel, aspect, sweep, q, taper, thick, load, gross, paint = (lower + (upper - lower) * x).T
    cosine = np.cos(np.radians(sweep))
    return np.asarray(
        0.036 * s**0.758 * fuel**0.0035 * (aspect / cosine**2) ** 0.6 * q**0.006 * taper**0.04
        * (100.0 * thick / cosine) ** -0.3 * (load * gross) ** 0.49 + s * paint
    )  # fmt: skip


FUNCTIONS: dict[str, tuple[Callable[[Array], Array], int]] = {
    "Ishigami": (ishigami, 3),
    "G": (g_function, 8),
    "Morris": (morris, 20),
    "Bratley": (bratley, 8),
    "borehole": (borehole, 8),
    "OTL circuit": (circuit, 6),
    "wing weight": (wing, 10),
}


def true_shares(function: Callable[[Array], Array], parameters: int, seed: int = 0) -> Array:
    """First-order shares of the variance, shape (parameters,)."""
    cube = 0.5 * (_core.sobol_points(parameters, 0, 2**14, seed) + 1.0)
    total = float(np.var(function(cube)))
    nodes, weights = np.polynomial.legendre.leggauss(32)
    shares = np.empty(parameters)
    for axis in range(parameters):
        means = np.empty(len(nodes))
        for number, node in enumerate(nodes):
            at = cube.copy()
            at[:, axis] = 0.5 * (node + 1.0)
            means[number] = function(at).mean()
        mean = float(means @ weights) / 2.0
        shares[axis] = float(((means - mean) ** 2) @ weights) / 2.0 / total
    return shares


def held(function: Callable[[Array], Array], truth: Array, runs: int, seed: int) -> Array | None:
    """Whether the interval of each parameter holds its share; None where there are too few runs."""
    points = _core.sobol_points(len(truth), 0, runs, seed)
    try:
        effects = find_effects(
            [f"x{number}" for number in range(len(truth))],
            model_of(points, function(0.5 * (points + 1.0))[:, None]),
        )
    except ArgumentError:
        return None
    shares = effects.main.values()
    pairs = zip(shares, truth, strict=True)
    return np.array([each.lower <= true + 1e-3 and true - 1e-3 <= each.upper for each, true in pairs])


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    print("share of intervals that hold [%], pooled (worst parameter); not known [% of the studies]")
    print(f"{'function':12s}", *(f"{runs:>16d}" for runs in BUDGETS))
    for name, (function, parameters) in FUNCTIONS.items():
        truth = true_shares(function, parameters)
        cells = []
        for runs in BUDGETS:
            found = [held(function, truth, runs, seed) for seed in range(seeds)]
            known = np.array([each for each in found if each is not None])
            missing = seeds - len(known)
            if not len(known):
                cells.append(f"{'not known':>16s}")
                continue
            share = 100.0 * (known.sum(axis=0) + missing) / seeds
            text = f"{share.mean():.0f} ({share.min():.0f})" + f"; {100 * missing // seeds}" * (missing > 0)
            cells.append(f"{text:>16s}")
        print(f"{name:12s}", *cells, flush=True)


if __name__ == "__main__":
    main()
