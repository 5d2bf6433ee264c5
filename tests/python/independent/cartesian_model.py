"""A scene as constraints and forces in Cartesian coordinates: the augmented system of `cartesian.py`."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from cartesian_elements import DRIVES, FORCES, FRICTION, LATCHED

GROUND = -1


class Place(NamedTuple):
    """A point of a body: index of the body and offset from its center of mass in its own frame [m]."""

    body: int
    x: float
    y: float


class Point(NamedTuple):
    """A point in motion: where, how fast, ∂(x, y)/∂angle, and acceleration at constant angular velocity."""

    body: int
    x: float
    y: float
    vx: float
    vy: float
    lever_x: float
    lever_y: float
    bend_x: float
    bend_y: float


class Contact(NamedTuple):
    """What a clearance joint does: forces act on the journal, and reversed on the bearing."""

    penetration: float
    penetration_rate: float
    sliding_velocity: float
    normal_force: float
    friction_force: float
    eccentricity: tuple[float, float]


@dataclass
class Phase:
    """State of contact of a clearance joint: the hysteresis factor [s/m], and whether it would pull."""

    hysteresis: float | None = None
    clipped: bool = False


def split(y):
    """Positions and velocities of a state."""
    half = len(y) // 2
    return y[:half], y[half:]


def rows(constraint):
    """Number of equations of a joint or drive."""
    return {"Prismatic": 2, "Fixed": 3, "Revolute": 2, "ClearanceRevolute": 2}.get(
        type(constraint).__name__, 1
    )


class Model:
    """A scene in Cartesian coordinates."""

    def __init__(self, scene):
        self.scene = scene
        self.names = [body.name for body in scene.bodies]
        self.masses = [body.mass for body in scene.bodies]
        self.places = {"ground": Place(GROUND, 0.0, 0.0)}
        self.places |= {f"ground.{name}": Place(GROUND, *at) for name, at in scene.ground.items()}
        self.mass = np.zeros((3 * len(self.names), 3 * len(self.names)))
        for index, body in enumerate(scene.bodies):
            center = body.center_of_mass
            points = {"center_of_mass": center, **body.points}
            self.places[body.name] = Place(index, -center[0], -center[1])
            for name, (x, y) in points.items():
                self.places[f"{body.name}.{name}"] = Place(index, x - center[0], y - center[1])
            about = points[body.inertia_about]
            moved = body.mass * ((about[0] - center[0]) ** 2 + (about[1] - center[1]) ** 2)
            diagonal = 3 * index + np.arange(3)
            self.mass[diagonal, diagonal] = body.mass, body.mass, body.inertia - moved
        self.joints = {joint.name: joint for joint in scene.joints}
        self.clearance = [joint for joint in scene.joints if type(joint).__name__ == "ClearanceRevolute"]
        ideal = [joint for joint in scene.joints if joint not in self.clearance]
        self.constraints = [*ideal, *scene.drives]
        for joint in self.clearance:
            if type(joint.contact).__name__ in LATCHED and joint.impact_velocity_floor is None:
                raise ValueError(f"joint {joint.name}: give the floor of the impact velocity explicitly")

    def residuals(self, t, motion, constraints=None):
        """φ, φ_q, φ_t and γ of the constraints."""
        constraints = self.constraints if constraints is None else constraints
        count = sum(rows(constraint) for constraint in constraints)
        system = System.of(count, len(motion.q))
        row = 0
        for constraint in constraints:
            kind = type(constraint).__name__
            if kind == "Revolute":
                system.coincide(row, motion.named(constraint.a), motion.named(constraint.b))
            elif kind == "ClearanceRevolute":  # concentric: for the start only
                system.coincide(row, motion.named(constraint.bearing), motion.named(constraint.journal))
            elif kind == "Fixed":
                a, b = motion.named(constraint.a), motion.named(constraint.b)
                system.coincide(row, a, b)
                system.angle(row + 2, motion, a.body, b.body, (constraint.angle, 0.0, 0.0))
            elif kind == "Prismatic":
                a, b = motion.named(constraint.a), motion.named(constraint.b)
                system.slide(row, motion, a, b, constraint.axis)
                system.angle(row + 1, motion, a.body, b.body, (constraint.angle, 0.0, 0.0))
            else:
                joint = self.joints[constraint.joint]
                wanted = DRIVES[kind](constraint, t)
                a, b = motion.named(joint.a), motion.named(joint.b)
                if type(joint).__name__ == "Prismatic":
                    system.along(row, motion, a, b, joint.axis, wanted)
                else:
                    system.angle(row, motion, a.body, b.body, wanted)
            row += rows(constraint)
        return system

    def accelerations(self, t, y, phases):
        """Accelerations and multipliers."""
        q, v = split(y)
        motion = Motion(self, q, v)
        for element in self.scene.forces:
            FORCES[type(element).__name__](element, motion, t)
        for joint, phase in zip(self.clearance, phases, strict=True):
            if phase.hysteresis is not None:
                motion.touch(joint, phase)
        system = self.residuals(t, motion)
        n, m = len(q), len(system.gamma)
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n] = self.mass
        matrix[n:, :n] = system.jacobian
        matrix[:n, n:] = system.jacobian.T
        solution = np.linalg.solve(matrix, np.concatenate([motion.load, system.gamma]))
        return solution[:n], solution[n:]

    def derivative(self, t, y, phases):
        return np.concatenate([split(y)[1], self.accelerations(t, y, phases)[0]])

    def start(self):
        """Assembled from the initial guesses of the angles and the start that the scene gives.

        What is left open changes as little as possible: no translation is known, so these give way first.
        """
        q = np.zeros(3 * len(self.names))
        q[2::3] = [body.angle for body in self.scene.bodies]
        v = np.zeros_like(q)
        translations = np.arange(len(q)) % 3 != 2
        for iteration in range(50):
            phi, jacobian, _ = self.start_conditions(Motion(self, q, v))
            known = ~np.isnan(phi)
            free = translations if iteration == 0 else np.ones_like(translations)
            step = np.linalg.lstsq(jacobian[known][:, free], -phi[known], rcond=1e-12)[0]
            q[free] += step
            if iteration > 0 and np.abs(step).max() < 1e-15:
                break
        phi, jacobian, rate = self.start_conditions(Motion(self, q, v))
        if np.nanmax(np.abs(phi), initial=0.0) > 1e-12:
            raise ValueError(f"cannot be assembled: {np.nanmax(np.abs(phi)):.1e} m remain")
        known = ~np.isnan(rate)
        v = np.linalg.lstsq(jacobian[known], rate[known], rcond=1e-12)[0]
        return np.concatenate([q, v])

    def start_conditions(self, motion):
        """φ, φ_q and the wanted φ_q v of the start; NaN where nothing is said."""
        given = getattr(self.scene, "start", ())
        gaps = {start.joint: start for start in given if type(start).__name__ == "ClearanceStart"}
        systems = [self.residuals(0.0, motion)]
        for joint in self.clearance:  # concentric unless said otherwise
            system = self.residuals(0.0, motion, [joint])
            if joint.name in gaps:
                system.phi -= gaps[joint.name].eccentricity
                system.phi_t -= gaps[joint.name].rate
            systems.append(system)
        for start in given:
            if start in gaps.values():
                continue
            system = System.of(1, len(motion.q))
            kind = type(start).__name__
            fields = ("angle", "angular_velocity") if kind == "BodyStart" else ("position", "velocity")
            values = [getattr(start, name) for name in fields]
            wanted = (*(math.nan if value is None else value for value in values), 0.0)
            joint = self.joints.get(getattr(start, "joint", None))
            a, b = ("ground", start.body) if joint is None else (joint.a, joint.b)
            if type(joint).__name__ == "Prismatic":
                system.along(0, motion, motion.named(a), motion.named(b), joint.axis, wanted)
            else:
                system.angle(0, motion, self.places[a].body, self.places[b].body, wanted)
            systems.append(system)
        return (
            np.concatenate([system.phi for system in systems]),
            np.concatenate([system.jacobian for system in systems]),
            -np.concatenate([system.phi_t for system in systems]),
        )

    def project(self, t, y):
        """The nearest state, in the metric of the mass matrix, that fulfills the constraints."""
        q, v = split(y.copy())
        for _ in range(3):
            system = self.residuals(t, Motion(self, q, v))
            q += self.nearest(system.jacobian, -system.phi)
        system = self.residuals(t, Motion(self, q, v))
        v += self.nearest(system.jacobian, -system.phi_t - system.jacobian @ v)
        return np.concatenate([q, v])

    def nearest(self, jacobian, wanted):
        weighted = np.linalg.solve(self.mass, jacobian.T)
        return weighted @ np.linalg.solve(jacobian @ weighted, wanted)


@dataclass
class System:
    """Constraint equations: φ, φ_q, φ_t, γ."""

    phi: np.ndarray
    jacobian: np.ndarray
    phi_t: np.ndarray
    gamma: np.ndarray

    @classmethod
    def of(cls, equations, coordinates):
        zero = np.zeros(equations)
        return cls(zero, np.zeros((equations, coordinates)), zero.copy(), zero.copy())

    def coincide(self, row, a, b):
        """b - a = 0."""
        self.phi[row], self.phi[row + 1] = b.x - a.x, b.y - a.y
        for point, sign in ((b, 1.0), (a, -1.0)):
            if point.body == GROUND:
                continue
            column = 3 * point.body
            self.jacobian[row, column] += sign
            self.jacobian[row + 1, column + 1] += sign
            self.jacobian[row, column + 2] += sign * point.lever_x
            self.jacobian[row + 1, column + 2] += sign * point.lever_y
            self.gamma[row] -= sign * point.bend_x
            self.gamma[row + 1] -= sign * point.bend_y

    def angle(self, row, motion, a, b, wanted):
        """angle of b - angle of a - wanted(t) = 0."""
        value, rate, second = wanted
        self.phi[row] = -value
        self.phi_t[row], self.gamma[row] = -rate, second
        for body, sign in ((b, 1.0), (a, -1.0)):
            if body != GROUND:
                self.phi[row] += sign * motion.q[3 * body + 2]
                self.jacobian[row, 3 * body + 2] += sign

    def slide(self, row, motion, a, b, axis):
        """normal · (b - a) = 0."""
        ux, uy = turned(motion, a.body, axis)
        self.component(row, motion, a, b, (-uy, ux), (-ux, -uy))

    def along(self, row, motion, a, b, axis, wanted):
        """axis · (b - a) - wanted(t) = 0."""
        value, rate, second = wanted
        ux, uy = turned(motion, a.body, axis)
        self.component(row, motion, a, b, (ux, uy), (-uy, ux))
        self.phi[row] -= value
        self.phi_t[row] = -rate
        self.gamma[row] += second

    def component(self, row, motion, a, b, unit, normal):
        """unit · (b - a), where `unit` turns with body a, at its angular velocity toward `normal`."""
        spin = 0.0 if a.body == GROUND else motion.v[3 * a.body + 2]
        (ux, uy), (nx, ny) = unit, normal
        dx, dy = b.x - a.x, b.y - a.y
        self.phi[row] = ux * dx + uy * dy
        # unit' = spin n and unit'' = -spin² unit + (angular acceleration) n; d'' at rest is `bend`.
        rate = nx * (b.vx - a.vx) + ny * (b.vy - a.vy)
        self.gamma[row] = spin * spin * self.phi[row] - 2.0 * spin * rate
        for point, sign in ((b, 1.0), (a, -1.0)):
            self.gamma[row] -= sign * (ux * point.bend_x + uy * point.bend_y)
            if point.body != GROUND:
                column = 3 * point.body
                self.jacobian[row, column] += sign * ux
                self.jacobian[row, column + 1] += sign * uy
                self.jacobian[row, column + 2] += sign * (ux * point.lever_x + uy * point.lever_y)
        if a.body != GROUND:
            self.jacobian[row, 3 * a.body + 2] += nx * dx + ny * dy


def turned(motion, body, axis):
    """Unit vector along an axis that is given in the frame of a body."""
    length = math.hypot(*axis)
    cos, sin = motion.axes(body)
    return (cos * axis[0] - sin * axis[1]) / length, (sin * axis[0] + cos * axis[1]) / length


class Motion:
    """All bodies in one state, and the generalized forces that have been put on them."""

    def __init__(self, model, q, v):
        self.model, self.q, self.v = model, q.tolist(), v.tolist()
        self.frames = [(math.cos(angle), math.sin(angle)) for angle in self.q[2::3]]
        self.load = np.zeros(len(q))
        self.points = {}

    def named(self, name):
        """The point of that name in motion."""
        if name not in self.points:
            self.points[name] = self.point(self.model.places[name])
        return self.points[name]

    def point(self, place):
        body, x, y = place
        if body == GROUND:
            return Point(GROUND, x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        cos, sin = self.frames[body]
        k, spin = 3 * body, self.v[3 * body + 2]
        rx, ry = cos * x - sin * y, sin * x + cos * y
        return Point(
            body,
            self.q[k] + rx,
            self.q[k + 1] + ry,
            self.v[k] - spin * ry,
            self.v[k + 1] + spin * rx,
            -ry,
            rx,
            -spin * spin * rx,
            -spin * spin * ry,
        )

    def axes(self, body):
        """Cosine and sine of a body's angle."""
        return (1.0, 0.0) if body == GROUND else self.frames[body]

    def turn(self, name):
        """Angle and angular velocity of the body of that name, or of a point of it."""
        body = self.model.places[name].body
        return (0.0, 0.0) if body == GROUND else (self.q[3 * body + 2], self.v[3 * body + 2])

    def push(self, point, x, y):
        if point.body != GROUND:
            k = 3 * point.body
            self.load[k] += x
            self.load[k + 1] += y
            self.load[k + 2] += point.lever_x * x + point.lever_y * y

    def twist(self, name, moment):
        body = self.model.places[name].body
        if body != GROUND:
            self.load[3 * body + 2] += moment

    def surface(self, point, radius, nx, ny):
        """The material point of a body at `radius` from `point` along the normal."""
        spin = 0.0 if point.body == GROUND else self.v[3 * point.body + 2]
        rx, ry = radius * nx, radius * ny
        lever = (0.0, 0.0) if point.body == GROUND else (point.lever_x - ry, point.lever_y + rx)
        return Point(
            point.body, point.x + rx, point.y + ry, point.vx - spin * ry, point.vy + spin * rx, *lever, 0, 0
        )

    def contact(self, joint, phase):
        """Penetration, velocities and forces of a clearance joint, and the two material points that touch."""
        bearing, journal = self.named(joint.bearing), self.named(joint.journal)
        ex, ey = journal.x - bearing.x, journal.y - bearing.y
        wx, wy = journal.vx - bearing.vx, journal.vy - bearing.vy
        distance = math.hypot(ex, ey)
        penetration = distance - joint.clearance
        if distance == 0.0:
            return Contact(penetration, 0.0, 0.0, 0.0, 0.0, (ex, ey)), None
        nx, ny = ex / distance, ey / distance
        rate = wx * nx + wy * ny
        bearing_radius = joint.journal_radius + joint.clearance
        on_journal = self.surface(journal, joint.journal_radius, nx, ny)
        on_bearing = self.surface(bearing, bearing_radius, nx, ny)
        if joint.sliding == "surface":
            sliding = -(on_journal.vx - on_bearing.vx) * ny + (on_journal.vy - on_bearing.vy) * nx
        else:  # of the geometric points p + R n, whose normals turn at (w·t) / distance
            across = wy * nx - wx * ny
            sliding = across + (joint.journal_radius - bearing_radius) * across / distance
        normal = friction = 0.0
        if phase.hysteresis is not None and not phase.clipped and penetration > 0.0:
            law = joint.contact
            normal = law.stiffness * penetration**law.exponent * (1.0 + phase.hysteresis * rate)
            if joint.friction is not None:
                coefficient = FRICTION[type(joint.friction).__name__](joint.friction, abs(sliding))
                friction = -math.copysign(coefficient * normal, sliding)
        state = Contact(penetration, rate, sliding, normal, friction, (ex, ey))
        return state, (on_journal, on_bearing, nx, ny)

    def touch(self, joint, phase):
        """Put the forces of a contact on the two bodies, where they touch."""
        state, where = self.contact(joint, phase)
        if where is None:
            return
        on_journal, on_bearing, nx, ny = where
        x = -state.normal_force * nx - state.friction_force * ny
        y = -state.normal_force * ny + state.friction_force * nx
        self.push(on_journal, x, y)
        self.push(on_bearing, -x, -y)
