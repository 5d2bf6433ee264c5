"""Laws of contact and friction, drives and forces for the Cartesian formulation, from their definitions.

Keyed by the names of the classes that a scene holds. A force puts its loads on a `Motion` (see
`cartesian_model.py`) at time t.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

# Hysteresis factor χ [s/m] of F = K δⁿ (1 + χ δ̇) from the law and the impact velocity [m/s].
HYSTERESIS = {
    "Hertz": lambda law, impact: 0.0,
    "HuntCrossley": lambda law, impact: law.hysteresis_factor,
    "LankaraniNikravesh": lambda law, impact: 3.0 * (1.0 - law.restitution**2) / (4.0 * impact),
    "Flores": lambda law, impact: 8.0 * (1.0 - law.restitution) / (5.0 * law.restitution * impact),
}
LATCHED = ("LankaraniNikravesh", "Flores")


def modified_coulomb(law, speed):
    """Eq. (11) of the paper: a quarter sine to V_s, half a cosine wave from V_s to V_d, then constant."""
    static, sliding = law.static_coefficient, law.sliding_coefficient
    first, second = law.stick_slip_velocity, law.static_sliding_velocity
    if speed < first:
        return static * math.sin(math.pi * speed / (2.0 * first))
    if speed > second:
        return sliding
    wave = math.cos(math.pi * (speed - first) / (second - first))
    return 0.5 * (static + sliding) + 0.5 * (static - sliding) * wave


# Coefficient of friction [-] from the law and the sliding speed [m/s] ≥ 0.
FRICTION = {
    "ModifiedCoulomb": modified_coulomb,
    "SmoothedCoulomb": lambda law, speed: law.coefficient * math.tanh(speed / law.velocity),
}

# --- functions of time: value, first and second derivative ------------------------------------------------


def polynomial(function, t):
    series = np.polynomial.Polynomial(function.coefficients)
    return series(t), series.deriv(1)(t), series.deriv(2)(t)


def harmonic(function, t):
    rate = function.angular_frequency
    sin, cos = math.sin(rate * t + function.phase), math.cos(rate * t + function.phase)
    amplitude = function.amplitude
    return function.mean + amplitude * sin, amplitude * rate * cos, -amplitude * rate * rate * sin


@lru_cache
def spline(times, values):
    return CubicSpline(times, values)


def table(function, t):
    curve = spline(tuple(function.points), tuple(function.values))
    return float(curve(t)), float(curve(t, 1)), float(curve(t, 2))


FUNCTIONS = {"Polynomial": polynomial, "Harmonic": harmonic, "Table": table}


def motion_of(value, t):
    """A number or a function of time with its derivatives."""
    if isinstance(value, float | int):
        return float(value), 0.0, 0.0
    return FUNCTIONS[type(value).__name__](value, t)


def at(value, t):
    return motion_of(value, t)[0]


# What a drive prescribes of its joint, with derivatives: angle [rad] or displacement [m] of b relative to a.
DRIVES = {
    "Speed": lambda drive, t: (drive.angle + drive.speed * t, drive.speed, 0.0),
    "Motion": lambda drive, t: motion_of(drive.motion, t),
}


# --- forces -----------------------------------------------------------------------------------------------


def gravity(element, motion, t):
    for body, mass in enumerate(motion.model.masses):
        motion.load[3 * body] += mass * element.acceleration[0]
        motion.load[3 * body + 1] += mass * element.acceleration[1]


def pull_together(motion, element, tension):
    """Pull the points a and b of an element together along the line between them."""
    a, b = motion.named(element.a), motion.named(element.b)
    dx, dy = b.x - a.x, b.y - a.y
    length = math.hypot(dx, dy)
    rate = (dx * (b.vx - a.vx) + dy * (b.vy - a.vy)) / length
    force = tension(length, rate)
    motion.push(a, force * dx / length, force * dy / length)
    motion.push(b, -force * dx / length, -force * dy / length)


def spring(element, motion, t):
    stiffness, length, damping = element.stiffness, element.length, element.damping
    pull_together(motion, element, lambda distance, rate: stiffness * (distance - length) + damping * rate)


def damper(element, motion, t):
    pull_together(motion, element, lambda distance, rate: element.damping * rate)


def torsion_spring(element, motion, t):
    a, b = motion.turn(element.a), motion.turn(element.b)
    elastic = element.stiffness * (b[0] - a[0] - element.angle)
    turn_back(motion, element, elastic + element.damping * (b[1] - a[1]))


def torsion_damper(element, motion, t):
    a, b = motion.turn(element.a), motion.turn(element.b)
    turn_back(motion, element, element.damping * (b[1] - a[1]))


def turn_back(motion, element, torque):
    motion.twist(element.a, torque)
    motion.twist(element.b, -torque)


def force(element, motion, t):
    x, y = at(element.x, t), at(element.y, t)
    point = motion.named(element.point)
    if element.frame == "body":
        cos, sin = motion.axes(point.body)
        x, y = cos * x - sin * y, sin * x + cos * y
    motion.push(point, x, y)


def torque(element, motion, t):
    moment = at(element.torque, t)
    motion.twist(element.body, moment)
    motion.twist(element.reaction, -moment)


FORCES = {
    "Gravity": gravity,
    "Spring": spring,
    "Damper": damper,
    "TorsionSpring": torsion_spring,
    "TorsionDamper": torsion_damper,
    "Force": force,
    "Torque": torque,
}
