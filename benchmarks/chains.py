"""Cost of a step against the size of the mechanism; see README.md.

python benchmarks/chains.py [--binary FILE]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import chebclear as cc
from instructions import build, count

LENGTH, MASS = 0.1, 0.2
SIZES = (2, 4, 8, 16, 32)
DURATION, MOST_STEPS = 0.1, 100
METHODS = ("dop853", "rodas5p")


def _link(index: int, angle: float) -> cc.Body:
    return cc.Body(
        f"link{index}",
        mass=MASS,
        inertia=MASS * LENGTH**2 / 12,
        center_of_mass=(LENGTH / 2, 0.0),
        points={"A": (0.0, 0.0), "B": (LENGTH, 0.0)},
        angle=angle,
    )


def pendulum(bodies: int, clearances: int = 0) -> cc.Scene:
    """A chain that hangs from ground and swings, the uppermost joints with clearance."""
    law = cc.laws.LankaraniNikravesh(stiffness=1e9, restitution=0.9)
    joints: list[Any] = []
    for index in range(bodies):
        upper = "ground" if index == 0 else f"link{index - 1}.B"
        if index < clearances:
            joint = cc.ClearanceRevolute(
                f"joint{index}",
                bearing=upper,
                journal=f"link{index}.A",
                journal_radius=0.01,
                clearance=1e-5,
                contact=law,
            )
        else:
            joint = cc.Revolute(f"joint{index}", upper, f"link{index}.A")
        joints.append(joint)
    links = [_link(index, -0.5 * math.pi + 0.3 * (-1) ** index) for index in range(bodies)]
    return cc.Scene(bodies=links, joints=joints, forces=[cc.Gravity((0.0, -9.81))])


def spring_chain(bodies: int) -> cc.Scene:
    """The same with a spring and damper between neighbors but one."""
    scene = pendulum(bodies)
    ends = ["ground", *(f"link{index}.B" for index in range(bodies))]
    springs = [
        cc.Spring(f"spring{k}", ends[k], ends[k + 2], stiffness=1e3, length=1.9 * LENGTH, damping=0.1)
        for k in range(bodies - 1)
    ]
    return cc.Scene(bodies=scene.bodies, joints=scene.joints, forces=[*scene.forces, *springs])


def hanging_loop(bodies: int) -> cc.Scene:
    """A chain between two points of ground: one closed loop."""
    # A V: half the links go down, half go up again, symmetrically.
    angle = 0.3 * math.pi
    links = [_link(k, -angle if k < bodies // 2 else angle) for k in range(bodies)]
    span = bodies * LENGTH * math.cos(angle)
    joints = [
        cc.Revolute(f"joint{k}", "ground" if k == 0 else f"link{k - 1}.B", f"link{k}.A")
        for k in range(bodies)
    ]
    joints.append(cc.Revolute("end", f"link{bodies - 1}.B", "ground.end"))
    return cc.Scene(
        ground={"end": (span, 0.0)}, bodies=links, joints=joints, forces=[cc.Gravity((0.0, -9.81))]
    )


def tower(bodies: int) -> cc.Scene:
    """Parallelograms of three bodies each upon one another: as many closed loops."""
    links, joints = [], []
    below = ("ground.A", "ground.B")
    for k in range(bodies // 3):
        left, right, bar = (_link(3 * k + side, angle) for side, angle in enumerate((1.4, 1.4, 0.0)))
        links += [left, right, bar]
        joints += [
            cc.Revolute(f"left{k}", below[0], f"{left.name}.A"),
            cc.Revolute(f"right{k}", below[1], f"{right.name}.A"),
            cc.Revolute(f"top_left{k}", f"{left.name}.B", f"{bar.name}.A"),
            cc.Revolute(f"top_right{k}", f"{right.name}.B", f"{bar.name}.B"),
        ]
        below = (f"{bar.name}.A", f"{bar.name}.B")
    ground = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}
    return cc.Scene(ground=ground, bodies=links, joints=joints, forces=[cc.Gravity((0.0, -9.81))])


def exponent(sizes: Iterable[int], costs: Iterable[float]) -> float:
    """Slope of the last two points in a double logarithmic picture."""
    (a, b), (x, y) = list(sizes)[-2:], list(costs)[-2:]
    return math.log(y / x) / math.log(b / a)


def row(binary: Path, name: str, scene: Callable[[int], cc.Scene], sizes: Iterable[int]) -> None:
    common = {
        "duration": DURATION,
        "samples": 2,
        "rtol": 1e-6,
        "outputs": ["link0.x"],
        "max_steps": MOST_STEPS,
    }
    for method in METHODS:
        found = [count(binary, scene(size), **common, method=method) for size in sizes]
        costs = [run["instructions"] / (run["steps"] + run["rejected"]) for run in found]
        degrees = [run["degrees"] for run in found]
        cells = " ".join(
            f"{d:>4}: {cost / 1e3:>7.1f} {cost / 1e3 / d**3:>6.2f}"
            for d, cost in zip(degrees, costs, strict=True)
        )
        changes = ",".join(str(run["events"]) for run in found)
        print(f"{name:<22} {method:<8} {cells}  {exponent(degrees, costs):>5.2f}   {changes}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, help="binary of steps.rs (default: build it)")
    binary = parser.parse_args().binary or build()
    print(
        "degrees of freedom: thousands of instructions per step and the same per cubed degrees, ..., "
        "exponent of the last two, contact changes in each run"
    )
    row(binary, "pendulum", pendulum, SIZES)
    row(binary, "with springs", spring_chain, SIZES)
    row(binary, "one loop", hanging_loop, SIZES[1:])
    row(binary, "a loop every 3 bodies", tower, (3, 6, 12, 24))
    for clearances in (1, 2, 3, 4):
        row(binary, f"{clearances} with clearance", lambda n, c=clearances: pendulum(n, c), SIZES[1:])


if __name__ == "__main__":
    main()
