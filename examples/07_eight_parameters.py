"""Eight uncertain parameters: 81 runs bound the loads of a slider-crank and tell what they hang on.

A grid of four points each would take 65 536 runs. Run it with ``python examples/07_eight_parameters.py
[DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

turn = cc.mechanisms.slider_crank().period
study = cc.Study(
    cc.mechanisms.slider_crank,
    {
        "crank_length": cc.Interval.around(0.05, rel=0.02),
        "rod_length": cc.Interval.around(0.12, rel=0.02),
        "clearance": cc.Interval.around(2e-5, rel=0.5),
        "journal_radius": cc.Interval.around(0.0098, rel=0.02),
        "slider_mass": cc.Interval.around(0.14, rel=0.1),
        "rod_mass": cc.Interval.around(0.21, rel=0.1),
        "restitution": cc.Interval.around(0.8, plus=0.1, minus=0.1),
        "crank_speed": cc.Interval.around(cc.rpm(2000), rel=0.02),
    },
    outputs=["slider.vx", "wrist.normal_force"],
    duration=turn,
    samples=721,
    skip=turn,
    features={
        "mean_force": cc.features.mean("wrist.normal_force"),
        "peak_force": cc.features.peak("wrist.normal_force"),
    },
)
result = study.band(81)
print(result)
for name in study.features:
    print(result.features[name])
    print(result.ranking(name), "\n")

figure = Figure(figsize=(11, 8), layout="constrained")
axes = figure.subplots(2, 2)
result["wrist.normal_force"].plot(ax=axes[0, 0], runs=10)
result["slider.vx"].plot(ax=axes[0, 1], runs=10)
cc.plots.plot_tornado(result.features["mean_force"], ax=axes[1, 0])
cc.plots.plot_shares(result.features["peak_force"], ax=axes[1, 1])
figure.savefig(folder / "eight_parameters.png")
