"""Damaged input: values replaced, keys renamed, dropped and doubled, texts cut, arrays exchanged."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import random
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import chebclear as cc
import numpy as np

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
    cc.Study(line, {"a": cc.Interval.around(1.0, rel=0.1)}, store=folder / "b", version="1").scan(4)
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
