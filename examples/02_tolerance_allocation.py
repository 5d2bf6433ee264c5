"""Tolerance allocation: which tolerance of a slider-crank is worth its money, and which may be wider?

Run it with ``python examples/02_tolerance_allocation.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from chebclear.features import mean, peak_to_peak
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# Turned pins are cheap at +-50 um in length and +-5 um in clearance. The stroke decides whether parts fit.
tolerances = {
    "crank_length": cc.Interval("49.95 mm", "50.05 mm"),
    "rod_length": cc.Interval("119.95 mm", "120.05 mm"),
    "clearance": cc.Interval("15 um", "25 um"),
    "journal_radius": cc.Interval("9.78 mm", "9.82 mm"),
}


def stroke_over(tolerances):
    """The stroke, and the force in the wrist, over the tolerances."""
    study = cc.Study(
        cc.mechanisms.slider_crank,
        tolerances,
        outputs=[],
        duration=0.03,
        samples=2,
        skip=0.03,
        features={"stroke": peak_to_peak("slider.x"), "mean_force": mean("wrist.normal_force")},
    )
    return study.sample(40)


before = stroke_over(tolerances)
ranking = before.ranking("stroke")
print(ranking)

# The best tolerance is halved, the last one doubled.
best, last, changed = ranking.rows[0].parameter, ranking.rows[-1].parameter, dict(tolerances)
for name, factor in ((best, 0.5), (last, 2.0)):
    half = factor * tolerances[name].half_width
    changed[name] = cc.Interval.around(tolerances[name].midpoint, plus=half, minus=half)
after = stroke_over(changed)
for words, result in (("before", before), (f"{best} halved, {last} doubled", after)):
    reach = result.features["stroke"].interval
    print(f"{words}: stroke {1e3 * reach.lower:.4f} to {1e3 * reach.upper:.4f} mm ({reach.verdict})")

figure = Figure(figsize=(10, 7), layout="constrained")
axes = figure.subplots(2, 2)
cc.plots.plot_tornado(before.features["stroke"], ax=axes[0, 0], unit="mm")
cc.plots.plot_ranking(ranking, ax=axes[0, 1])
cc.plots.plot_shares(before.features["mean_force"], ax=axes[1, 0])
cc.plots.plot_tornado(after.features["stroke"], ax=axes[1, 1], unit="mm")
axes[1, 1].set_title(f"{best} halved, {last} doubled".replace("_", " "), fontsize="medium")
figure.savefig(folder / "tolerance_allocation.png")
