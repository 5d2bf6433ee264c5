"""What half and twice of every constant of the core change; see README.md.

python benchmarks/constants.py FOLDER [FILE:NAME=FACTOR,FACTOR ...]

FOLDER gets a copy of the tree in which constants can be multiplied from outside, and the runs of tests.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import random
import re
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
TESTS = ("run", "mechanisms", "scene", "decisions", "study/test_band.py")
# Runs of a constant, wall times of tests, a run and a setting [s], factor of the tolerances of references.
MOST_RUNS, LONGEST_TESTS, LONGEST_RUN, LONGEST_SETTING, TIGHTER = 150, 3600, 0.3, 300, 1e-3
# A definition; sizes of arrays and numbers in patterns; files with tables of coefficients.
CONSTANT = r"^ *(?:pub(?:\([a-z]+\))? )?const ([A-Z][A-Z0-9_]*): \[?(?:f64|usize|u32)[;\]\d ]* =[^;]*;"
SIZES = r"LANES|STACK|LAST|MOST|DIGITS|.*ROWS|SLIDING|FRICTION|GUARDS|FIRST_O.*|NEVER.*|SOME.*|MOST_[PSV].*"
TABLES = re.compile("coefficients|tableaus|start|stages")
FACTORS = """//! Factors of constants; a file gets the names of those that are read.
use std::{collections::HashSet, env::var, fs::File, io::Write, sync::{LazyLock, Mutex}};
static WANTED: LazyLock<String> = LazyLock::new(|| var("CONSTANT").unwrap_or_default());
static READ: LazyLock<Option<Mutex<(File, HashSet<&str>)>>> =
    LazyLock::new(|| var("TELL").ok().map(|file| Mutex::new((File::create(file).unwrap(), HashSet::new()))));
