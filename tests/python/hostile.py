"""Damaged and hostile input: scene files, scenes as JSON, expressions, result files and stores of runs.

Valid input is mutated: values are replaced by nasty ones, keys renamed, dropped and doubled, texts cut, bytes
flipped. What is read must be refused with a typed error or be sound; every other exception, an abort, or an
input that takes longer than some seconds is a fault. Prints the faults and the counts; ends with status 1 if
there is a fault. A short one is among the tests.

    python tests/python/hostile.py --inputs 100000 --seed 1
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import copy
import hashlib
import io
import json
import random
import shutil
import sys
import time
import warnings
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc
import numpy as np
from chebclear.execution.store import Store
from chebclear.templates.expressions import ExpressionError, parse

SLOWEST = 5.0
"""Longest time that an input may take [s]."""

NASTY = [
    *(0, -1, 1, 2**63, -(2**63), 10**400, 0.0, -0.0, 1e-320, 1e308, -1e308, float("inf"), float("nan")),
    *(
        None,
        True,
        False,
        [],
        {},
        [[]],
        [None],
        "",
        " ",
        "0",
        "NaN",
        "Inf",
        "1 m",
        "1e999 mm",
        "20 um",
        "-1 kg",
    ),
    *(
        "ground",
        "ground.",
        ".A",
        "rod..B",
        "a" * 5000,
        "\x00",
        "é\u202e",
        "${x}",
        "__import__('os')",
        "9**9**9",
    ),
    *([0] * 1000, {"a": {"b": {"c": {}}}}, ["x", 1], [1e308, 1e308], [float("nan")] * 2),
]
EXPRESSIONS = [
    *("1 + 2", "a * b", "a ** b", "(a)", "-a", "sqrt(a)", "sin(a) + cos(b)", "pi", "a / b", "min(a, b)"),
    *("a.b", "a[0]", "lambda: 1", "f(x for x in a)", "a if b else a", "'x'", "a and b", "a @ b", "~a", "{}"),
]


def scenes() -> list[cc.Scene]:
    """Every ready-made mechanism."""
    return [getattr(cc.mechanisms, name)() for name in cc.mechanisms.__all__ if name != "hertz_stiffness"]


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of everything inside a value."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key))


def mutated(value: Any, chance: random.Random) -> Any:
    """A value with one to three things changed."""
    value = copy.deepcopy(value)
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        path = chance.choice(list(places(value)))
        if not path:
            continue
        holder = value
        for key in path[:-1]:
            holder = holder[key]
        last, act = path[-1], chance.randrange(5)
        if act == 0:
            del holder[last]
        elif act == 1 and isinstance(holder, list):
            holder.insert(last, copy.deepcopy(holder[last]))
        elif act == 2 and isinstance(holder, dict):
            holder[chance.choice([f"{last}x", last[:-1] or "q", "", "é", "a" * 300])] = holder.pop(last)
        elif act == 3 and isinstance(holder[last], float):
            holder[last] = holder[last] * chance.choice([-1, 1e-12, 1e12, 1e300, 0, float("nan")])
        else:
            holder[last] = copy.deepcopy(chance.choice(NASTY))
    return value


def torn(text: str, chance: random.Random) -> str:
    """A text with a piece cut out, doubled or replaced."""
    start = chance.randrange(len(text) + 1)
    end = min(len(text), start + chance.choice([0, 1, 1, 2, 5, 40]))
    piece = chance.choice(
        ["", text[start:end] * 2, chance.choice('{}[]"=\n.,#é\x00'), "[" * 600, "9" * 400, "1e99999"]
    )
    return text[:start] + piece + text[end:]


def read_json(chance: random.Random, known: list[Any]) -> Callable[[], object]:
    text = json.dumps(mutated(chance.choice(known), chance))
    text = torn(text, chance) if chance.random() < 0.2 else text

    def read() -> object:
        scene = cc.Scene.from_json(text)
        return scene.check()

    return read


def read_file(chance: random.Random, known: list[str]) -> Callable[[], object]:
    text = torn(chance.choice(known), chance)

    def read() -> object:
        return cc.loads(text)().check()

    return read


def read_expression(chance: random.Random) -> Callable[[], object]:
    text = chance.choice(EXPRESSIONS)
    for _ in range(chance.randrange(6)):
        text = chance.choice(
            [f"({text})", f"{text} + {chance.choice(EXPRESSIONS)}", f"{text} ** {text}", torn(text, chance)]
        )
    return lambda: parse(text).evaluate({"a": chance.choice([0.0, -1.0, 3.0, 1e300]), "b": 2.0})


def read_result(chance: random.Random, known: list[bytes], folder: Path) -> Callable[[], object]:
    data = bytearray(chance.choice(known))
    act = chance.randrange(3)
    if act == 0:
        for _ in range(chance.choice([1, 3, 30])):
            data[chance.randrange(len(data))] = chance.randrange(256)
        found = bytes(data)
    else:
        found = (other_members if act == 1 else other_facts)(bytes(data), chance)
    path = folder / "damaged.npz"

    def read() -> object:
        path.write_bytes(found)
        result = cc.load_result(path)
        str(result)  # what reads as a result must also be one to its users
        return result

    return read


class AnyRuns:
    """An identity whose facts are those of the store."""

    def __init__(self, facts: dict[str, Any]) -> None:
        self._facts = facts

    def facts(self) -> dict[str, Any]:
        return copy.deepcopy(self._facts)


def read_store(chance: random.Random, known: list[dict[str, bytes]], folder: Path) -> Callable[[], object]:
    """A store with one file that is another, under a name that fits its bytes."""
    files = dict(chance.choice(known))
    facts = json.loads(files["store.json"])
    victim = chance.choice(sorted(files))
    data = files.pop(victim)
    if victim == "store.json":
        text = json.dumps(mutated(json.loads(data), chance))
        data = (torn(text, chance) if chance.random() < 0.3 else text).encode("utf-8", "surrogatepass")
        files[victim] = data
    else:
        data = other_piece(data, chance)
        files[f"piece-{hashlib.sha256(data).hexdigest()[:32]}.npz"] = data
    place = folder / "store"

    def read() -> object:
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        for name, content in files.items():
            (place / name).write_bytes(content)
        with Store(place, AnyRuns(facts)) as store:
            found = list(store.read([(0, key) for key in store.keys()]))
        for numbers, piece in found:
            assert len(numbers) == len(piece.values) == len(piece.ends)
        return found

    return read


def other_piece(data: bytes, chance: random.Random) -> bytes:
    """A piece of a store with other bytes, members, texts or arrays."""
    act = chance.randrange(4)
    if act == 0:
        changed = bytearray(data)
        for _ in range(chance.choice([1, 3, 30])):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
        return bytes(changed)
    if act == 1:
        return other_members(data, chance)
    with np.load(io.BytesIO(data)) as archive:
        arrays = dict(archive)
    if act == 2:
        name = chance.choice(["head", "ends"])
        text = json.dumps(mutated(json.loads(str(arrays[name])), chance))
        arrays[name] = np.array(torn(text, chance) if chance.random() < 0.3 else text)
    else:
        name = chance.choice(sorted(arrays))
        array = arrays[name]
        others = [array[..., None], array.ravel(), array.astype("f4" if array.dtype.kind == "f" else "U9")]
        others += [array.T, array[:0]] if array.ndim else [np.array(3.0)]
        others += [np.full_like(array, np.nan)] if array.dtype.kind == "f" else []
        arrays[name] = chance.choice(others)
    out = io.BytesIO()
    (np.savez_compressed if chance.random() < 0.1 else np.savez)(out, **arrays)
    return out.getvalue()


def stores(folder: Path) -> list[dict[str, bytes]]:
    """Two pieces and the head of each store: of a study with a feature, of runs that failed, of a model."""
    box = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    features = {"peak": cc.features.peak("slider.x")}
    options = {"duration": 0.001, "samples": 5, "features": features}
    cc.Study(cc.mechanisms.slider_crank, box, ["slider.x"], store=folder / "a", **options).scan(4)
    cc.Study(line, {"a": cc.Interval.around(1.0, rel=0.1)}, store=folder / "b").scan(4)
    with contextlib.suppress(cc.errors.SimulationError):
        short = cc.Study(cc.mechanisms.slider_crank, box, store=folder / "c", max_steps=60, **options)
        short.scan(4)
    found = []
    for name in "abc":
        pieces = sorted((folder / name).glob("piece-*.npz"))[:2]
        paths = [folder / name / "store.json", *pieces]
        found.append({path.name: path.read_bytes() for path in paths})
    return found


def line(a: float) -> dict[str, Any]:
    """A model of one's own."""
    return {"t": [0.0, 1.0, 2.0], "x": [a, 2.0 * a, 3.0 * a], "slope": a}


