"""The ready-made mechanisms: what they are, what they look like, and what play in their pins does.

Run it with ``python examples/11_mechanisms.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# What a scene is made of, what can move, and where its loops are cut.
scene = cc.mechanisms.six_bar(crank_angle=0.9, clearance_at=("rocker_pin", "output_pin"))
print(scene.describe())

# All of them as assembled, with the clearances drawn a hundred times larger.
scenes = {
    "slider_crank": cc.mechanisms.slider_crank(crank_angle=0.9),
    "four_bar": cc.mechanisms.four_bar(crank_angle=0.9),
    "six_bar": scene,
    "quick_return": cc.mechanisms.quick_return(crank_angle=0.9),
    "pendulum_in_bearing": cc.mechanisms.pendulum_in_bearing(),
    "free_journal": cc.mechanisms.free_journal(),
}
figure = Figure(figsize=(12, 14), layout="constrained")
for ax, (name, each) in zip(figure.subplots(3, 2).flat, scenes.items(), strict=True):
    cc.plots.plot_scene(each, ax=ax, exaggerate=100.0)
    ax.set_title(name.replace("_", " "))
figure.savefig(folder / "mechanisms.png")

# The rocker of a four-bar, with play in none, one and two of its pins, over one turn of the crank. The first
# turn is skipped: a start with every journal in the middle of its bearing makes the largest impacts.
figure = Figure(figsize=(8, 4), layout="constrained")
ax = figure.add_subplot()
for pins in (("rocker_pin", "crank_pin"), ("rocker_pin",), ()):
    scene = cc.mechanisms.four_bar(clearance_at=pins)
    run = cc.simulate(scene, duration=scene.period, samples=3001, method="dop853", skip=scene.period)
    label = " and ".join(pins).replace("_", " ") or "no clearance"
    cc.plots.plot_trajectory(run, "rocker.angular_acceleration", ax=ax, label=label)
    print(
        f"{label}: {scene.check().degrees_of_freedom} degrees of freedom, {len(run.events)} contact changes"
    )
ax.legend(loc="best", fontsize="small")
figure.savefig(folder / "rocker.png")
