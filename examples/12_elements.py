"""A press of all elements: a motor with a flywheel drives a slider-crank against a spring and a load.

Run it with ``python examples/12_elements.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")


def press(flywheel):
    """The crank is not driven but turned by a torque; its flywheel [kg m²] evens the speed."""
    law = {"contact": cc.laws.Flores(1e10, 0.8), "friction": cc.laws.SmoothedCoulomb(0.05, 0.01)}
    return cc.Scene(
        bodies=[
            cc.Body("crank", 1.0, 1e-3 + flywheel, points={"A": (0.0, 0.0), "B": (0.05, 0.0)}, angle=0.5),
            cc.Body("rod", 0.8, 2e-3, (0.06, 0.0), points={"B": (0.0, 0.0), "C": (0.16, 0.0)}, angle=-0.15),
            cc.Body("ram", 2.0, 1e-3, points={"C": (0.0, 0.0), "tool": (0.03, 0.0)}),
        ],
        joints=[
            cc.Revolute("bearing", "ground.A", "crank.A"),
            cc.Revolute("pin", "crank.B", "rod.B"),
            cc.ClearanceRevolute("wrist", "rod.C", "ram.C", journal_radius=0.01, clearance=5e-5, **law),
            cc.Prismatic("guide", "ground.A", "ram.C", axis=(1.0, 0.0)),
        ],
        forces=[
            cc.Spring("spring", "ground.wall", "ram.tool", stiffness=2000.0, length=0.12, damping=5.0),
            cc.Torque("motor", "crank", torque=8.0),
            cc.TorsionDamper("oil", "ground", "crank", damping=0.2),
            cc.Force("load", "ram.tool", x=cc.motions.Harmonic(40.0, 60.0), y=0.0),
        ],
        ground={"A": (0.0, 0.0), "wall": (0.36, 0.0)},
        start=[cc.JointStart("bearing", velocity=40.0)],
    )


print(press(0.02).describe())
figure = Figure(figsize=(8, 8), layout="constrained")
above, below = figure.subplots(2, 1)
cc.plots.plot_scene(press(0.02), ax=above, exaggerate=40.0)
columns = ["crank.angular_velocity", "spring.force", "wrist.wear", "energy.*"]
for flywheel in (0.005, 0.02, 0.08):
    run = cc.simulate(
        press(flywheel), duration=0.5, samples=2001, rtol=1e-7, method="dop853", outputs=columns
    )
    label = f"flywheel {flywheel:g} kg m²"
    cc.plots.plot_trajectory(run, "crank.angular_velocity", ax=below, label=label)
figure.savefig(folder / "elements.png")

# Where the energy went, and the error of its balance; then half a second more from the last state.
for name in ("input", "damping_loss", "impact_loss", "friction_loss", "total", "balance"):
    print(f"energy.{name:14s}{run[f'energy.{name}'][-1]:12.4g} J")
more = cc.simulate(press(0.08), duration=0.5, samples=501, rtol=1e-7, method="dop853", start=run.end)
print(f"after {more.end_time:g} s the crank turns at {more['crank.angular_velocity'][-1]:.2f} rad/s")
