"""A press whose ram has play in its guide: tilt, corner impacts, and whether a longer guide is better.

Run it with ``python examples/14_loose_guide.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
CONTACT = cc.laws.ExactRestitution(stiffness=2e9, restitution=0.6)
FRICTION = cc.laws.SmoothedCoulomb(0.05, velocity=0.01)


def press(clearance: float = 5e-5, length: float = 0.06) -> cc.Scene:
    """A crank, a rod, and a ram in a guide of this play and length."""
    crank = cc.Body("crank", 0.3, 2e-4, (0.02, 0.0), points={"A": (0.0, 0.0), "B": (0.04, 0.0)})
    rod = cc.Body("rod", 0.2, 5e-4, (0.08, 0.0), points={"B": (0.0, 0.0), "C": (0.16, 0.0)})
    ram = cc.Body("ram", 0.4, 2e-4, points={"C": (-0.04, 0.0), "tip": (0.03, 0.01)})
    joints = [
        cc.Revolute("axle", "ground", "crank.A"),
        cc.Revolute("pin", "crank.B", "rod.B"),
        cc.Revolute("wrist", "rod.C", "ram.C"),
        cc.ClearancePrismatic(
            "guide", "ground", "ram", (1.0, 0.0), length, 0.03, clearance, CONTACT, FRICTION
        ),
    ]
    motor = cc.motions.Speed("motor", "axle", cc.rpm(600))
    return cc.Scene([crank, rod, ram], joints, [cc.Gravity((0.0, -9.81))], drives=[motor])


turn = press().period
run = cc.simulate(press(), duration=turn, samples=1001, skip=turn)
print(f"tilt from {run.lowest('guide.tilt').value:.3g} to {run.peak('guide.tilt').value:.3g} rad")
print(f"corner impacts: {len(run.contacts)}, largest force {run.contacts.peak_force.max():.3g} N")
cc.plots.plot_scene(run, turn, exaggerate=40).figure.savefig(folder / "loose_guide.png", dpi=150)
run.plot("guide.tilt").figure.savefig(folder / "loose_guide_tilt.png", dpi=150)

# The same presses, with the play that comes out of the shop, in both designs.
short, long = (
    cc.Study(
        press,
        {"clearance": cc.uniform(2e-5, 8e-5)},
        features={"tilt": cc.features.peak_to_peak("guide.tilt")},
        fixed={"length": length},
        skip=turn,
        duration=turn,
        samples=101,
    )
    for length in (0.06, 0.12)
)
found = cc.contrast(short, long, runs=60)
print(found)
found["tilt"].plot().figure.savefig(folder / "longer_guide.png", dpi=150)
