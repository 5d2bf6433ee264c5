"""The paper's slider-crank: one run, a study of both lengths, and its bands against brute force.

Run it with ``python examples/01_case_study.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# One mechanism with every parameter known. The concentric start settles within the first revolution.
scene = cc.mechanisms.slider_crank(clearance=2e-5, crank_speed=cc.rpm(2000))
turn = scene.period
run = cc.simulate(scene, duration=turn, samples=7201, skip=turn)
print(f"{run.message}: {run.stats.steps} steps, {len(run.skipped_events)} contact changes, all in the start")
peak = run.peak("wrist.normal_force")
print(f"largest force in the wrist: {peak.value:.1f} N at t = {peak.time:.4f} s")

# The same with both lengths known to 10 % only: 16 runs for a polynomial, 100 for the brute force.
box = {"crank_length": cc.Interval.around(0.05, rel=0.10), "rod_length": cc.Interval.around(0.12, rel=0.10)}
settings = {"outputs": ["slider.x", "slider.vx"], "duration": turn, "samples": 721, "skip": turn}
study = cc.Study(cc.mechanisms.slider_crank, box, **settings)
result, scan = study.chebyshev(degree=3), study.scan(10)
print(cc.compare(result, scan))

# Without clearance: where the sensitivities are nearly the same, clearance hardly matters.
without = cc.Study(cc.mechanisms.slider_crank, box, fixed={"clearance_at": ()}, **settings)
ideal = without.chebyshev(degree=3)
velocity = result["slider.vx"]
zones = cc.restraint_zones(velocity, ideal["slider.vx"], "rod_length", window=turn / 36.0)
for name in result.parameter_names:
    slope = abs(velocity.sensitivity(name))
    print(f"{name}: at most {slope.max():.1f} m/s per m, at t = {run.t[slope.argmax() * 10]:.4f} s")

figure = Figure(figsize=(12, 11), layout="constrained")
axes = figure.subplots(3, 2)
cc.plots.plot_scene(run, run.t[1200], exaggerate=100.0, ax=axes[0, 0])
cc.plots.plot_orbit(run, "wrist", ax=axes[0, 1])
velocity.plot(ax=axes[1, 0], scan=scan["slider.vx"])
cc.plots.plot_prediction(velocity, scan["slider.vx"], ax=axes[1, 1])
cc.plots.plot_sensitivity(
    velocity, "rod_length", ideal=ideal["slider.vx"], zones=zones, parameter_unit="m", ax=axes[2, 0]
)
cc.plots.plot_spectrogram(run, "slider.ax", ax=axes[2, 1])
axes[2, 1].set_ylim(0.0, 15.0)
figure.savefig(folder / "case_study.png")
