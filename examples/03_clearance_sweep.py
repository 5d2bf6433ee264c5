"""Clearance sweep: how large may the play be until the motion no longer repeats itself every revolution?

Run it with ``python examples/03_clearance_sweep.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# A sample a revolution of the settled motion, for clearances from a new pin to a worn one.
clearances = np.linspace(5e-6, 1.5e-4, 30)
diagram = cc.bifurcation(
    cc.mechanisms.slider_crank, "clearance", clearances, "slider.ax", periods=15, discard=15, rtol=1e-5
)
points = diagram.points(tolerance=10.0)
repeating = clearances[points == 1]
print(f"one point, within 10 m/s², at {len(repeating)} of {len(clearances)} clearances")

figure = Figure(figsize=(10, 8), layout="constrained")
axes = figure.subplots(2, 2)
diagram.plot(ax=axes[0, 0], unit="km/s²", parameter_unit="µm", parameter_scale=1e6)
axes[0, 0].set_title("30 clearances, 16 revolutions each", fontsize="medium")

# The first and the last of them more closely: the journal's path, and a section of what it does.
for ax, clearance in ((axes[0, 1], clearances[0]), (axes[1, 0], clearances[-1])):
    scene = cc.mechanisms.slider_crank(clearance=clearance)
    turn = scene.period
    run = cc.simulate(scene, duration=turn, samples=3601, skip=2.0 * turn)
    cc.plots.plot_orbit(run, "wrist", ax=ax)
    share = run.feature(cc.features.contact_share("wrist"))
    print(f"c = {1e6 * clearance:.0f} um: {len(run.events)} contact changes, in contact {100 * share:.0f} %")

run = cc.simulate(scene, duration=60.0 * turn, samples=60 * 36 + 1, skip=5.0 * turn, rtol=1e-5)
cc.plots.plot_poincare(
    run, "wrist.eccentricity_x", "wrist.eccentricity_y", x_unit="µm", y_unit="µm", ax=axes[1, 1]
)
axes[1, 1].set_title("60 revolutions, a point each", fontsize="medium")
figure.savefig(folder / "clearance_sweep.png")
