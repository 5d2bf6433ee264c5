"""The toggle press of ``toggle_press.toml``: what must its knee carry, and which length should be tightened?

A motor with a flywheel, five bodies, two loose pins, a die spring, and five lengths of +-0.2 mm. Run it with
``python examples/09_toggle_press.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

press = cc.load(Path(__file__).parent / "toggle_press.toml")
study = press.study(
    outputs=["knee.normal_force"],
    features={"peak_force": cc.features.peak("knee.normal_force")},
)
result = study.band(runs=41)
print(result)  # the peak is that of the continuous motion, which samples miss
band, ranking = result["knee.normal_force"], result.ranking("peak_force")
print(ranking)

# The nominal press once more, with everything that moves.
run = cc.simulate(press.scene(), duration=0.2, samples=2001, skip=0.02)
print(f"stroke {1e3 * (run['ram.y'].max() - run['ram.y'].min()):.2f} mm, {len(run.contacts)} contacts")

figure = Figure(figsize=(11, 9), layout="constrained")
axes = figure.subplots(2, 2)
cc.plots.plot_scene(run, 0.1, ax=axes[0, 0], exaggerate=20.0)
band.plot(ax=axes[0, 1], unit="kN", runs=10)
cc.plots.plot_tornado(result.features["peak_force"], ax=axes[1, 0], unit="kN")
cc.plots.plot_ranking(ranking, ax=axes[1, 1])
figure.savefig(folder / "toggle_press.png")

animation = cc.animate(run, "knee.normal_force", joint="knee", frames=60)
animation.save(folder / "toggle_press.html")
