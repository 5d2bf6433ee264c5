"""Random calls of the public functions, with arguments that are right, nearly right and absurd.

    python benchmarks/calls.py [--calls 20000] [--seed 1]

A call must return, or raise an error of the package or a TypeError, and end within some seconds. All else
that it raises is a fault. Prints the faults and the counts; ends
with status 1 if there is a fault.
"""

from __future__ import annotations

import argparse
import inspect
import math
import os
import random
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

import chebclear as cc
import numpy as np

SLOWEST = 30
"""Longest time that a call may take [s]."""

OUTPUTS = ["slider.x", "slider.vx", "wrist.normal_force"]
T = [0.0, 0.5, 1.0]
# What takes the place of an argument; nothing that asks for more work than the machine has is left out, but
# nothing either that is right and asks for hours.
ABSURD: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 7, 2**31, 2**63, -(2**63), 10**400, 0.0, -0.0, 0.5, 1.0, 1e-320, 1e308),
    *(
        math.inf,
        -math.inf,
        math.nan,
        1j,
        "",
        " ",
        "x",
        "slider",
        "slider.x",
        "slider.*",
        "*",
        "peak",
        "\x1b[2J",
    ),
    *(
        "\ud800",
        "a" * 5000,
        "$x_{$",
        "/dev/null/x",
        "no/such/folder/x",
        b"bytes",
        (),
        [],
        {},
        set(),
        frozenset(),
    ),
    *(
        [[]],
        [None],
        [0],
        [0.0, 1.0],
        [1.0, 0.0],
        [math.nan],
        ["slider.x"],
        ["slider.x"] * 2,
        ["x", 1],
        {"a": 1},
    ),
    *({"rod_length": 1.0}, {1: 2}, {"x": [1.0, 2.0]}, range(3), object(), int, len, lambda *a, **b: None),
    *(np.float64(0.5), np.int8(3), np.nan, np.array(1.0), np.array([]), np.zeros(3), np.zeros((2, 2))),
    *(
        np.array([math.nan, 1.0]),
        np.array(["a"]),
        np.array([None]),
        np.zeros(2, complex),
        np.zeros((1, 1, 1)),
    ),
    *(np.ma.masked, np.ma.array([1.0, 2.0], mask=[0, 1]), np.datetime64("2020"), Path(), Path("x"), Ellipsis),
    *(
        cc.Interval(1.0, 2.0),
        cc.features.peak("slider.x"),
        cc.uniform(0.0, 1.0),
        cc.Gravity((0.0, 0.0)),
        cc.laws.Hertz(1e9),
    ),
)


def line(a: float, b: float) -> dict[str, Any]:
    """A model of one's own."""
    return {"t": T, "x": [a, a * b, b], "y": a + b}


