"""A shear with loose pins, whose motor slows down while it cuts: how slow, how surely, and how much play?

Run it with ``python examples/13_shear.py [DIRECTORY]``; pictures go there (default: here).
"""

import math
import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
RADIUS, LENGTH = 0.03, 0.2


def shear(cut=1500.0, flywheel=0.4, pull_out=80.0, play=5e-5):
    """The shear: force of the cut [N], flywheel [kg m²], pull-out torque of the motor [N m], play [m]."""
    crank = cc.Body("crank", 20.0, flywheel, points={"A": (RADIUS, 0.0)})
    rod = cc.Body(
        "rod", 3.0, 0.01, (0.1, 0.0), points={"A": (0.0, 0.0), "B": (LENGTH, 0.0)}, angle=-math.pi / 2
    )
    ram = cc.Body("ram", 8.0, 0.1)
    # Kloss: T = 2 T_k / (s / s_k + s_k / s) with the slip s behind the synchronous speed of 31.4 rad/s.
    motor = cc.motions.Expression(
        "2*T*s_k*(1 - crank.angular_velocity/w)/((1 - crank.angular_velocity/w)**2 + s_k**2)",
        {"T": pull_out, "s_k": 0.2, "w": 31.4},
    )
    law = cc.laws.ExactRestitution(1e10, 0.7)
    pin = {"journal_radius": 0.015, "clearance": play, "contact": law}
    return cc.Scene(
        [crank, rod, ram],
        [
            cc.Revolute("main", "ground", "crank"),
            cc.ClearanceRevolute("pin", "crank.A", "rod.A", **pin),
            cc.ClearanceRevolute("wrist", "rod.B", "ram", **pin),
            cc.Prismatic("guide", "ground", "ram", axis=(0.0, -1.0)),
        ],
        [
            cc.Gravity((0.0, -9.81)),
            cc.Torque("motor", "crank", motor),
            # A sheet of 15 mm lies at -0.2 m; the blade cuts on its way down.
            cc.Force(
                "cut",
                "ram",
                0.0,
                cc.motions.Expression(
                    "if(ram.vy < 0, if(ram.y < -0.2, if(ram.y > -0.215, F, 0), 0), 0)", {"F": cut}
                ),
            ),
        ],
        start=[cc.JointStart("main", position=-0.5, velocity=29.0)],
    )


run = cc.simulate(
    shear(),
    skip=0.5,
    duration=0.5,
    samples=5001,
    outputs=["crank.angular_velocity", "ram.y", "pin.normal_force", "energy.balance"],
)
slowest = run.lowest("crank.angular_velocity")
print(f"slowest: {slowest.value:.4g} rad/s, after {slowest.time:.4g} s")
print(f"largest force in the crank pin: {run.peak('pin.normal_force').value:.4g} N")
print(f"error of the energy balance: {np.max(np.abs(run['energy.balance'])):.1e} J")

figure = Figure(figsize=(7, 7), layout="constrained")
for ax, name in zip(
    figure.subplots(3, 1), ["ram.y", "crank.angular_velocity", "pin.normal_force"], strict=True
):
    run.plot(name, ax=ax)
figure.savefig(folder / "shear_run.png", dpi=150)

# The material is 10 % stronger or weaker, the motor and the flywheel have tolerances, the pins wear.
study = cc.Study(
    shear,
    {
        "cut": cc.normal(1500.0, 75.0),
        "flywheel": cc.normal(0.4, 0.01),
        "pull_out": cc.normal(80.0, 2.0),
        "play": cc.uniform(2e-5, 1e-4),
    },
    features={"pin load": cc.features.peak("pin.normal_force")},
    skip=0.5,
    duration=0.3,
    samples=2,
    rtol=1e-5,
)
limits = {
    "speed": cc.require("crank.angular_velocity", above=30.3),
    "load": cc.require("pin load", below="12 kN"),
}
found = cc.conformance(study, limits, 200)
print(found)
found["speed"].plot().figure.savefig(folder / "shear_speed.png", dpi=150)

# How far the ram gives when the cut breaks through, while the crank stands.
ideal = shear()
turning = cc.Scene(ideal.bodies, ideal.joints, drives=[cc.motions.Speed("hand", "main", 1.0)], start=[])
motion = cc.lost_motion(turning, "ram", direction=(0.0, 1.0))
print(f"play at the ram: {motion}")
motion.plot(unit="µm").figure.savefig(folder / "shear_play.png", dpi=150)
