"""The classical slider-crank of Flores et al.: 5000 r/min, clearance 0.5 mm, restitution 0.9, no friction.

python benchmarks/flores.py [--out DIRECTORY] [--revolutions N]

Draws two revolutions after the transient, in the layout of the published figures, with the ideal mechanism
beside them, and prints how far the peaks scatter when only the tolerance changes; see docs/validation.md.
"""

from __future__ import annotations

import argparse
import warnings
from dataclasses import replace
from pathlib import Path

import chebclear as cc
import matplotlib.pyplot as plt
import numpy as np

REVOLUTION = 0.012  # [s]
SETTLED, SHOWN = 4, 2  # revolutions left out, and looked at after them
INSTANT = 1e-6  # between samples [s]: fifty or more in an impact
ROWS = [
    (method, rtol)
    for method in ("dop853", "rodas5p")
    for rtol in (1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
]
COLUMNS = (
    "slider.vx",
    "slider.ax",
    "wrist.eccentricity_x",
    "wrist.eccentricity_y",
    "wrist.eccentricity",
    "wrist.penetration",
    "wrist.normal_force",
    "wrist.contact",
    "drive.torque",
)


def loose() -> cc.Scene:
    """The mechanism with play in the wrist; a bearing of 10 mm radius."""
    return cc.mechanisms.slider_crank(
        crank_length=0.05,
        rod_length=0.12,
        crank_mass=0.30,
        rod_mass=0.21,
        slider_mass=0.14,
        clearance=5e-4,
        journal_radius=9.5e-3,
        young_modulus=207e9,
        poisson_ratio=0.3,
        restitution=0.9,
        friction=None,
        crank_speed=cc.rpm(5000),
    )


def ideal() -> cc.Scene:
    """The same without play."""
    scene = loose()
    joints = [
        joint
        if not isinstance(joint, cc.ClearanceRevolute)
        else cc.Revolute(joint.name, joint.bearing, joint.journal)
        for joint in scene.joints
    ]
    return replace(scene, joints=joints)


def simulate(revolutions: int, rtol: float, method: str, outputs: tuple[str, ...] = COLUMNS) -> cc.Trajectory:
    duration = revolutions * REVOLUTION
    return cc.simulate(
        loose(),
        duration=duration,
        samples=round(duration / INSTANT) + 1,
        rtol=rtol,
        method=method,
        outputs=outputs,
    )


def print_scatter() -> None:
    """Peaks of the shown revolutions for methods and tolerances, and how long each run can be trusted."""
    print("| method | rtol | agrees up to | impacts until then | contact force | crank moment | in contact |")
    print("|---|---|---|---|---|---|---|")
    reference = None
    peaks = []
    for method, rtol in ROWS:
        run = simulate(SETTLED + SHOWN, rtol, method)
        if reference is None:
            reference = run
        apart = np.abs(run["slider.vx"] - reference["slider.vx"]) > 0.01 * np.ptp(reference["slider.vx"])
        horizon = run.t[np.argmax(apart)] if apart.any() else run.t[-1]
        onsets = run.events.time[run.events.kind == "onset"]
        shown = run.t >= SETTLED * REVOLUTION
        peak = run["wrist.normal_force"][shown].max(), np.abs(run["drive.torque"][shown]).max()
        peaks.append(peak)
        agrees = "(reference)" if run is reference else f"{1e3 * horizon:.1f} ms"
        print(
            f"| {method} | {rtol:.0e} | {agrees} | {np.sum(onsets < horizon)} "
            f"| {1e-3 * peak[0]:.1f} kN | {peak[1]:.0f} N m | {run['wrist.contact'][shown].mean():.0%} |"
        )
    lowest, highest = np.min(peaks, axis=0), np.max(peaks, axis=0)
    print(
        f"\npeaks of the same two revolutions: {1e-3 * lowest[0]:.1f} to {1e-3 * highest[0]:.1f} kN, "
        f"{lowest[1]:.0f} to {highest[1]:.0f} N m"
    )


def print_distribution(revolutions: int) -> None:
    """Largest contact force and crank moment of every single revolution of a long run."""
    print(f"\nPeaks of single revolutions, {revolutions} of them:\n")
    print(
        "| method | rtol | force: 10 % | median | 90 % | largest | moment: 10 % | median | 90 % | largest |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    steps = round(REVOLUTION / INSTANT)
    for method, rtol in (("dop853", 1e-6), ("dop853", 1e-9), ("rodas5p", 1e-7)):
        run = simulate(SETTLED + revolutions, rtol, method, ("wrist.normal_force", "drive.torque"))
        cells = []
        for column, unit in (("wrist.normal_force", 1e3), ("drive.torque", 1.0)):
            single = np.abs(run[column][SETTLED * steps : -1]).reshape(revolutions, steps).max(axis=1) / unit
            cells += [*np.quantile(single, (0.1, 0.5, 0.9)), single.max()]
        force, moment = cells[:4], cells[4:]
        numbers = " | ".join([f"{cell:.1f} kN" for cell in force] + [f"{cell:.0f} N m" for cell in moment])
        print(f"| {method} | {rtol:.0e} | {numbers} |")


def draw(path: Path) -> None:
    """Two revolutions after the transient: acceleration, contact force, crank moment, journal's path."""
    run = simulate(SETTLED + SHOWN, 1e-9, "dop853")
    first = round(SETTLED * REVOLUTION / INSTANT)
    perfect = cc.simulate(
        ideal(), duration=SHOWN * REVOLUTION, samples=721, outputs=("slider.ax", "drive.torque")
    )
    turn = 360.0 / REVOLUTION
    angle = turn * (run.t[first:] - run.t[first])
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 7.2), layout="constrained")
    panels = [
        (axes[0, 0], "slider.ax", 1e3, "acceleration of the slider [km/s²]"),
        (axes[0, 1], "wrist.normal_force", 1e3, "contact force [kN]"),
        (axes[1, 0], "drive.torque", 1.0, "crank moment [N m]"),
    ]
    for ax, column, unit, label in panels:
        ax.plot(angle, run[column][first:] / unit, linewidth=0.8, label="with clearance")
        if column in perfect.columns:
            ax.plot(turn * perfect.t, perfect[column] / unit, "k--", linewidth=1.0, label="ideal")
        ax.set(xlabel="crank angle [°]", ylabel=label, xlim=(0.0, 360.0 * SHOWN))
        ax.set_xticks(np.arange(0.0, 360.0 * SHOWN + 1.0, 90.0))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    ax = axes[1, 1]
    circle = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.plot(0.5 * np.cos(circle), 0.5 * np.sin(circle), "k--", linewidth=1.0)
    path_x, path_y = (1e3 * run[f"wrist.eccentricity_{axis}"][first:] for axis in "xy")
    ax.plot(path_x, path_y, linewidth=0.6)
    ax.set(xlabel="eccentricity x [mm]", ylabel="eccentricity y [mm]", aspect="equal")
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="directory for the figure; none is drawn if not given")
    parser.add_argument("--revolutions", type=int, default=100, help="of the long runs")
    options = parser.parse_args()
    warnings.simplefilter("ignore", cc.ChebclearWarning)  # a handful of impacts below the velocity floor
    print_scatter()
    print_distribution(options.revolutions)
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        draw(options.out / "flores.png")


if __name__ == "__main__":
    main()
