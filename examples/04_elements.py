"""A press: a motor with a flywheel drives a slider-crank against a return spring and a load.

Run it with ``python examples/04_elements.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")


def press(flywheel, clearance=5e-5):
    """The crank is not driven but turned by a torque; its flywheel evens the speed.

    Parameters
    ----------
    flywheel : float
        Moment of inertia that the flywheel adds to the crank [kg m²].
    clearance : float
        Radial clearance of the wrist pin [m].
    """
    crank, rod = 0.05, 0.16
    return cc.Scene(
        bodies=[
            cc.Body("crank", 1.0, 1e-3 + flywheel, points={"A": (0.0, 0.0), "B": (crank, 0.0)}, angle=0.5),
            cc.Body("rod", 0.8, 2e-3, (0.06, 0.0), points={"B": (0.0, 0.0), "C": (rod, 0.0)}, angle=-0.15),
            cc.Body("ram", 2.0, 1e-3, points={"C": (0.0, 0.0), "tool": (0.03, 0.0)}),
        ],
        joints=[
            cc.Revolute("bearing", "ground.A", "crank.A"),
            cc.Revolute("pin", "crank.B", "rod.B"),
            cc.ClearanceRevolute(
                "wrist",
                bearing="rod.C",
                journal="ram.C",
                journal_radius=0.01,
                clearance=clearance,
                contact=cc.Flores(1e10, 0.8),
                friction=cc.SmoothedCoulomb(0.05, 0.01),
            ),
            cc.Prismatic("guide", "ground.A", "ram.C", axis=(1.0, 0.0)),
        ],
        forces=[
            cc.Spring("spring", "ground.wall", "ram.tool", stiffness=2000.0, length=0.12, damping=5.0),
            cc.Torque("motor", "crank", torque=8.0),
            cc.TorsionDamper("oil", "ground", "crank", damping=0.2),
            cc.Force("load", "ram.tool", x=cc.Harmonic(amplitude=40.0, angular_frequency=60.0), y=0.0),
        ],
        ground={"A": (0.0, 0.0), "wall": (0.36, 0.0)},
        start=[cc.JointStart("bearing", velocity=40.0)],
    )


scene = press(flywheel=0.02)
print(scene.describe())
figure = Figure(figsize=(8, 4), layout="constrained")
cc.plot_scene(scene, ax=figure.add_subplot(), exaggerate=40.0)
figure.savefig(folder / "press.png")

figure = Figure(figsize=(8, 4), layout="constrained")
ax = figure.add_subplot()
for flywheel in (0.005, 0.02, 0.08):
    run = cc.simulate(
        press(flywheel),
        duration=0.5,
        samples=2001,
        rtol=1e-7,
        method="dop853",
        outputs=["crank.angular_velocity", "spring.force", "wrist.wear", "energy.*"],
    )
    speed = run["crank.angular_velocity"]
    cc.plot_trajectory(run, "crank.angular_velocity", ax=ax, label=f"flywheel {flywheel:g} kg m²")
    uneven = np.ptp(speed[1000:]) / speed[1000:].mean()
    print(f"flywheel {flywheel:g} kg m²: speed uneven by {100.0 * uneven:.1f} % in the second half")
ax.legend(loc="best", fontsize="small")
figure.savefig(folder / "speed.png")

# Where the energy went, and how well the books balance.
for name in ("input", "damping_loss", "impact_loss", "friction_loss", "total", "balance"):
    print(f"energy.{name:14s}{run[f'energy.{name}'][-1]:12.4g} J")
hardest = run.contacts.peak_force.argmax()
print(
    f"{len(run.contacts)} contacts; the hardest, at {run.contacts.onset[hardest]:.4f} s, "
    f"reached {run.contacts.peak_force[hardest]:.0f} N"
)

# The last state is a start: half a second more, as if there had been no break.
more = cc.simulate(press(0.08), duration=0.5, samples=501, rtol=1e-7, method="dop853", start=run.end)
print(f"after {more.end_time:g} s the crank turns at {more['crank.angular_velocity'][-1]:.2f} rad/s")
