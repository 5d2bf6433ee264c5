"""Instructions of a run, counted by valgrind's callgrind; see README.md.

python benchmarks/instructions.py [--functions] [--binary FILE]
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import chebclear as cc

ROOT = Path(__file__).resolve().parent.parent
DURATION, SAMPLES, FLOOR = 0.06, 1441, 1e-6
ASKED = ["slider.x", "slider.vx"]
SETTINGS = [("dop853", 1e-4), ("dop853", 1e-6), ("rodas4", 1e-5), ("rodas5p", 1e-5)]
CONVENTIONS = ("as_printed", "corrected")
# Methods of the five scenes: an explicit one and one with a Jacobian.
METHODS = ("dop853", "rodas5p")


def build() -> Path:
    """The binary of ``steps.rs``, built if it is not up to date."""
    command = ["cargo", "bench", "--bench", "steps", "--no-run", "--message-format=json"]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    built = [message for line in lines if (message := json.loads(line)).get("executable")]
    return Path(built[-1]["executable"])


@contextmanager
def written(scene: cc.Scene, **settings: Any) -> Iterator[list[str]]:
    """The arguments of the binary: files with a scene and settings."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / "scene.json", Path(folder) / "settings.json"]
        files[0].write_text(scene.to_json())
        files[1].write_text(json.dumps(settings))
        yield [str(file) for file in files]


def run(binary: Path, scene: cc.Scene, repeats: int = 1, **settings: Any) -> dict[str, Any]:
    """Counters and best time [s] of a run."""
    with written(scene, **settings) as arguments:
        command = [str(binary), *arguments, str(repeats)]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def count(binary: Path, scene: cc.Scene, functions: bool = False, **settings: Any) -> dict[str, Any]:
    """Counters and instructions of a run without reading and compiling the scene."""
    with written(scene, **settings) as arguments:
        profile = Path(arguments[0]).with_name("callgrind.out")
        # `measured` is the function of steps.rs around a run.
        options = ["--tool=callgrind", "--toggle-collect=*steps*measured*", f"--callgrind-out-file={profile}"]
        command = ["valgrind", *options, str(binary), *arguments]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found = json.loads(done.stdout)
        total = re.search(r"Collected : (\d+)", done.stderr)
        if total is None or int(total[1]) == 0:
            raise RuntimeError(f"callgrind counted nothing:\n{done.stderr}")
        found["instructions"] = int(total[1])
        if functions:
            found["functions"] = _by_function(profile, found["instructions"])
        return found


def _by_function(profile: Path, total: int) -> list[str]:
    """The costliest functions without what they call, what is inlined added up."""
    annotate = ["callgrind_annotate", "--auto=no", "--threshold=100", str(profile)]
    text = subprocess.run(annotate, check=True, capture_output=True, text=True).stdout
    costs: dict[str, int] = {}
    for line in text.splitlines():
        if match := re.match(r"\s*([\d,]+) \([ \d.]+%\)\s+\S+?:(.*)", line):
            function = re.sub(r" \[[^\]]*\]$", "", match[2])
            costs[function] = costs.get(function, 0) + int(match[1].replace(",", ""))
    costliest = sorted(costs.items(), key=lambda item: -item[1])[:18]
    return [f"{100 * cost / total:5.1f} %  {function}" for function, cost in costliest]


def _print(name: str, found: dict[str, Any]) -> None:
    print(
        f"{name:<34} {found['instructions'] / 1e6:>9.2f} {found['steps']:>7} {found['stages']:>7} "
        f"{found['evaluations']:>11} {found['instructions'] / max(1, found['stages']):>10.0f} "
        f"{found['instructions'] / max(1, found['evaluations']):>14.0f}  {found['hash']}",
        flush=True,
    )
    for line in found.get("functions", []):
        print("   ", line)


def scenes() -> dict[str, tuple[cc.Scene, float]]:
    """Five scenes from small to large, with durations [s]."""
    # Here, since chains.py needs this file.
    from chains import pendulum

    slider_crank = cc.mechanisms.slider_crank
    pins = ("crank_pin", "wrist")
    return {
        "slider-crank": (slider_crank(impact_velocity_floor=FLOOR), 0.06),
        "two loose pins": (slider_crank(impact_velocity_floor=FLOOR, clearance_at=pins), 0.02),
        "four-bar": (cc.mechanisms.four_bar(impact_velocity_floor=FLOOR), 0.06),
        "six-bar": (cc.mechanisms.six_bar(impact_velocity_floor=FLOOR), 0.06),
        "chain of 8": (pendulum(8), 1.0),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--functions", action="store_true", help="where the instructions go, by function")
    parser.add_argument("--binary", type=Path, help="binary of steps.rs (default: build it)")
    arguments = parser.parse_args()
    binary = arguments.binary or build()
    print(
        f"{'run':<34} {'million':>9} {'steps':>7} {'stages':>7} {'evaluations':>11} {'per stage':>10} "
        f"{'per evaluation':>14}  bits of the samples"
    )
    for convention in CONVENTIONS:
        scene = cc.mechanisms.slider_crank(convention=convention, impact_velocity_floor=FLOOR)
        common = {"duration": DURATION, "samples": SAMPLES, "outputs": ASKED}
        for method, rtol in SETTINGS:
            name = f"{convention} {method} {rtol:.0e}"
            settings = common | {"method": method, "rtol": rtol}
            _print(name, count(binary, scene, functions=arguments.functions, **settings))
    print("\nfive scenes, rtol 1e-6, 2 samples")
    for name, (one, duration) in scenes().items():
        for method in METHODS:
            settings = {"duration": duration, "samples": 2, "method": method, "rtol": 1e-6}
            _print(f"{name} {method}", count(binary, one, functions=arguments.functions, **settings))
    print("\nwhat the samples cost: corrected, dop853, 1e-6")
    settings = {"duration": DURATION, "method": "dop853", "rtol": 1e-6}
    asked = {"2 columns": ASKED, "2 with accelerations": ["slider.ax", "rod.ax"], "all usual columns": None}
    for samples in (2, 1441, 14401):
        for name, outputs in asked.items():
            chosen = {} if outputs is None else {"outputs": outputs}
            found = count(binary, scene, samples=samples, **settings, **chosen)
            _print(f"{samples} samples, {name}", found)


if __name__ == "__main__":
    main()
