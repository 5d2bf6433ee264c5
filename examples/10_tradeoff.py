"""Accuracy against cost: which method and tolerance for this scene, and until when can a run be trusted?

Run it with ``python examples/10_tradeoff.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# Every method at some tolerances against two tight runs. Velocities are easy, contact forces are not.
scene = cc.mechanisms.slider_crank(convention="corrected")
result = cc.tradeoff(
    scene,
    duration=0.03,
    samples=721,
    outputs=["slider.vx", "wrist.normal_force"],
    rtols=[1e-3, 1e-4, 1e-5, 1e-6, 1e-7],
    repeats=1,
)
print(result)
print(result.recommendation({"slider.vx": 3e-3}))
print(result.recommendation(0.001, cost="stages"))
figure = Figure(figsize=(10, 5), layout="constrained")
for place, output in enumerate(result.outputs, start=1):
    result.plot(output, ax=figure.add_subplot(1, 2, place))
figure.savefig(folder / "tradeoff.png")

# A single run can say by itself how far it is off, for about 2.6 times its cost.
run = cc.simulate(scene, duration=0.03, samples=721, rtol=1e-4, error="estimate")
for name in result.outputs:
    estimate = run.error[name]
    print(f"{name}: off by {100.0 * estimate.relative:.2g} % of its range; {estimate.in_words()}")

# The bounds of a study have a price as well: degrees, scan points, and how the polynomial is bounded.
study = cc.Study(
    cc.mechanisms.slider_crank,
    {"crank_length": cc.Interval.around(0.05, rel=0.10), "rod_length": cc.Interval.around(0.12, rel=0.10)},
    outputs=["slider.vx"],
    duration=scene.period,
    samples=361,
    skip=scene.period,
    method="dop853",
)
bounds = cc.study_tradeoff(study, degrees=[1, 2, 3], points=[5], runs=[9, 41], holdout=40)
print(bounds)
print(bounds.recommendation(width_error=0.1))
figure = Figure(figsize=(5, 4), layout="constrained")
bounds.plot("slider.vx", ax=figure.add_subplot())
figure.savefig(folder / "bounds_tradeoff.png")
