"""A shear whose motor slows down while it cuts: loads of the motion, shares in specification, lost motion.

Run it with ``python examples/13_shear.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# The torque of the motor and the force of the sheet are formulas in the file.
template = cc.load(Path(__file__).parent / "shear.toml")
run = template.simulate()
print(f"slowest: {run.lowest('crank.angular_velocity').value:.4g} rad/s")
print(f"largest force in the crank pin: {run.peak('pin.normal_force').value:.4g} N")
print(f"error of the energy balance: {np.max(np.abs(run['energy.balance'])):.1e} J")

figure = Figure(figsize=(7, 7), layout="constrained")
for ax, name in zip(figure.subplots(3, 1), run.columns, strict=False):
    run.plot(name, ax=ax)
figure.savefig(folder / "shear_run.png", dpi=150)

# How many shears keep to the requirements of the file.
found = template.conformance(100)
print(found)
found["speed"].plot().figure.savefig(folder / "shear_speed.png", dpi=150)

# How far the blade gives when it breaks through, while the crank stands.
scene = template()
turning = cc.Scene(scene.bodies, scene.joints, drives=[cc.motions.Speed("hand", "main", 1.0)])
motion = cc.lost_motion(turning, "blade", direction=(0.0, 1.0))
print(f"play at the blade: {motion}")
motion.plot(unit="µm").figure.savefig(folder / "shear_play.png", dpi=150)
