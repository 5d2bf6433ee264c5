"""Linear and angular momentum of all bodies, which nothing inside of a mechanism changes."""

import numpy as np


def momenta(run):
    """Along x and y, and about the origin, shape (3, samples), of a run with the motion of its bodies."""
    total = np.zeros((3, len(run.t)))
    for body in run.scene.bodies:
        x, y, vx, vy, rate = (
            run[f"{body.name}.{what}"] for what in ("x", "y", "vx", "vy", "angular_velocity")
        )
        total += body.mass * np.array([vx, vy, x * vy - y * vx])
        total[2] += body.inertia * rate
    return total
