"""Driver torque and bearing loads by crank angle: what to buy when lengths, masses and play are uncertain.

Run it with ``python examples/08_torque_and_loads.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

study = cc.Study(
    cc.mechanisms.slider_crank,
    {
        "crank_length": cc.Interval.around(0.05, rel=0.01),
        "slider_mass": cc.Interval.around(0.14, rel=0.1),
        "clearance": cc.Interval.around(2e-5, rel=0.5),
    },
    outputs=["drive.torque", "wrist.normal_force", "crank_bearing.reaction_x", "crank_bearing.reaction_y"],
    duration=0.03,
    samples=361,
)
# All revolutions of all runs are pooled: bands over the crank angle.
result = study.band(24, revolutions=4)
print(result)
for name in result:
    band = result[name]
    worst = max(abs(band.lower.min()), abs(band.upper.max()))
    where = np.degrees(band.angle[np.maximum(-band.lower, band.upper).argmax()])
    print(f"{name}: at most {worst:.4g} at {where:.0f} deg of crank angle, {band.verdict}")

figure = Figure(figsize=(11, 8), layout="constrained")
for ax, name in zip(figure.subplots(2, 2).flat, result, strict=True):
    result[name].plot(ax=ax, runs=12)
figure.savefig(folder / "torque_and_loads.png")

# For the catalog of a bearing maker, in print.
with cc.plots.print_style(columns=1, format="pdf"):
    result["wrist.normal_force"].plot().figure.savefig(folder / "wrist_load")