pub trait Number: Copy { fn times(self, factor: f64) -> Self; }
impl Number for f64 { fn times(self, factor: f64) -> Self { self * factor } }
impl Number for usize { fn times(self, factor: f64) -> Self { (self as f64 * factor).max(1.0) as usize } }
impl Number for u32 { fn times(self, factor: f64) -> Self { (self as f64 * factor).max(1.0) as u32 } }
impl<T: Number, const N: usize> Number for [T; N] {
    fn times(self, factor: f64) -> Self { self.map(|x| x.times(factor)) }
}
pub fn scaled<T: Number>(name: &'static str, x: T) -> T {
    if let Some(mut read) = READ.as_ref().map(|read| read.lock().unwrap()) && read.1.insert(name) {
        writeln!(read.0, "{name}").unwrap();
    }
    let factor = WANTED.strip_prefix(name).and_then(|rest| rest.strip_prefix('='));
    factor.map_or(x, |factor| x.times(factor.parse().unwrap()))
}
"""


def make_tree(tree: Path) -> None:
    """A copy of the tree whose constants have factors, built."""
    shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns("target", ".git", "*.so"))
    source = tree / "rust/src"
    texts = {file.relative_to(source).as_posix(): file.read_text() for file in source.rglob("*.rs")}
    homes: dict[str, list[str]] = {}
    for file, text in texts.items():
        for name in [] if TABLES.search(file) else re.findall(CONSTANT, text, re.M):
            if not re.fullmatch(SIZES, name):
                homes.setdefault(name, []).append(file)
    for file, text in texts.items():
        # A name is that of the same file, or what the file imports.
        keys = {}
        for name, files in homes.items():
            others = [home for home in files if re.search(rf"{Path(home).stem}::[^;]*\b{name}\b", text)]
            keys[name] = f"{([file] if file in files else others or files)[0]}:{name}"
        # Not in comments, texts, imports and constants.
        item = r"^ *(?:pub(?:\([a-z]+\))? )?(?:use|const|static) [^;]*;"
        path = rf"(?<!\w)(?:[a-z_]+::)*\b({'|'.join(sorted(homes, key=len, reverse=True))})\b(?!\(|:)"

        def scaled(found: re.Match[str], keys: dict[str, str] = keys) -> str:
            return f'crate::factors::scaled("{keys[found[1]]}", {found[0]})' if found[1] else found[0]

        token = rf'//[^\n]*|"(?:[^"\\]|\\[\s\S])*"|{item}|{path}'
        (source / file).write_text(re.sub(token, scaled, text, flags=re.M))
    (source / "factors.rs").write_text(FACTORS)
    (source / "lib.rs").write_text(texts["lib.rs"] + "mod factors;\n")
    build = ["cargo", "build", "--release", "--lib", "--features", "python"]
    subprocess.run(build, cwd=tree, check=True, env={**os.environ, "CARGO_PROFILE_RELEASE_LTO": "off"})
    (library,) = (tree / "target/release").glob("libchebclear*.so")
    shutil.copy(library, tree / "python/chebclear/_core.abi3.so")


def record(tree: Path) -> list[bytes]:
    """The runs of tests: scenes, settings and starts."""
    import pytest
    from chebclear.run import simulation

    asked: dict[bytes, None] = {}
    run_scene = simulation.run_scene

    def run(scene: Any, settings: Any, report: Any = None, start: Any = None) -> Any:
        asked[pickle.dumps((scene.to_json(), settings.to_json(), start and start.memory))] = None
        return run_scene(scene, settings, report, start)

    simulation.run_scene = run
    pytest.main(["-q", *(str(tree / "tests/python" / test) for test in TESTS)])
    return list(asked)


def answer(case: bytes, tighter: float = 1.0) -> tuple[str, Any, float]:
    """Status, samples and evaluations of a run."""
    from chebclear import _core

    scene, text, start = pickle.loads(case)
    settings = json.loads(text)
    settings |= {
        "rtol": max(settings["rtol"] * tighter, 1e-12),
        "max_steps": min(settings["max_steps"], 20_000),
    }
    try:
        run = _core.Mechanism(scene).simulate(json.dumps(settings), None, start)
    except Exception as error:
        return type(error).__name__, np.zeros((0, 0)), 0.0
    return run["status"], run["values"], run["stats"]["evaluations"]


def forked(function: Any, arguments: list[Any], seconds: float, **variables: str) -> list[Any]:
    """Results of a function in a process that reads constants anew; none if it takes too long."""
    with multiprocessing.get_context("fork").Pool(1, os.environ.update, (variables,)) as pool:
        try:
            return pool.starmap_async(function, arguments).get(seconds)
        except multiprocessing.TimeoutError:
            return []


def compare(plain: list[Any], exact: list[Any], others: list[Any]) -> str:
    """What a factor changes: work and errors are means over the runs that change."""
    work, errors, changed, ends = [0.0], [0.0], 0, 0
    for (end, values, price), (_, truth, _), (new_end, new, new_price) in zip(
        plain, exact, others, strict=True
    ):
        ends += end != new_end
        if (end, price) != (new_end, new_price) or not np.array_equal(values, new, equal_nan=True):
            changed += 1
            if end == new_end and new.shape == truth.shape and price > 0:
                work.append(np.log(new_price / price))
                ratios = np.max(np.abs(new - truth), 0) / np.max(np.abs(values - truth), 0)
                errors.append(np.nan_to_num(np.log(np.nanmedian(ratios))))
    means = [np.exp(np.sum(x) / max(1, len(x) - 1)) for x in (work, errors)]
    return f"{changed} of {len(plain)} change, work times {means[0]:.3f}, errors {means[1]:.2f}, {ends} ends"


def main() -> None:
    warnings.simplefilter("ignore")  # Outputs without errors.
    folder, wanted = Path(sys.argv[1]), dict(text.split("=") for text in sys.argv[2:])
    tree, store = folder / "tree", folder / "runs.pickle"
    if not tree.exists():
        make_tree(tree)
    sys.path.insert(0, str(tree / "python"))
    runs = pickle.loads(store.read_bytes()) if store.exists() else []
    for case in [] if runs else forked(record, [(tree,)], LONGEST_TESTS)[0]:
        # Each alone: what it reads is told once in a process.
        (told := folder / "told").write_text("")
        plain = forked(answer, [(case,)], LONGEST_RUN, TELL=str(told))
        exact = forked(answer, [(case, TIGHTER)], 10 * LONGEST_RUN)
        if plain and exact:
            runs.append((case, plain[0], exact[0], set(told.read_text().split())))
    store.write_bytes(pickle.dumps(runs))
    for name in wanted or sorted(set().union(*(names for *_, names in runs))):
        chosen = [run for run in runs if name in run[3]]
        chosen = random.Random(name).sample(chosen, min(len(chosen), MOST_RUNS))
        cases, plain, exact, _ = map(list, zip(*chosen, strict=True))
        for factor in wanted.get(name, "0.5,2").split(","):
            others = forked(answer, [(case,) for case in cases], LONGEST_SETTING, CONSTANT=f"{name}={factor}")
            print(
                f"{name:45s} {factor:>5s}: {compare(plain, exact, others) if others else 'hangs'}", flush=True
            )


if __name__ == "__main__":
    main()
