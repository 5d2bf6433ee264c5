"""A four-bar with two worn joints: when they lose contact, what that does to the rocker, and how it looks.

Run it with ``python examples/04_worn_four_bar.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

PINS = ("crank_pin", "rocker_pin")


def settled(clearance):
    """The second revolution with that clearance in both pins."""
    scene = cc.mechanisms.four_bar(clearance_at=PINS, clearance=clearance)
    features = [cc.features.peak("rocker.angular_acceleration"), *(cc.features.wear(pin) for pin in PINS)]
    turn = scene.period
    return cc.simulate(scene, duration=turn, samples=3601, skip=turn, features=features)


runs = {"new": settled(1e-5), "worn": settled({"crank_pin": 1e-4, "rocker_pin": 2e-4})}
for name, run in runs.items():
    peak = run.peak("rocker.angular_acceleration")
    wear = ", ".join(f"{pin} {run.feature(cc.features.wear(pin)):.3g} N m" for pin in PINS)
    words = f"{len(run.contacts)} contacts, peak {peak.value:.3g} rad/s² at {peak.time:.4f} s"
    print(f"{name}: {words}, wear {wear}")

figure = Figure(figsize=(10, 9), layout="constrained")
raster, motion, place = figure.subplots(3, 1)
cc.plots.plot_contacts(runs, ax=raster)
for name in ("worn", "new"):
    cc.plots.plot_trajectory(runs[name], "rocker.angular_acceleration", ax=motion, label=name)
hardest = runs["worn"].contacts.peak_time[runs["worn"].contacts.peak_force.argmax()]
cc.plots.plot_scene(runs["worn"], hardest, exaggerate=40.0, ax=place)
place.set_title("the hardest contact of the worn pins", fontsize="medium")
figure.savefig(folder / "worn_four_bar.png")

# The same as a moving picture; the page plays without network.
animation = cc.animate(runs["worn"], "rocker.angular_acceleration", joint="rocker_pin", frames=60)
animation.save(folder / "worn_four_bar.html")