def right(folder: Path) -> tuple[dict[str, list[Any]], list[Any]]:
    """Values by the name of an argument, and results whose methods are called."""
    scene = cc.mechanisms.slider_crank()
    box = {"rod_length": cc.Interval.around(0.12, rel=0.01), "clearance": cc.Interval.around(2e-5, rel=0.1)}
    options = {"duration": 0.001, "samples": 5, "features": {"top": cc.features.peak("slider.x")}}
    run = cc.simulate(
        scene, duration=0.004, samples=21, error="estimate", features=[cc.features.peak("slider.x")]
    )
    study = cc.Study(cc.mechanisms.slider_crank, box, OUTPUTS, **options)
    own = cc.Study(line, {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)})
    band, polynomial, scan = study.band(12), study.chebyshev(degree=2), own.scan(3)
    costs = cc.tradeoff(scene, duration=0.001, samples=11, outputs=["slider.x"], rtols=[1e-3, 1e-4])
    bounds = cc.study_tradeoff(own, degrees=[1], points=[3], runs=[9], holdout=5)
    diagram = cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [2e-5, 3e-5], periods=2, discard=0)
    comparison = cc.compare(polynomial, band)
    template = cc.loads((Path(__file__).parents[1] / "examples" / "slider_crank.toml").read_text("utf-8"))
    saved = run.save(folder / "run.npz")
    values: dict[str, list[Any]] = {
        "scene": [scene, run],
        "build": [cc.mechanisms.slider_crank, line, template],
        "parameter": ["clearance", "rod_length", "a"],
        "parameters": [
            box,
            {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)},
            {"a": [1.0, 2.0]},
        ],
        "intervals": [box],
        "values": [[2e-5, 3e-5], {"x": [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]]}, {"y": [1.0, 2.0]}],
        "t": [T, 0.0],
        "output": OUTPUTS,
        "outputs": [OUTPUTS, ["slider.*"]],
        "columns": ["slider.x", OUTPUTS],
        "feature": ["top", cc.features.rms("slider.x")],
        "features": [{"top": cc.features.peak("slider.x")}, [cc.features.peak("slider.x")]],
        "name": ["top", "slider.x"],
        "joint": ["wrist"],
        "duration": [0.001],
        "samples": [5],
        "runs": [5, 12],
        "degree": [1, 2],
        "degrees": [[1, 2]],
        "nodes": [4],
        "points": [2, [2, 3]],
        "holdout": [4],
        "periods": [2],
        "repeats": [1],
        "rtol": [1e-4],
        "rtols": [[1e-3]],
        "reference_rtol": [1e-9],
        "max_steps": [20_000],
        "max_events": [500],
        "max_runs": [30],
        "frames": [2],
        "result": [band, polynomial, scan, bounds, costs, diagram],
        "reference": [band, scan],
        "run": [run],
        "settings": [cc.Settings(duration=0.001, samples=5)],
        "start": [run.end, None, 0.0],
        "path": [folder / "out.npz", folder / "out", saved, str(folder / "out.html")],
        "text": ["{}", template.to_toml(), scene.to_json()],
        "method": ["auto", "band", "scan"],
        "bodies": [scene.bodies],
        "joints": [scene.joints],
        "kind": ["peak"],
        "of": ["slider.x"],
        "first": [1.0],
        "upper": [2.0],
    }
    made = [scene, run, study, own, band, polynomial, scan, costs, bounds, diagram, comparison, template]
    made += [
        band["slider.x"],
        polynomial["slider.x"],
        band.features["top"],
        band.ranking("top"),
        run.contacts,
    ]
    made += [run.events, run.error, cc.Settings(duration=0.001, samples=5), costs.points[0]]
    return values, made


# Classes that users call, and methods of one room for another or too slow for so many calls.
_INNER = """
    dataset extended
    worst_cases scene scene_numbers scene_at from_dict fitted
    gathered for_scene of between report
""".split()
_MAKERS = ("Study", "Scene", "Settings", "Feature", "Interval", "Uniform", "Normal")


def targets(made: list[Any]) -> Iterator[tuple[str, Callable[..., Any]]]:
    """All functions, the classes that users call, and the methods of the results."""
    rooms = [cc, cc.errors, cc.features, cc.laws, cc.motions, cc.plots, cc.results]
    for name, one in ((name, getattr(room, name)) for room in rooms for name in room.__all__):
        if inspect.isfunction(one):
            yield name, one
        elif (inspect.isclass(one) and one.__module__.startswith("chebclear.scene")) or name in _MAKERS:
            yield name, one
    for name in cc.mechanisms.__all__:
        yield f"mechanisms.{name}", getattr(cc.mechanisms, name)
    yield "Study.from_runs", cc.Study.from_runs
    yield "Scene.from_json", cc.Scene.from_json
    for one in made:
        for name in (name for name in dir(type(one)) if not name.startswith("_") and name not in _INNER):
            method = getattr(one, name, None)
            if inspect.ismethod(method) and (type(one).__name__, name) != ("StudyResult", "from_runs"):
                yield f"{type(one).__name__}.{name}", method
        for name in ("__getitem__", "__call__", "__contains__"):
            if any(name in vars(kind) for kind in type(one).__mro__):
                yield f"{type(one).__name__}.{name}", getattr(one, name)


