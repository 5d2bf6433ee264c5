"""A model of your own as a black box: a car over a bump, integrated by SciPy, with four uncertain parameters.

Run it with ``python examples/06_black_box.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")


def car(mass, stiffness, damping, bump):
    """A quarter of a car: mass [kg], spring [N/m], damper [N s/m] and the height of a bump [m]."""

    def slope(t, state):
        # A bump of half a sine, 0.1 s long.
        inside = t < 0.1
        road = bump * np.sin(np.pi * t / 0.1) if inside else 0.0
        rate = bump * np.pi / 0.1 * np.cos(np.pi * t / 0.1) if inside else 0.0
        force = stiffness * (road - state[0]) + damping * (rate - state[1])
        return [state[1], force / mass]

    t = np.linspace(0.0, 1.5, 301)
    found = solve_ivp(slope, (0.0, 1.5), [0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.02)
    return {"t": t, "body.x": found.y[0], "body.vx": found.y[1], "largest_rise": found.y[0].max()}


units = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m", "bump": "m"}
study = cc.Study(
    car,
    {
        "mass": cc.Interval.around(300.0, rel=0.2),
        "stiffness": cc.Interval.around(20e3, rel=0.1),
        "damping": cc.Interval.around(1500.0, rel=0.3),
        "bump": cc.Interval.around(0.05, rel=0.05),
    },
    # Any names will do. Units are those that are given here; nothing is guessed.
    units=units | {"body.x": "m", "body.vx": "m/s", "largest_rise": "m"},
)
result, scan = study.band(60), study.scan(3)
print(result["body.x"].verdict, result.features["largest_rise"])
print(result.ranking("largest_rise"))

figure = Figure(figsize=(10, 7), layout="constrained")
axes = figure.subplots(2, 2)
result["body.x"].plot(ax=axes[0, 0], unit="mm", runs=20, scan=scan["body.x"])
cc.plots.plot_prediction(result["body.x"], scan["body.x"], ax=axes[0, 1], unit="mm")
cc.plots.plot_tornado(result.features["largest_rise"], ax=axes[1, 0])
for name in study.intervals:
    cc.plots.plot_sensitivity(result["body.x"], name, ax=axes[1, 1], normalized=True)
figure.savefig(folder / "black_box.png")
