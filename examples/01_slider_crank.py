"""The paper's slider-crank: one run, a study of both lengths, and the bands against brute force.

Run it with ``python examples/01_slider_crank.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# One mechanism with every parameter known.
scene = cc.mechanisms.slider_crank(clearance=2e-5, crank_speed=cc.rpm(2000))
# The concentric start settles within the first revolution: look at the second one.
turn = scene.period
run = cc.simulate(scene, duration=turn, samples=7201, skip=turn)
print(f"{run.message}: {run.stats.steps} steps, {len(run.skipped_events)} contact changes, all in the start")
print(f"largest force in the wrist: {run.peak('wrist.normal_force')} N")
figure = Figure(figsize=(6, 6), layout="constrained")
cc.plot_orbit(run, "wrist", ax=figure.add_subplot())
figure.savefig(folder / "orbit.png")

# The same with both lengths known to 10 % only: 16 runs for a polynomial, 100 for the brute force.
study = cc.Study(
    cc.mechanisms.slider_crank,
    {"crank_length": cc.interval(0.05, rel=0.10), "rod_length": cc.interval(0.12, rel=0.10)},
    outputs=["slider.x", "slider.vx"],
    duration=turn,
    samples=721,
    skip=turn,
)
result, scan = study.chebyshev(degree=3), study.scan(10)
print(cc.compare(result, scan))
figure = Figure(figsize=(8, 4), layout="constrained")
result["slider.vx"].plot(ax=figure.add_subplot())
figure.savefig(folder / "velocity_band.png")

# Which length matters more, and where?
for name in result.parameter_names:
    per_metre = result["slider.vx"].sensitivity(name)
    print(
        f"{name}: at most {abs(per_metre).max():.1f} (m/s)/m, at t = {run.t[abs(per_metre).argmax()]:.4f} s"
    )