def arguments(
    function: Callable[..., Any], values: dict[str, list[Any]], chance: random.Random
) -> tuple[list[Any], dict[str, Any]]:
    """Arguments of a call: the right ones as far as there are some, then one or two others."""
    given: dict[str, Any] = {}
    positional: list[Any] = []
    slots = [
        item
        for item in inspect.signature(function).parameters.values()
        if item.kind is not item.VAR_KEYWORD and item.kind is not item.VAR_POSITIONAL
    ]
    for item in slots:
        needed = item.default is item.empty
        limits = item.name in ("max_steps", "max_runs", "periods", "holdout", "repeats", "frames", "rtols")
        if needed or limits or chance.random() < 0.1:
            given[item.name] = chance.choice(values.get(item.name) or ABSURD)
    for item in chance.sample(slots, min(len(slots), chance.choice([0, 1, 1, 1, 2]))):
        given[item.name] = chance.choice(ABSURD)
    for item in slots:
        if item.kind is item.POSITIONAL_ONLY and item.name in given:
            positional.append(given.pop(item.name))
    if chance.random() < 0.02:
        given[chance.choice(["no_such", "rod_length", "duration", "ax"])] = chance.choice(ABSURD)
    return positional, given


class TooLongError(Exception):
    """A call did not end."""


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TooLongError


def described(given: dict[str, Any], positional: list[Any]) -> str:
    pairs = [f"{value!r:.60}" for value in positional]
    pairs += [f"{key}={value!r:.60}" for key, value in given.items()]
    return ", ".join(pairs).replace("\n", " ")


def _is_told(label: str, error: BaseException) -> bool:
    """Whether it is the error that Python's users expect of what is not there: an entry, a file, a value."""
    if label.endswith("__getitem__") and isinstance(error, LookupError | OverflowError):
        return True
    # Of Python's own sequences, which compare what they hold with what is given.
    if label.endswith((".index", ".count", ".__contains__")) and isinstance(
        error, ValueError | OverflowError
    ):
        return True
    # Keywords that plots pass on are refused by matplotlib.
    if isinstance(error, AttributeError) and "got an unexpected keyword argument" in str(error):
        return True
    if isinstance(error, KeyError):
        return " " in str(error.args[0])  # in words
    # A path that no system has is refused by Python itself.
    return isinstance(error, OSError | UnicodeEncodeError)


def faults(calls: int, seed: int) -> tuple[list[str], Counter[str]]:
    """What went wrong, and how many calls returned and were refused."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    chance, wrong, counts = random.Random(seed), [], Counter[str]()
    with TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        os.chdir(folder)  # where relative paths lead
        values, made = right(folder)
        known = list(targets(made))
        signal.signal(signal.SIGALRM, _too_long)
        for number in range(calls):
            label, function = chance.choice(known)
            positional, given = arguments(function, values, chance)
            signal.alarm(SLOWEST)
            begin, state = time.perf_counter(), chance.getstate()
            try:
                with np.errstate(all="ignore"):
                    found = function(*positional, **given)
                repr(found)
                counts["returned"] += 1
            except (cc.ChebclearError, TypeError) as error:
                str(error)
                counts["refused"] += 1
            except (Exception, SystemExit) as error:
                place = traceback.extract_tb(error.__traceback__)[-1]
                where = f"{Path(place.filename).name}:{place.lineno}"
                text = f"{type(error).__name__} at {where}: {str(error)[:120]!a}"
                if _is_told(label, error):
                    counts["refused"] += 1
                else:
                    wrong.append(f"{label}: {text}; call {number}: {label}({described(given, positional)})")
            finally:
                signal.alarm(0)
            if time.perf_counter() - begin > SLOWEST - 1:
                wrong.append(
                    f"{label}: took {time.perf_counter() - begin:.0f} s; {described(given, positional)}"
                )
            chance.setstate(state)
            if plt.get_fignums():
                plt.close("all")
    return wrong, counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calls", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wrong, counts = faults(options.calls, options.seed)
    told = f"{counts['returned']} returned, {counts['refused']} refused"
    print(f"{options.calls} calls: {told}, {len(wrong)} faults")
    kinds = {fault.partition("; ")[0]: fault for fault in wrong}
    for fault in kinds.values():
        print(f"FAULT {fault}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
