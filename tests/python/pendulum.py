"""An ideal pendulum, and where it is when it passes its lowest position: known in closed form."""

import math

import chebclear as cc

GRAVITY, LENGTH = 9.81, 0.3  # [m/s^2], [m]
MASS, INERTIA = 0.5, 2e-3  # [kg], [kg m^2]


def pendulum():
    """An ideal pendulum that starts at rest at 90 degrees from its lowest position."""
    return cc.Scene(
        [cc.Body("bob", MASS, INERTIA, center_of_mass=(LENGTH, 0.0))],
        [cc.Revolute("pivot", "ground", "bob")],
        [cc.Gravity((0.0, -GRAVITY))],
    )


def quarter_period():
    """Time from rest at 90 degrees to the lowest position [s]: Gauss's arithmetic-geometric mean."""
    a, b = 1.0, math.cos(0.25 * math.pi)
    for _ in range(6):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    reduced_length = (INERTIA + MASS * LENGTH**2) / (MASS * LENGTH)
    return 0.5 * math.pi * math.sqrt(reduced_length / GRAVITY) / a


LOWEST_ANGLE = -0.5 * math.pi
LOWEST_SPEED = -math.sqrt(2.0 * MASS * GRAVITY * LENGTH / (INERTIA + MASS * LENGTH**2))
OUTPUTS = ("bob.angle", "bob.angular_velocity")
