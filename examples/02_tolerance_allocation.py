"""Tolerance allocation: which tolerances of a slider-crank may open, which must close, for least cost?

Run it with ``python examples/02_tolerance_allocation.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

study = cc.Study(
    cc.mechanisms.slider_crank,
    {
        "crank_length": cc.normal(0.05, 2e-5),  # +-60 um are three standard deviations
        "rod_length": cc.normal(0.12, 2e-5),
        "clearance": cc.uniform(1.5e-5, 2.5e-5),
    },
    features={"stroke": cc.features.peak_to_peak("slider.x")},
    duration=0.03,
    samples=2,
    skip=0.03,
)
cost = {
    "crank_length": {"IT6": 9.0, "IT7": 6.0, "IT8": 4.0, "IT9": 3.0, "IT10": 2.5},
    "rod_length": {"IT6": 12.0, "IT7": 8.0, "IT8": 5.0, "IT9": 4.0, "IT10": 3.0},
    "clearance": {"2 um": 9.0, "5 um": 5.0, "10 um": 3.5},
}
found = cc.allocate(
    study, cost, {"stroke": cc.require("stroke", above="99.9 mm", below="100.1 mm")}, share=0.98, runs=400
)
print(found)

figure = Figure(figsize=(10, 3.5), layout="constrained")
left, right = figure.subplots(1, 2)
found.plot(ax=left)
cc.plots.plot_share(found.verified["stroke"], ax=right, unit="mm")
figure.savefig(folder / "tolerance_allocation.png")
