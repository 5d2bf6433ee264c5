"""A toggle press: a motor with a flywheel straightens a knee, whose end presses a ram onto a die spring.

Two pins have clearance and five lengths have tolerances: what must the knee carry, and which length is worth
tightening? Run it with ``python examples/toggle_press.py [DIRECTORY]``; the picture goes there (default:
here). Other scripts may import `toggle_press` and `TOLERANCES`.
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure


def toggle_press(
    *,
    crank_length=0.020,
    coupler_length=0.180,
    upper_length=0.150,
    lower_length=0.150,
    bearing_distance=0.205,
    knee_clearance=50e-6,
    ram_clearance=30e-6,
    flywheel=0.5,
    stall_torque=60.0,
    motor_damping=1.5,
    die_stiffness=2e5,
    speed=30.0,
):
    """The scene of a toggle press.

    ::

            o head                                y
             \\ upper                              |__ x
              \\          coupler     crank
          knee o----------------------o--o bearing
              /
             / lower
            o wrist
          [ram]
            z die
        ==========

    Parameters
    ----------
    crank_length, coupler_length, upper_length, lower_length : float
        Distances between the pins of the bodies [m].
    bearing_distance : float
        Horizontal distance of the crank's bearing from the line of the ram [m].
    knee_clearance, ram_clearance : float
        Radial clearances of the pins ``knee`` (upper and lower link) and ``wrist`` (lower link and ram) [m].
    flywheel : float
        Moment of inertia that the flywheel adds to the crank [kg m²].
    stall_torque, motor_damping : float
        Torque of the motor at rest [N m], and how much it falls with its speed [N m s/rad].
    die_stiffness : float
        Stiffness of the die spring [N/m], without force when the ram is 15 mm above its lowest position.
    speed : float
        Angular velocity of the crank at time zero [rad/s].

    Returns
    -------
    Scene
    """

    def bar(name, ends, length, mass, angle):
        points = {ends[0]: (0.0, 0.0), ends[1]: (length, 0.0)}
        return cc.Body(name, mass, mass * length**2 / 12.0, (length / 2.0, 0.0), points=points, angle=angle)

    def pin(name, bearing, journal, clearance):
        stiffness = cc.hertz_stiffness(0.0125, clearance, 207e9, 0.3)
        return cc.ClearanceRevolute(
            name,
            bearing=bearing,
            journal=journal,
            journal_radius=0.0125,
            clearance=clearance,
            contact=cc.Flores(stiffness, restitution=0.8),
            friction=cc.SmoothedCoulomb(0.05, 0.005),
        )

    crank_points = {"bearing": (0.0, 0.0), "pin": (crank_length, 0.0)}
    return cc.Scene(
        ground={"head": (0.0, 0.30), "bearing": (bearing_distance, 0.15), "die": (0.0, -0.10)},
        bodies=[
            cc.Body("crank", 2.0, 1e-3 + flywheel, points=crank_points, angle=0.0),
            bar("coupler", ("knee", "pin"), coupler_length, 1.5, 0.0),
            bar("upper", ("head", "knee"), upper_length, 2.0, -1.27),
            bar("lower", ("knee", "ram"), lower_length, 2.0, -1.87),
            cc.Body("ram", 8.0, 0.02, points={"pin": (0.0, 0.0)}),
        ],
        joints=[
            cc.Revolute("bearing", "ground.bearing", "crank.bearing"),
            cc.Revolute("crank_pin", "crank.pin", "coupler.pin"),
            cc.Revolute("coupler_pin", "coupler.knee", "upper.knee"),
            cc.Revolute("head", "ground.head", "upper.head"),
            pin("knee", "upper.knee", "lower.knee", knee_clearance),
            pin("wrist", "ram.pin", "lower.ram", ram_clearance),
            cc.Prismatic("guide", "ground.die", "ram.pin", axis=(0.0, 1.0)),
        ],
        forces=[
            cc.Gravity((0.0, -9.81)),
            cc.Torque("motor", "crank", torque=stall_torque),
            cc.TorsionDamper("motor_slope", "ground", "crank", damping=motor_damping),
            cc.Spring("die", "ground.die", "ram.pin", die_stiffness, length=0.115, damping=200.0),
        ],
        start=[cc.JointStart("bearing", velocity=speed)],
    )


TOLERANCES = {
    name: cc.interval(nominal, half_width=2e-4)
    for name, nominal in {
        "crank_length": 0.020,
        "coupler_length": 0.180,
        "upper_length": 0.150,
        "lower_length": 0.150,
        "bearing_distance": 0.205,
    }.items()
}
"""The five lengths, ±0.2 mm [m]."""


def main():
    """What the knee has to carry whatever the five lengths are, and which tolerance to tighten."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    study = cc.Study(
        toggle_press,
        TOLERANCES,
        outputs=["knee.normal_force"],
        features={"peak force": cc.peak("knee.normal_force")},
        skip=0.02,  # the journals start in the middle of their bearings and settle
        duration=0.2,  # one revolution
        samples=2001,
    )
    result = study.band(runs=81)
    band, ranking = result["knee.normal_force"], result.ranking("peak force")
    print(result)  # the peak is that of the continuous motion, which samples miss
    print(ranking)

    figure = Figure(figsize=(11, 4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    band.plot(ax=left)
    rows = ranking.rows[::-1]
    effects = 100.0 * np.array([row.narrowing for row in rows])
    right.barh([row.parameter for row in rows], effects[:, 0], color="tab:blue")
    spans = (effects[:, 0] - effects[:, 1], effects[:, 2] - effects[:, 0])
    right.errorbar(effects[:, 0], range(len(rows)), xerr=spans, fmt="none", ecolor="black", capsize=3)
    right.set_xlabel("half the tolerance narrows the peak force by [%]")
    figure.savefig(folder / "toggle_press.png")


if __name__ == "__main__":
    main()
