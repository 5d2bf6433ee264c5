"""The same mechanics once more, independently of the product: Cartesian coordinates, multipliers, SciPy.

The product integrates joint coordinates of a tree cut at its clearance joints, in Rust. Here every body has
the three coordinates (x, y of its centre of mass, angle), every ideal joint and drive is a constraint
φ(q, t) = 0, and accelerations come from the augmented system of index 1

    [ M   φ_qᵀ ] [ a ]   [ Q ]
    [ φ_q  0   ] [ λ ] = [ γ ],      γ = -(φ_q v)_q v - 2 φ_qt v - φ_tt.

Clearance joints are forces in Q, from the points and velocities of the two material surfaces. SciPy's DOP853
integrates; every change of contact is located on its dense output, and a fresh step is taken that ends there.
Positions and velocities are projected onto the constraints at each restart.

A new force element is one function in `FORCES`, a new drive one in `DRIVES`, a new law one in `HYSTERESIS` or
`FRICTION`, all keyed by the name of the class that the scene holds.
"""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

GROUND = -1
DENSE_PIECES = 6  # parts of a step between which the signs of the guards are compared
STEPS_BETWEEN_PROJECTIONS = 50


class Place(NamedTuple):
    """A point of a body: index of the body and offset from its centre of mass in its own frame [m]."""

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


# --- laws -----------------------------------------------------------------------------------------------

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

# Angle [rad] of body b relative to body a with its first and second derivative.
DRIVES = {"Speed": lambda drive, t: (drive.angle + drive.speed * t, drive.speed, 0.0)}


# --- forces -----------------------------------------------------------------------------------------------


def at(value, t):
    """A number, or a function of time."""
    return value(t) if callable(value) else value


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
    pull_together(motion, element, lambda length, rate: element.stiffness * (length - element.length))


def damper(element, motion, t):
    pull_together(motion, element, lambda length, rate: element.damping * rate)


def torsion_spring(element, motion, t):
    a, b = motion.turn(element.a), motion.turn(element.b)
    turn_back(motion, element, element.stiffness * (b[0] - a[0] - element.angle))


def torsion_damper(element, motion, t):
    a, b = motion.turn(element.a), motion.turn(element.b)
    turn_back(motion, element, element.damping * (b[1] - a[1]))


def turn_back(motion, element, torque):
    motion.twist(element.a, torque)
    motion.twist(element.b, -torque)


def force(element, motion, t):
    x, y = (at(component, t) for component in element.force)
    point = motion.named(element.point)
    if element.frame == "body" and point.body != GROUND:
        cos, sin = motion.frames[point.body]
        x, y = cos * x - sin * y, sin * x + cos * y
    motion.push(point, x, y)


def torque(element, motion, t):
    motion.twist(element.body, at(element.torque, t))


FORCES = {
    "Gravity": gravity,
    "Spring": spring,
    "Damper": damper,
    "TorsionSpring": torsion_spring,
    "TorsionDamper": torsion_damper,
    "Force": force,
    "Torque": torque,
}


# --- the mechanism ----------------------------------------------------------------------------------------


