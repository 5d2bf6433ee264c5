"""The same mechanics once more, independently of the product: Cartesian coordinates, multipliers, SciPy.

The product integrates joint coordinates of a tree cut at its clearance joints, in Rust. Here every body has
the three coordinates (x, y of its center of mass, angle), every ideal joint and drive is a constraint
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

import numpy as np
from cartesian_elements import DRIVES, HYSTERESIS
from cartesian_model import GROUND, Contact, Model, Motion, Phase, rows, split
from scipy.integrate import DOP853
from scipy.optimize import brentq

DENSE_PIECES = 6  # parts of a step between which the signs of the guards are compared
STEPS_BETWEEN_PROJECTIONS = 50


@dataclass
class Solution:
    """Samples by the names of the product's columns, and what happened."""

    t: np.ndarray
    columns: dict[str, np.ndarray]
    events: list[tuple[float, str, str]] = field(default_factory=list)
    residual: float = 0.0
    """Largest distance from the constraints before a projection [m, rad]."""

    def __getitem__(self, name):
        return self.columns[name]


def guards(model, y, phases):
    """Positive while the phase lasts: gap of every clearance joint, then the brackets of their damping."""
    motion = Motion(model, *split(y))
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
    rate = Motion(model, *split(y)).contact(joint, phase)[0].penetration_rate
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


def simulate(scene, duration, samples, rtol=1e-12, max_events=None):
    """Solve a scene and sample it as the product does; ends early after `max_events` events."""
    model = Model(scene)
    phases = [Phase() for _ in model.clearance]
    t, y = 0.0, model.start()
    grid = np.linspace(0.0, duration, samples)
    states = [(y, tuple(phases))]
    solution = Solution(grid, {})
    scale = min((joint.clearance for joint in model.clearance), default=1e-2)
    half = len(y) // 2
    # SciPy weighs errors by atol + rtol |y|: positions must be good for the least clearance. Neither can
    # be better than rounding: 1e-17 m in a penetration is 1e-14 m/s after a step through a stiff contact.
    least_velocity = max(1e-2 * rtol, 1e-14)
    atol = np.concatenate([np.full(half, max(rtol * scale, 1e-17)), np.full(half, least_velocity)])

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
        system = model.residuals(t, Motion(model, *split(y)))
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
    table = []
    for t, (y, phases) in zip(solution.t, states, strict=True):
        acceleration, multipliers = model.accelerations(t, y, phases)
        q, v = split(y)
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
        row |= reactions(model, motion, model.residuals(t, motion).jacobian, multipliers)
        table.append(row)
    solution.columns = {name: np.array([row[name] for row in table]) for name in table[0]}


def reactions(model, motion, jacobian, multipliers):
    """What ideal joints, with their drives, put on their second body at its point; the effort of drives."""
    row, spans = 0, {}
    for constraint in model.constraints:
        spans.setdefault(getattr(constraint, "joint", constraint.name), []).append(
            slice(row, row + rows(constraint))
        )
        row += rows(constraint)
    found = {}
    for name, parts in spans.items():
        # M a + φ_qᵀ λ = Q: the constraints put -φ_qᵀ λ on the bodies.
        load = -sum(jacobian[part].T @ multipliers[part] for part in parts)
        joint = model.joints[name]
        a, b = motion.named(joint.a), motion.named(joint.b)
        body, sign = (b.body, 1.0) if b.body != GROUND else (a.body, -1.0)
        x, y, moment = sign * load[3 * body : 3 * body + 3]
        moment -= (b.x - motion.q[3 * body]) * y - (b.y - motion.q[3 * body + 1]) * x
        found |= {f"{name}.reaction_x": x, f"{name}.reaction_y": y, f"{name}.reaction_torque": moment}
    for drive in model.constraints:
        if type(drive).__name__ in DRIVES:
            effort = "force" if type(model.joints[drive.joint]).__name__ == "Prismatic" else "torque"
            found[f"{drive.name}.{effort}"] = -multipliers[spans[drive.joint][-1]][0]
    return found