def other_facts(data: bytes, chance: random.Random) -> bytes:
    """A saved result that says something else, with checksums that fit."""
    with np.load(io.BytesIO(data)) as archive:
        arrays = dict(archive)
    text = json.dumps(mutated(json.loads(str(arrays["metadata"])), chance))
    arrays["metadata"] = np.array(torn(text, chance) if chance.random() < 0.2 else text)
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def other_members(data: bytes, chance: random.Random) -> bytes:
    """An archive with a member dropped, renamed, cut or exchanged for another."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as source, zipfile.ZipFile(out, "w") as target:
        names = source.namelist()
        chosen, act = chance.choice(names), chance.randrange(4)
        for name in names:
            content = source.read(name)
            if name == chosen and act == 0:
                continue
            if name == chosen and act == 1:
                name = f"x{name}"
            elif name == chosen and act == 2:
                content = content[: chance.randrange(len(content))]
            elif name == chosen:
                content = source.read(chance.choice(names))
            target.writestr(name, content)
    return out.getvalue()


def results(folder: Path) -> list[bytes]:
    """One saved result of each kind."""
    scene = cc.mechanisms.slider_crank()
    run = cc.simulate(scene, duration=0.002, samples=11, outputs=["slider.x"], error="estimate")
    box = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    study = cc.Study(cc.mechanisms.slider_crank, box, outputs=["slider.x"], duration=0.001, samples=5)
    costs = cc.tradeoff(scene, duration=0.001, samples=11, outputs=["slider.x"], rtols=[1e-3, 1e-4])
    polynomial, band = study.chebyshev(degree=2), study.band(12)
    bounds = cc.study_tradeoff(study, degrees=[1], points=[3], holdout=3)
    diagram = cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [2e-5, 3e-5], periods=2, discard=0)
    made = (run, polynomial, band, costs, bounds, diagram, cc.compare(polynomial, band))
    return [one.save(folder / f"{number}.npz").read_bytes() for number, one in enumerate(made)]


def faults(inputs: int, seed: int) -> tuple[list[str], collections.Counter[str]]:
    """What went wrong, and how many inputs of each kind were refused and read."""
    chance = random.Random(seed)
    known_scenes = [json.loads(scene.to_json()) for scene in scenes()]
    known_files = [(Path(__file__).parents[2] / "examples" / "slider_crank.toml").read_text(encoding="utf-8")]
    wrong, counts = [], collections.Counter[str]()
    with TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        known_results, known_stores = results(folder), stores(folder)
        kinds = {
            "scene": (lambda: read_json(chance, known_scenes), (cc.errors.SceneError,)),
            "file": (lambda: read_file(chance, known_files), (cc.errors.SceneError,)),
            "expression": (lambda: read_expression(chance), (ExpressionError,)),
            "result": (lambda: read_result(chance, known_results, folder), (cc.ChebclearError,)),
            "store": (lambda: read_store(chance, known_stores, folder), (cc.errors.StoreError,)),
        }
        for number in range(inputs):
            kind = list(kinds)[number % len(kinds)]
            make, typed = kinds[kind]
            read, state = make(), chance.getstate()
            start = time.perf_counter()
            try:
                read()
                counts[f"{kind} read"] += 1
            except typed:
                counts[f"{kind} refused"] += 1
            except Exception as error:
                wrong.append(f"input {number}, {kind}: {type(error).__name__}: {str(error)[:200]}")
            if time.perf_counter() - start > SLOWEST:
                wrong.append(f"input {number}, {kind}: took {time.perf_counter() - start:.1f} s")
            chance.setstate(state)
    return wrong, counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wrong, counts = faults(options.inputs, options.seed)
    for kind, count in sorted(counts.items()):
        print(f"{kind}: {count}")
    by_text = collections.Counter(fault.partition(", ")[2][:120] for fault in wrong)
    for text, count in by_text.most_common(40):
        print(f"FAULT {count} times: {text}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