class Model:
    """A scene in Cartesian coordinates; `forces` adds elements to those of the scene."""

    def __init__(self, scene, forces=()):
        self.scene = scene
        self.names = [body.name for body in scene.bodies]
        self.masses = [body.mass for body in scene.bodies]
        self.ground = {"ground": Place(GROUND, 0.0, 0.0)}
        self.ground |= {f"ground.{name}": Place(GROUND, *at) for name, at in scene.ground.items()}
        self.places = dict(self.ground)
        self.mass = np.zeros((3 * len(self.names), 3 * len(self.names)))
        for index, body in enumerate(scene.bodies):
            center = body.center_of_mass
            points = {"center_of_mass": center, **body.points}
            self.places[body.name] = Place(index, -center[0], -center[1])
            for name, (x, y) in points.items():
                self.places[f"{body.name}.{name}"] = Place(index, x - center[0], y - center[1])
            about = points[body.inertia_about]
            moved = body.mass * ((about[0] - center[0]) ** 2 + (about[1] - center[1]) ** 2)
            self.mass[3 * index + np.arange(3), 3 * index + np.arange(3)] = (
                body.mass,
                body.mass,
                body.inertia - moved,
            )
        self.joints = {joint.name: joint for joint in scene.joints}
        self.clearance = [joint for joint in scene.joints if type(joint).__name__ == "ClearanceRevolute"]
        ideal = [joint for joint in scene.joints if joint not in self.clearance]
        self.constraints = [*ideal, *scene.drives]
        self.forces = [*scene.forces, *forces]
        for joint in self.clearance:
            if type(joint.contact).__name__ in LATCHED and joint.impact_velocity_floor is None:
                raise ValueError(f"joint {joint.name}: give the floor of the impact velocity explicitly")

    def rows(self, constraint):
        return {"Prismatic": 2, "Fixed": 3, "Revolute": 2, "ClearanceRevolute": 2}.get(
            type(constraint).__name__, 1
        )

    def residuals(self, t, q, v, constraints=None):
        """φ, φ_q, φ_t and γ of the constraints."""
        motion = Motion(self, q, v)
        constraints = self.constraints if constraints is None else constraints
        count = sum(self.rows(constraint) for constraint in constraints)
        system = System(np.zeros(count), np.zeros((count, len(q))), np.zeros(count), np.zeros(count))
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
                a, b = self.places[joint.a].body, self.places[joint.b].body
                system.angle(row, motion, a, b, DRIVES[kind](constraint, t))
            row += self.rows(constraint)
        return system

    def accelerations(self, t, y, phases):
        """Accelerations and multipliers."""
        q, v = np.split(y, 2)
        motion = Motion(self, q, v)
        for element in self.forces:
            FORCES[type(element).__name__](element, motion, t)
        for joint, phase in zip(self.clearance, phases, strict=True):
            if phase.hysteresis is not None:
                motion.touch(joint, phase)
        system = self.residuals(t, q, v)
        n, m = len(q), len(system.gamma)
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n] = self.mass
        matrix[n:, :n] = system.jacobian
        matrix[:n, n:] = system.jacobian.T
        solution = np.linalg.solve(matrix, np.concatenate([motion.load, system.gamma]))
        return solution[:n], solution[n:]

    def derivative(self, t, y, phases):
        return np.concatenate([y[len(y) // 2 :], self.accelerations(t, y, phases)[0]])

    def start(self):
        """Assembled from the rough angles, every clearance joint concentric in position and velocity."""
        q = np.zeros(3 * len(self.names))
        q[2::3] = [body.angle for body in self.scene.bodies]
        v = np.zeros_like(q)
        together = [*self.constraints, *self.clearance]
        translations = np.arange(len(q)) % 3 != 2
        for iteration in range(50):
            system = self.residuals(0.0, q, v, together)
            free = translations if iteration == 0 else np.ones_like(translations)
            step = np.linalg.lstsq(system.jacobian[:, free], -system.phi, rcond=1e-12)[0]
            q[free] += step
            if iteration > 0 and np.abs(step).max() < 1e-15:
                break
        system = self.residuals(0.0, q, v, together)
        if np.abs(system.phi).max() > 1e-12:
            raise ValueError(f"cannot be assembled: {np.abs(system.phi).max():.1e} m remain")
        v = np.linalg.lstsq(system.jacobian, -system.phi_t, rcond=1e-12)[0]
        return np.concatenate([q, v])

    def project(self, t, y):
        """The nearest state, in the metric of the mass matrix, that fulfils the constraints."""
        q, v = np.split(y.copy(), 2)
        for _ in range(3):
            system = self.residuals(t, q, v)
            q += self.nearest(system.jacobian, -system.phi)
        system = self.residuals(t, q, v)
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
        """normal · (b - a) = 0, the normal of the axis turning with body a."""
        length = math.hypot(*axis)
        cos, sin = motion.frames[a.body] if a.body != GROUND else (1.0, 0.0)
        spin = motion.v[3 * a.body + 2] if a.body != GROUND else 0.0
        ux, uy = (cos * axis[0] - sin * axis[1]) / length, (sin * axis[0] + cos * axis[1]) / length
        nx, ny = -uy, ux
        dx, dy = b.x - a.x, b.y - a.y
        self.phi[row] = nx * dx + ny * dy
        # n' = -spin u, n'' = -spin² n - (angular acceleration) u; d'' without accelerations is `bend`.
        along_rate = ux * (b.vx - a.vx) + uy * (b.vy - a.vy)
        self.gamma[row] = spin * spin * self.phi[row] + 2.0 * spin * along_rate
        for point, sign in ((b, 1.0), (a, -1.0)):
            self.gamma[row] -= sign * (nx * point.bend_x + ny * point.bend_y)
            if point.body != GROUND:
                column = 3 * point.body
                self.jacobian[row, column] += sign * nx
                self.jacobian[row, column + 1] += sign * ny
                self.jacobian[row, column + 2] += sign * (nx * point.lever_x + ny * point.lever_y)
        if a.body != GROUND:
            self.jacobian[row, 3 * a.body + 2] -= ux * dx + uy * dy


class Motion:
    """All bodies in one state, and the generalised forces that have been put on them."""

    def __init__(self, model, q, v):
        self.model, self.q, self.v = model, q.tolist(), v.tolist()
        self.frames = [(math.cos(angle), math.sin(angle)) for angle in self.q[2::3]]
        self.load = np.zeros(len(q))

    def named(self, name):
        """The point of that name in motion."""
        body, x, y = self.model.places[name]
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


# --- through time -----------------------------------------------------------------------------------------


@dataclass
class Solution:
    """Samples by the names of the product's columns, and what happened."""

    t: np.ndarray
    columns: dict[str, np.ndarray]
    events: list[tuple[float, str, str]] = field(default_factory=list)
    residual: float = 0.0
    """Largest distance from the constraints before a projection [m, rad]."""
    multipliers: np.ndarray | None = None

    def __getitem__(self, name):
        return self.columns[name]


def guards(model, y, phases):
    """Positive while the phase lasts: gap of every clearance joint, then the brackets of their damping."""
    motion = Motion(model, *np.split(y, 2))
    values = []
    for joint, phase in zip(model.clearance, phases, strict=True):
        state, _ = motion.contact(joint, phase)
        if phase.hysteresis is None:
            values += [-state.penetration, math.inf]
        else:
            bracket = 1.0 + phase.hysteresis * state.penetration_rate
            values += [state.penetration, -bracket if phase.clipped else bracket]
    return np.array(values)


def cross(model, guard, y, phases):
    """Enter the next phase of the joint that a guard belongs to; what happened, in the product's words."""
    index, which = divmod(guard, 2)
    joint, phase = model.clearance[index], phases[index]
    if which == 1:
        phases[index] = Phase(phase.hysteresis, not phase.clipped)
        return joint.name, "unclip" if phase.clipped else "clip"
    if phase.hysteresis is not None:
        phases[index] = Phase()
        return joint.name, "separation"
    rate = Motion(model, *np.split(y, 2)).contact(joint, phase)[0].penetration_rate
    impact = rate if joint.impact_velocity_floor is None else max(rate, joint.impact_velocity_floor)
    phases[index] = Phase(HYSTERESIS[type(joint.contact).__name__](joint.contact, impact))
    return joint.name, "onset"


def first_crossing(model, dense, t0, t1, phases):
    """The guard that changes sign first on a step, and when."""
    times = np.linspace(t0, t1, DENSE_PIECES + 1)
    before = guards(model, dense(t0), phases)
    for left, right in pairwise(times):
        after = guards(model, dense(right), phases)
        found = []
        for guard in np.flatnonzero((before > 0.0) & (after <= 0.0)):

            def value(t, guard=guard):
                return guards(model, dense(t), phases)[guard]

            # The guard at `left` may be a rounding error above zero and fall: then it is there already.
            root = brentq(value, left, right, xtol=1e-18, rtol=1e-15) if value(left) > 0.0 else left
            found.append((root, int(guard)))
        if found:
            return min(found)
        before = after
    return None


def simulate(scene, duration, samples, rtol=1e-12, forces=(), start=None, max_events=None):
    """Solve a scene and sample it as the product does; ends early after `max_events` events."""
    model = Model(scene, forces)
    phases = [Phase() for _ in model.clearance]
    t, y = 0.0, model.start() if start is None else np.asarray(start, dtype=float)
    grid = np.linspace(0.0, duration, samples)
    states = [(y, tuple(phases))]
    solution = Solution(grid, {})
    scales = [joint.clearance for joint in model.clearance]
    half = len(y) // 2
    # SciPy weighs errors by atol + rtol |y|: positions must be good for the least clearance.
    atol = rtol * np.concatenate([np.full(half, min(scales, default=1e-2)), np.full(half, 1e-2)])

    def solver(t, y, end):
        frozen = tuple(phases)
        # SciPy's guess of the first step knows nothing of the force that is about to set in.
        first = min(1e-6 * duration, end - t)
        return DOP853(
            lambda t, y: model.derivative(t, y, frozen), t, y, end, rtol=rtol, atol=atol, first_step=first
        )

    def land(t, y, end):
        run = solver(t, y, end)
        while run.status == "running":
            run.step()
        if run.status == "failed":
            raise RuntimeError(f"no step at t = {run.t} s")
        return run.y

    def restart(t, y):
        system = model.residuals(t, *np.split(y, 2))
        solution.residual = max(solution.residual, np.abs(system.phi).max(initial=0.0))
        return model.project(t, y) if len(system.phi) else y

    run = solver(t, y, duration)
    steps = 0
    while run.status == "running":
        run.step()
        if run.status == "failed":
            raise RuntimeError(f"no step at t = {run.t} s")
        steps += 1
        dense = run.dense_output()
        before = run.t_old
        crossing = first_crossing(model, dense, before, run.t, phases) if model.clearance else None
        end = run.t if crossing is None else crossing[0]
        while len(states) < samples and grid[len(states)] <= end:
            states.append((dense(grid[len(states)]), tuple(phases)))
        if crossing is not None:
            y = land(before, dense(before), end) if end > before else run.y
            y = restart(end, y)
            solution.events.append((end, *cross(model, crossing[1], y, phases)))
            if max_events is not None and len(solution.events) >= max_events:
                break
            run = solver(end, y, duration)
        elif steps % STEPS_BETWEEN_PROJECTIONS == 0 and run.status == "running":
            run = solver(run.t, restart(run.t, run.y), duration)
    solution.t = grid[: len(states)]
    fill(model, solution, states)
    return solution


BODY = ("x", "y", "angle", "vx", "vy", "angular_velocity", "ax", "ay", "angular_acceleration")


def fill(model, solution, states):
    """The columns of all samples."""
    rows, multipliers = [], []
    for t, (y, phases) in zip(solution.t, states, strict=True):
        acceleration, forces = model.accelerations(t, y, phases)
        q, v = np.split(y, 2)
        motion = Motion(model, q, v)
        row = {}
        for index, name in enumerate(model.names):
            k = 3 * index
            values = (*q[k : k + 3], *v[k : k + 3], *acceleration[k : k + 3])
            row |= {f"{name}.{what}": value for what, value in zip(BODY, values, strict=True)}
        for joint, phase in zip(model.clearance, phases, strict=True):
            contact, _ = motion.contact(joint, phase)
            eccentricity = contact.eccentricity
            row |= {
                f"{joint.name}.eccentricity_x": eccentricity[0],
                f"{joint.name}.eccentricity_y": eccentricity[1],
                f"{joint.name}.eccentricity": math.hypot(*eccentricity),
                f"{joint.name}.contact": float(phase.hysteresis is not None),
            }
            row |= {
                f"{joint.name}.{what}": value
                for what, value in zip(Contact._fields[:5], contact, strict=False)
            }
        first = 0
        for constraint in model.constraints:
            if type(constraint).__name__ in DRIVES:  # the drive's constraint force on body b is -λ
                row[f"{constraint.name}.torque"] = -forces[first]
            first += model.rows(constraint)
        rows.append(row)
        multipliers.append(forces)
    solution.columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    solution.multipliers = np.array(multipliers)
