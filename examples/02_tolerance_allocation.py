"""Tolerance allocation: which tolerance of a slider-crank is worth its money, and which may be wider?

Run it with ``python examples/02_tolerance_allocation.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# Turned pins are cheap at +-50 um in length and +-5 um in clearance. The stroke decides whether parts fit.
tolerances = {
    "crank_length": cc.interval(0.050, half_width=5e-5),
    "rod_length": cc.interval(0.120, half_width=5e-5),
    "clearance": cc.interval(20e-6, half_width=5e-6),
    "journal_radius": cc.interval(9.8e-3, half_width=2e-5),
}


def stroke_over(tolerances):
    """The stroke, and the force in the wrist, over the tolerances."""
    study = cc.Study(
        cc.mechanisms.slider_crank,
        tolerances,
        duration=0.03,
        samples=2,
        skip=0.03,
        outputs=[],
        features={"stroke": cc.peak_to_peak("slider.x"), "mean_force": cc.mean("wrist.normal_force")},
    )
    return study.sample(40)


before = stroke_over(tolerances)
ranking = before.ranking("stroke")
print(ranking)

# The money goes where it helps most: the best one is halved, the last one doubled.
best, last = ranking.rows[0].parameter, ranking.rows[-1].parameter
changed = dict(tolerances)
for name, factor in ((best, 0.5), (last, 2.0)):
    changed[name] = cc.interval(tolerances[name].midpoint, half_width=factor * tolerances[name].half_width)
after = stroke_over(changed)
for words, result in (("before", before), (f"{best} halved, {last} doubled", after)):
    reach = result.feature("stroke").interval
    print(f"{words}: stroke {1e3 * reach.lower:.4f} to {1e3 * reach.upper:.4f} mm ({reach.verdict})")

figure = Figure(figsize=(10, 7), layout="constrained")
axes = figure.subplots(2, 2)
cc.plot_tornado(before.feature("stroke"), ax=axes[0, 0], unit="mm")
cc.plot_ranking(ranking, ax=axes[0, 1])
cc.plot_shares(before.feature("mean_force"), ax=axes[1, 0])
cc.plot_tornado(after.feature("stroke"), ax=axes[1, 1], unit="mm")
axes[1, 1].set_title(f"{best} halved, {last} doubled".replace("_", " "), fontsize="medium")
figure.savefig(folder / "tolerance_allocation.png")
