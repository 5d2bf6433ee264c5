"""The rival: the paper's slider-crank with a clearance joint, integrated by SciPy.

An independent model of the scene that chebclear simulates, derived by hand for two coordinates and written
for speed: the right-hand side, its Jacobian, the search for contact changes and the interpolation of the
samples are compiled by Numba. The integration is SciPy's, in three ways:

* ``odeint`` (LSODA) and ``ode dop853``, whose step loops are compiled: the fastest that SciPy has;
* ``LSODA``, ``DOP853`` and ``Radau``, the classes of ``scipy.integrate``, stepped by hand;
* ``solve_ivp ...``, the same three with its own events and samples, as most users would write it.

Scene. The crank (length r) turns at the constant speed W from angle 0. The rod (length l, angle theta) hangs
on the crank pin A and carries the bearing (radius R_B) at its other end C. The slider moves along the x axis
at position x and carries the journal (radius R_J). The radial clearance is c = R_B - R_J.

    A = r (cos W t, sin W t)          u = (cos theta, sin theta)      C = A + l u
    e = (x, 0) - C                    n = e/|e|, t = n turned by +90 degrees
    gap = |e| - c                     contact where gap > 0 (the penetration)

The force F = -F_N n + F_T t acts on the slider, -F on the rod at C + R_B n, so that

    m_s x''               = F_x                                            (slider, along the guide)
    (I + m l^2/4) theta'' = -(l u + R_B n) x F + m (l/2) W^2 u x A         (rod, about the moving pin A)

where the last term is the inertia force of the pin's acceleration -W^2 A.

    F_N = K gap^1.5 (1 + chi gap') >= 0, chi = 3 (1 - c_e^2) / (4 v_0) with the gap' = v_0 latched at onset
    F_T = -mu(v_T) F_N, the friction law of the paper's Eq. (11), odd in v_T

State: (x, theta, x', theta'). The solvers see it in the units of the contact, (1e-5 m, 1e-5 m / l, 1 m/s,
1 m/s / l), so that one absolute tolerance serves all four. A tolerance relative to the position 0.17 m would
be blind to a penetration of 1e-6 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numba import njit
from scipy.integrate import DOP853, LSODA, Radau, ode, odeint, solve_ivp

CONVENTIONS = ("as_printed", "corrected", "frictionless")

# Positions of the numbers in the parameter array.
_R, _L, _W, _PIN_INERTIA, _HALF_MOMENT, _SLIDER_MASS, _RJ, _C, _K, _MU_S, _MU_D, _VS, _VD = range(13)
_SURFACE, _DAMPING, _FLOOR, _CONTACT, _CHI, _CALLS, _JACOBIANS, _COUNT = range(13, 21)

# Columns of a recorded step: t, x, theta, x', theta', x'', theta'', x''', theta'''.
_COLUMNS = 9
# Recorder state: rows used, armed, verdict of the last step, bracket of the contact change inside it.
_ROWS, _ARMED, _VERDICT, _LEFT, _RIGHT, _START = range(6)
_GO_ON, _CHANGE, _FULL = 0, 1, 2
_PROBES = 8  # gap evaluations inside a step, equally spaced, beside the one at its end

_fast = partial(njit, cache=False, error_model="numpy", fastmath=False)


_LENGTH = 1e-5  # unit of position in the solvers' state

# ----------------------------------------------------------------------------------------------------
# Mechanics


def parameters(convention: str = "as_printed", impact_velocity_floor: float = 1e-6) -> np.ndarray:
    """The paper's Tables 1 and 2 as the array that the compiled functions read.

    ``as_printed``: sliding velocity of the geometric contact point, stiffness with pi, rod inertia m l^2/3
    about its center of mass. ``corrected``: surface sliding velocity, Hertz stiffness, inertia m l^2/12.
    ``frictionless``: as corrected, without friction.
    """
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: {convention!r} is none of {CONVENTIONS}")
    printed = convention == "as_printed"
    crank, rod, rod_mass, slider_mass = 0.05, 0.12, 0.21, 0.14
    journal_radius, clearance, restitution = 9.8e-3, 2e-5, 0.9
    young_modulus, poisson_ratio = 207e9, 0.3
    sigma = (1 - poisson_ratio**2) / young_modulus / (math.pi if printed else 1)
    bearing_radius = journal_radius + clearance
    inertia = rod_mass * rod**2 / (3 if printed else 12)
    p = np.zeros(_COUNT + 4)  # and room for a derivative
    p[_R], p[_L], p[_W] = crank, rod, 2000 * math.pi / 30
    p[_PIN_INERTIA] = inertia + rod_mass * rod**2 / 4
    p[_HALF_MOMENT] = rod_mass * rod / 2
    p[_SLIDER_MASS] = slider_mass
    p[_RJ], p[_C] = journal_radius, clearance
    p[_K] = 4 / (3 * 2 * sigma) * math.sqrt(journal_radius * bearing_radius / clearance)
    p[_MU_S], p[_MU_D] = (0.0, 0.0) if convention == "frictionless" else (0.04, 0.03)
    p[_VS], p[_VD] = 1e-3, 1.5e-3
    p[_SURFACE] = not printed
    p[_DAMPING] = 3 * (1 - restitution**2) / 4
    p[_FLOOR] = impact_velocity_floor
    return p


def start(p: np.ndarray) -> np.ndarray:
    """Ideal kinematics at crank angle 0, journal centered in the bearing."""
    return np.array([p[_R] + p[_L], 0.0, 0.0, -p[_R] * p[_W] / p[_L]])


@_fast
def _friction(v, p):
    """Signed friction coefficient of Eq. (11) and its derivative."""
    speed = abs(v)
    sign = 1.0 if v >= 0.0 else -1.0
    if speed < p[_VS]:
        k = 0.5 * math.pi / p[_VS]
        return p[_MU_S] * math.sin(k * v), p[_MU_S] * k * math.cos(k * v)
    if speed < p[_VD]:
        k = math.pi / (p[_VD] - p[_VS])
        half = 0.5 * (p[_MU_S] - p[_MU_D])
        angle = k * (speed - p[_VS])
        return sign * (0.5 * (p[_MU_S] + p[_MU_D]) + half * math.cos(angle)), -half * k * math.sin(angle)
    return sign * p[_MU_D], 0.0


@_fast
def _gap(t, x, theta, p):
    """Penetration; negative in free flight."""
    angle = p[_W] * t
    ex = x - p[_R] * math.cos(angle) - p[_L] * math.cos(theta)
    ey = -p[_R] * math.sin(angle) - p[_L] * math.sin(theta)
    return math.sqrt(ex * ex + ey * ey) - p[_C]


@_fast
def _gap_rate(t, x, theta, v, w, p):
    angle = p[_W] * t
    ax, ay = p[_R] * math.cos(angle), p[_R] * math.sin(angle)
    ux, uy = math.cos(theta), math.sin(theta)
    ex, ey = x - ax - p[_L] * ux, -ay - p[_L] * uy
    dx, dy = v + p[_W] * ay + p[_L] * w * uy, -p[_W] * ax - p[_L] * w * ux
    return (ex * dx + ey * dy) / math.sqrt(ex * ex + ey * ey)


@_fast
def _accelerations(t, x, theta, v, w, p):
    """x'', theta'' and the normal force."""
    angle = p[_W] * t
    ax, ay = p[_R] * math.cos(angle), p[_R] * math.sin(angle)
    ux, uy = math.cos(theta), math.sin(theta)
    moment = p[_HALF_MOMENT] * p[_W] * p[_W] * (ux * ay - uy * ax)
    if p[_CONTACT] == 0.0:
        return 0.0, moment / p[_PIN_INERTIA], 0.0
    rod, c = p[_L], p[_C]
    ex, ey = x - ax - rod * ux, -ay - rod * uy
    distance = math.sqrt(ex * ex + ey * ey)
    gap = distance - c
    if gap <= 0.0:
        return 0.0, moment / p[_PIN_INERTIA], 0.0
    dx, dy = v + p[_W] * ay + rod * w * uy, -p[_W] * ax - rod * w * ux
    nx, ny = ex / distance, ey / distance
    factor = 1.0 + p[_CHI] * (nx * dx + ny * dy)
    if factor <= 0.0:
        return 0.0, moment / p[_PIN_INERTIA], 0.0
    normal = p[_K] * gap * math.sqrt(gap) * factor
    slip = nx * dy - ny * dx
    if p[_SURFACE] != 0.0:
        slip -= w * (p[_RJ] + c)
    else:
        slip *= gap / distance
    mu, _ = _friction(slip, p)
    tangential = -mu * normal
    fx = -normal * nx - tangential * ny
    fy = -normal * ny + tangential * nx
    moment -= rod * (ux * fy - uy * fx) + (p[_RJ] + c) * tangential
    return fx / p[_SLIDER_MASS], moment / p[_PIN_INERTIA], normal


@_fast
def _gradients(t, x, theta, v, w, p, out):
    """Derivatives of (x'', theta'') by x, theta, x', theta' and t: the columns of ``out`` (2, 5)."""
    angle = p[_W] * t
    speed, rod, c = p[_W], p[_L], p[_C]
    ax, ay = p[_R] * math.cos(angle), p[_R] * math.sin(angle)
    ux, uy = math.cos(theta), math.sin(theta)
    pull = p[_HALF_MOMENT] * speed * speed
    out[:, :] = 0.0
    out[1, 1] = -pull * (ux * ax + uy * ay) / p[_PIN_INERTIA]
    out[1, 4] = pull * speed * (ux * ax + uy * ay) / p[_PIN_INERTIA]
    if p[_CONTACT] == 0.0:
        return
    ex, ey = x - ax - rod * ux, -ay - rod * uy
    distance = math.sqrt(ex * ex + ey * ey)
    gap = distance - c
    if gap <= 0.0:
        return
    dx, dy = v + speed * ay + rod * w * uy, -speed * ax - rod * w * ux
    nx, ny = ex / distance, ey / distance
    rate = nx * dx + ny * dy
    across = nx * dy - ny * dx
    factor = 1.0 + p[_CHI] * rate
    if factor <= 0.0:
        return
    root = math.sqrt(gap)
    normal = p[_K] * gap * root * factor
    bearing = p[_RJ] + c
    surface = p[_SURFACE] != 0.0
    slip = across - w * bearing if surface else across * gap / distance
    mu, mu_slope = _friction(slip, p)
    tangential = -mu * normal
    fx = -normal * nx - tangential * ny
    fy = -normal * ny + tangential * nx
    # Variations of e, e' and theta' for each of the five variables.
    for k in range(5):
        ex_k, ey_k, dx_k, dy_k, w_k, theta_k = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if k == 0:
            ex_k = 1.0
        elif k == 1:
            ex_k, ey_k, theta_k = rod * uy, -rod * ux, 1.0
            dx_k, dy_k = rod * w * ux, rod * w * uy
        elif k == 2:
            dx_k = 1.0
        elif k == 3:
            dx_k, dy_k, w_k = rod * uy, -rod * ux, 1.0
        else:
            ex_k, ey_k = speed * ay, -speed * ax
            dx_k, dy_k = speed * speed * ax, speed * speed * ay
        gap_k = nx * ex_k + ny * ey_k
        turn = (nx * ey_k - ny * ex_k) / distance  # the normal turns by this angle
        rate_k = nx * dx_k + ny * dy_k + across * turn
        across_k = nx * dy_k - ny * dx_k - rate * turn
        if surface:
            slip_k = across_k - bearing * w_k
        else:
            slip_k = across_k * gap / distance + across * c / (distance * distance) * gap_k
        normal_k = 1.5 * p[_K] * root * factor * gap_k + p[_K] * gap * root * p[_CHI] * rate_k
        tangential_k = -mu_slope * slip_k * normal - mu * normal_k
        fx_k = -normal_k * nx - tangential_k * ny - fy * turn
        fy_k = -normal_k * ny + tangential_k * nx + fx * turn
        out[0, k] = fx_k / p[_SLIDER_MASS]
        moment_k = -rod * (ux * fy_k - uy * fx_k - theta_k * (ux * fx + uy * fy)) - bearing * tangential_k
        out[1, k] += moment_k / p[_PIN_INERTIA]


@_fast
def _derivative(p, t, y, out):
    p[_CALLS] += 1.0
    rod = p[_L]
    a, alpha, _ = _accelerations(t, _LENGTH * y[0], _LENGTH / rod * y[1], y[2], y[3] / rod, p)
    out[0], out[1], out[2], out[3] = y[2] / _LENGTH, y[3] / _LENGTH, a, alpha * rod


@_fast
def right_hand_side(p, t, y):
    """y' for SciPy; the latched contact state travels in the parameter array, which also counts the calls."""
    out = np.empty(4)
    _derivative(p, t, y, out)
    return out


@_fast
def _derivative_in_place(p, t, y):
    _derivative(p, t, y, p[_COUNT:])


def right_hand_side_in_place(p: np.ndarray):
    """y' as a callable (t, y) that returns the same array every time, which takes a third less time.

    For the compiled step loops, which copy the result at once; the solver classes keep references.
    """
    out = p[_COUNT:]

    def rhs(t, y, p=p, compute=_derivative_in_place, out=out):
        compute(p, t, y)
        return out

    return rhs


@_fast
def jacobian(p, t, y):
    """Exact dy'/dy."""
    p[_JACOBIANS] += 1.0
    rod = p[_L]
    part = np.empty((2, 5))
    _gradients(t, _LENGTH * y[0], _LENGTH / rod * y[1], y[2], y[3] / rod, p, part)
    out = np.zeros((4, 4))
    out[0, 2] = out[1, 3] = 1.0 / _LENGTH
    for i in range(2):
        row = 1.0 if i == 0 else rod
        out[2 + i, 0], out[2 + i, 1] = row * part[i, 0] * _LENGTH, row * part[i, 1] * _LENGTH / rod
        out[2 + i, 2], out[2 + i, 3] = row * part[i, 2], row * part[i, 3] / rod
    return out


# ----------------------------------------------------------------------------------------------------
# Steps, contact changes, samples


@_fast
def _put(row, t, x, theta, v, w, p):
    """State, acceleration and jerk at the end of a step."""
    a, alpha, _ = _accelerations(t, x, theta, v, w, p)
    g = np.empty((2, 5))
    _gradients(t, x, theta, v, w, p, g)
    row[0], row[1], row[2], row[3], row[4], row[5], row[6] = t, x, theta, v, w, a, alpha
    row[7] = g[0, 0] * v + g[0, 1] * w + g[0, 2] * a + g[0, 3] * alpha + g[0, 4]
    row[8] = g[1, 0] * v + g[1, 1] * w + g[1, 2] * a + g[1, 3] * alpha + g[1, 4]


@_fast
def _hermite(s, h, q0, v0, a0, j0, q1, v1, a1, j1):
    """Value and slope of the degree-7 interpolant of position, velocity, acceleration and jerk at both ends.

    Its velocity is of order 7 in the step length, as the best of the solvers' own interpolants, but cheaper.
    """
    b1, b2, b3 = v0 * h, 0.5 * a0 * h * h, j0 * h * h * h / 6.0
    p0 = q1 - q0 - b1 - b2 - b3
    p1 = v1 * h - b1 - 2.0 * b2 - 3.0 * b3
    p2 = a1 * h * h - 2.0 * b2 - 6.0 * b3
    p3 = j1 * h * h * h - 6.0 * b3
    c4 = 35.0 * p0 - 15.0 * p1 + 2.5 * p2 - p3 / 6.0
    c5 = -84.0 * p0 + 39.0 * p1 - 7.0 * p2 + 0.5 * p3
    c6 = 70.0 * p0 - 34.0 * p1 + 6.5 * p2 - 0.5 * p3
    c7 = -20.0 * p0 + 10.0 * p1 - 2.0 * p2 + p3 / 6.0
    value = q0 + s * (b1 + s * (b2 + s * (b3 + s * (c4 + s * (c5 + s * (c6 + s * c7))))))
    slope = b1 + s * (2 * b2 + s * (3 * b3 + s * (4 * c4 + s * (5 * c5 + s * (6 * c6 + s * 7 * c7)))))
    return value, slope / h


@_fast
def _interpolate(a, b, t):
    """State at t between two recorded rows."""
    h = b[0] - a[0]
    s = (t - a[0]) / h
    x, v = _hermite(s, h, a[1], a[3], a[5], a[7], b[1], b[3], b[5], b[7])
    theta, w = _hermite(s, h, a[2], a[4], a[6], a[8], b[2], b[4], b[6], b[8])
    return x, theta, v, w


@_fast
def _excess(a, b, t, p):
    """Positive once the present contact state has ended: the gap in free flight, minus the gap in contact."""
    x, theta, _, _ = _interpolate(a, b, t)
    gap = _gap(t, x, theta, p)
    return -gap if p[_CONTACT] != 0.0 else gap


@_fast
def record(rows, state, p, t, y):
    """Store a step; -1 to stop because the contact state changed inside it (or the storage is full), else 0.

    The gap is tested at the end of the step and at eight points inside it, and where these have an inner
    maximum also at the vertex of the parabola through it: a change and its reversal within one step are not
    missed. A change counts only after the state that it ends has been seen (armed), so that the same root is
    not found again after a restart.
    """
    k = int(state[_ROWS])
    if k > 0 and t <= rows[k - 1, 0]:
        return 0
    rod = p[_L]
    _put(rows[k], t, _LENGTH * y[0], _LENGTH / rod * y[1], y[2], y[3] / rod, p)
    state[_ROWS] = k + 1
    state[_VERDICT] = _GO_ON
    if k == 0:
        return 0
    a, b = rows[k - 1], rows[k]
    h = t - a[0]
    left, before, earlier = a[0], -math.inf, -math.inf
    for i in range(1, _PROBES + 2):
        now = a[0] + h * i / (_PROBES + 1) if i <= _PROBES else t
        value = _excess(a, b, now, p)
        if value > 0.0:
            if state[_ARMED] == 0.0 and value < 1e-15:
                continue
            state[_VERDICT], state[_LEFT], state[_RIGHT] = _CHANGE, left, now
            return -1
        if value < 0.0:
            state[_ARMED] = 1.0
        if before > earlier and before >= value and i > 2:
            bend = earlier - 2.0 * before + value
            if bend < 0.0 and before - 0.125 * (value - earlier) ** 2 / bend > 0.25 * before:
                vertex = left + 0.5 * (earlier - value) / bend * h / (_PROBES + 1)
                if _excess(a, b, vertex, p) > 0.0:
                    low = left - h / (_PROBES + 1)
                    state[_VERDICT], state[_LEFT], state[_RIGHT] = _CHANGE, low, vertex
                    return -1
        left, before, earlier = now, value, before
    if k + 1 == rows.shape[0]:
        state[_VERDICT] = _FULL
        return -1
    return 0


@_fast
def locate(rows, state, p):
    """Time and state of the contact change found in the last step, by bisection on the interpolant."""
    k = int(state[_ROWS]) - 1
    a, b = rows[k - 1], rows[k]
    left, right = state[_LEFT], state[_RIGHT]
    for _ in range(80):
        middle = 0.5 * (left + right)
        if middle <= left or middle >= right:
            break
        if _excess(a, b, middle, p) > 0.0:
            right = middle
        else:
            left = middle
    y = np.empty(4)
    y[0], y[1], y[2], y[3] = _interpolate(a, b, right)
    return right, y


@_fast
def settle(t, y, p):
    """Newton correction of a state that lies next to the surface of the joint: to gap 0 along the motion."""
    for _ in range(3):
        gap = _gap(t, y[0], y[1], p)
        rate = _gap_rate(t, y[0], y[1], y[2], y[3], p)
        if abs(gap) < 1e-17 or abs(gap) > 1e-2 * p[_C] or abs(rate) < 1e-9:
            break
        a, alpha, _ = _accelerations(t, y[0], y[1], y[2], y[3], p)
        h = -gap / rate
        t += h
        y[0] += h * (y[2] + 0.5 * h * a)
        y[1] += h * (y[3] + 0.5 * h * alpha)
        y[2] += h * a
        y[3] += h * alpha
    return t


@_fast
def fill(rows, count, p, times, first, out):
    """Sample the recorded steps; returns the index of the next sample that they do not reach.

    Rows of ``out``: x, theta, x', theta', x'', penetration, normal force.
    """
    k = 1
    while first < times.shape[0] and times[first] <= rows[count - 1, 0]:
        t = times[first]
        while rows[k, 0] < t and k < count - 1:
            k += 1
        x, theta, v, w = _interpolate(rows[k - 1], rows[k], t)
        a, _, normal = _accelerations(t, x, theta, v, w, p)
        out[0, first], out[1, first], out[2, first], out[3, first] = x, theta, v, w
        out[4, first], out[5, first], out[6, first] = a, _gap(t, x, theta, p), normal
        first += 1
    return first


@_fast
def record_all(rows, state, p, t, y):
    """``record`` for the rows of a table of states, up to the first change."""
    for i in range(t.shape[0]):
        if record(rows, state, p, t[i], y[i]) < 0:
            return i
    return t.shape[0]


# ----------------------------------------------------------------------------------------------------
# SciPy

_RELATIVE = 1e-13  # the tolerance is the absolute one


class Stepper:
    """A solver class of ``scipy.integrate`` stepped by hand, without the overhead of ``solve_ivp``."""

    def __init__(self, solver: type, p: np.ndarray, tolerance: float, grid: np.ndarray) -> None:
        self.solver, self.options, self.end = solver, {"rtol": _RELATIVE, "atol": tolerance}, grid[-1]
        self.rhs = partial(right_hand_side, p)
        if solver in (LSODA, Radau):
            self.options["jac"] = partial(jacobian, p)

    def advance(self, t: float, y: np.ndarray, first_step: float, chunk: int, rows, state, p) -> int:
        """Record steps until the contact state changes; returns their number."""
        options = self.options if self.solver is LSODA else {"first_step": first_step, **self.options}
        solver = self.solver(self.rhs, t, y, self.end, **options)
        step, observe = solver.step, partial(record, rows, state, p)
        while solver.status == "running":
            message = step()
            if solver.status == "failed":
                raise RuntimeError(f"{self.solver.__name__} at t = {solver.t}: {message}")
            if observe(solver.t, solver.y) < 0:
                break
        return int(state[_ROWS]) - 1

    def reach(self, t: float, y: np.ndarray, end: float) -> np.ndarray:
        """State at a later time within the same contact state."""
        solver = self.solver(self.rhs, t, y, end, **self.options)
        while solver.status == "running":
            message = solver.step()
        if solver.status == "failed":
            raise RuntimeError(f"{self.solver.__name__} at t = {solver.t}: {message}")
        return solver.y


class Compiled:
    """``scipy.integrate.ode`` with a code with a compiled step loop, which calls back after every step."""

    def __init__(self, name: str, p: np.ndarray, tolerance: float, grid: np.ndarray) -> None:
        self.name, self.rhs, self.end = name, right_hand_side_in_place(p), grid[-1]
        self.options = {"rtol": _RELATIVE, "atol": tolerance, "nsteps": 10_000_000}

    def _run(self, t: float, y: np.ndarray, end: float, first_step: float, observe) -> np.ndarray:
        solver = ode(self.rhs).set_integrator(self.name, first_step=first_step, **self.options)
        if observe is not None:
            solver.set_solout(observe)
        solver.set_initial_value(y, t)
        y = solver.integrate(end)
        if not solver.successful():
            raise RuntimeError(f"{self.name} at t = {solver.t}: code {solver.get_return_code()}")
        return y

    def advance(self, t: float, y: np.ndarray, first_step: float, chunk: int, rows, state, p) -> int:
        self._run(t, y, self.end, first_step, partial(record, rows, state, p))
        return int(state[_ROWS]) - 1

    def reach(self, t: float, y: np.ndarray, end: float) -> np.ndarray:
        return self._run(t, y, end, end - t, None)


class Tabulated:
    """``odeint``: LSODA with a compiled step loop, which returns the states on a given grid but cannot stop.

    So it runs over chunks, each twice as long as the one before, and the grid is searched for a contact
    change afterwards; the first interval of the grid after a change is split into 16.
    """

    def __init__(self, p: np.ndarray, tolerance: float, grid: np.ndarray) -> None:
        self.grid = grid
        self.options = {"rtol": _RELATIVE, "atol": tolerance, "mxstep": 1_000_000}
        self.rhs, self.jacobian = right_hand_side_in_place(p), partial(jacobian, p)

    def _run(self, times: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, int]:
        states, info = odeint(
            self.rhs, y, times, Dfun=self.jacobian, tfirst=True, full_output=True, **self.options
        )
        if info["message"] != "Integration successful.":
            raise RuntimeError(f"odeint from t = {times[0]}: {info['message']}")
        return states, int(info["nst"][-1])

    def advance(self, t: float, y: np.ndarray, first_step: float, chunk: int, rows, state, p) -> int:
        first = int(np.searchsorted(self.grid, t, side="right"))
        times = self.grid[first : first + (8 << min(chunk, 10))]
        if chunk == 0:
            fine = t + (times[min(1, len(times) - 1)] - t) * np.arange(17) / 16
            times = np.concatenate((fine[:-1], times[times >= fine[-1]]))
        else:
            times = np.concatenate(((t,), times))
        states, steps = self._run(times, y)
        record_all(rows, state, p, times, states)
        return steps

    def reach(self, t: float, y: np.ndarray, end: float) -> np.ndarray:
        return self._run(np.array((t, end)), y)[0][-1]


_STEPPED = {
    "LSODA": partial(Stepper, LSODA),
    "DOP853": partial(Stepper, DOP853),
    "Radau": partial(Stepper, Radau),
    "odeint": Tabulated,
    "ode dop853": partial(Compiled, "dop853"),
}
_TEXTBOOK = {f"solve_ivp {name}": name for name in ("LSODA", "DOP853", "Radau")}
METHODS = (*_STEPPED, *_TEXTBOOK)


@dataclass
class Run:
    """Samples and work of one simulation."""

    t: np.ndarray
    values: np.ndarray = field(repr=False)
    steps: int | None
    evaluations: int
    jacobians: int
    changes: list[float]

    x = property(lambda self: self.values[0])
    theta = property(lambda self: self.values[1])
    vx = property(lambda self: self.values[2])
    omega = property(lambda self: self.values[3])
    ax = property(lambda self: self.values[4])
    penetration = property(lambda self: self.values[5])
    normal_force = property(lambda self: self.values[6])


def simulate(
    convention: str = "as_printed",
    *,
    method: str = "LSODA",
    rtol: float = 1e-6,
    duration: float = 0.06,
    samples: int = 1441,
    impact_velocity_floor: float = 1e-6,
) -> Run:
    """Integrate the paper's case study with a SciPy method (one of ``METHODS``).

    ``rtol`` is the tolerance in the contact's units: rtol 1e-5 m, rtol 1 m/s for slider and rod end.
    The steps, and so the trajectory, do not depend on ``samples``.
    """
    if method not in METHODS:
        raise ValueError(f"method: {method!r} is none of {METHODS}")
    p = parameters(convention, impact_velocity_floor)
    times = np.linspace(0.0, duration, samples)
    if method in _TEXTBOOK:
        return _textbook(p, _TEXTBOOK[method], rtol, times)
    unit = np.array([_LENGTH, _LENGTH / p[_L], 1.0, 1.0 / p[_L]])
    grid = np.linspace(0.0, duration, max(1, round(duration * 48_000)) + 1)
    integrator = _STEPPED[method](p, rtol, grid)
    values = np.empty((7, samples))
    rows = np.empty((1 << 14, _COLUMNS))
    state = np.zeros(6)
    t, y, first_step, next_sample, steps, chunk, changes = 0.0, start(p), 1e-6, 0, 0, 0, []
    while t < duration:
        state[_ROWS] = 0.0
        record(rows, state, p, t, y / unit)
        steps += integrator.advance(t, y / unit, first_step, chunk, rows, state, p)
        chunk += 1
        count = int(state[_ROWS])
        t, y = rows[count - 1, 0], rows[count - 1, 1:5].copy()
        change = state[_VERDICT] == _CHANGE
        if change:
            t, y = locate(rows, state, p)
            before = rows[count - 2]
            if p[_CONTACT]:
                # The step crossed the end of the force: repeat it up to the separation.
                for _ in range(5):
                    y = unit * integrator.reach(before[0], before[1:5] / unit, t)
                    late = _gap(t, y[0], y[1], p) / _gap_rate(t, *y, p)
                    if abs(late) < 1e-9 or t - late <= before[0]:
                        break
                    t -= late
            t = settle(t, y, p)
            _put(rows[count - 1], t, *y, p)
        next_sample = fill(rows, count, p, times, next_sample, values)
        if change:
            changes.append(t)
            chunk, first_step = 0, 1e-6
            state[_ARMED] = 0.0
            p[_CONTACT] = 1.0 - p[_CONTACT]
            if p[_CONTACT]:
                p[_CHI] = p[_DAMPING] / max(_gap_rate(t, *y, p), p[_FLOOR])
    return Run(times, values, steps, int(p[_CALLS]), int(p[_JACOBIANS]), changes)


@_fast
def _scaled_gap(p, t, y):
    return _gap(t, _LENGTH * y[0], _LENGTH / p[_L] * y[1], p) / _LENGTH


@_fast
def _scaled_gap_rate(p, t, y):
    return _gap_rate(t, _LENGTH * y[0], _LENGTH / p[_L] * y[1], y[2], y[3] / p[_L], p)


def _terminal(function, p: np.ndarray, direction: float):
    def event(t, y):
        return function(p, t, y)

    event.terminal, event.direction = True, direction
    return event


@_fast
def _finish(p, t, y, out):
    """The columns of ``fill`` from states in the solvers' units."""
    for i in range(t.shape[0]):
        x, theta, v, w = _LENGTH * y[0, i], _LENGTH / p[_L] * y[1, i], y[2, i], y[3, i] / p[_L]
        a, _, normal = _accelerations(t[i], x, theta, v, w, p)
        out[0, i], out[1, i], out[2, i], out[3, i] = x, theta, v, w
        out[4, i], out[5, i], out[6, i] = a, _gap(t[i], x, theta, p), normal


def _textbook(p: np.ndarray, method: str, tolerance: float, times: np.ndarray) -> Run:
    """``solve_ivp`` with terminal events and ``t_eval``: what most users would write.

    The directions of the events keep them from finding their own roots again after a restart. A flight within
    one step would be missed, as ``solve_ivp`` looks at the ends of steps only: so it also stops where the gap
    is widest.
    """
    options = {"method": method, "rtol": _RELATIVE, "atol": tolerance}
    if method != "DOP853":
        options["jac"] = partial(jacobian, p)
    rhs = partial(right_hand_side, p)
    onset, separation = _terminal(_scaled_gap, p, 1.0), _terminal(_scaled_gap, p, -1.0)
    widest = _terminal(_scaled_gap_rate, p, 1.0)
    unit = np.array([_LENGTH, _LENGTH / p[_L], 1.0, 1.0 / p[_L]])
    values = np.empty((7, times.shape[0]))
    t, y, done, changes, events = 0.0, start(p) / unit, 0, [], [onset]
    while True:
        solution = solve_ivp(rhs, (t, times[-1]), y, t_eval=times[done:], events=events, **options)
        if solution.status < 0:
            raise RuntimeError(f"solve_ivp {method} from t = {t}: {solution.message}")
        count = len(solution.t)
        if count:
            _finish(p, solution.t, np.ascontiguousarray(solution.y), values[:, done : done + count])
        done += count
        if solution.status == 0:
            return Run(times, values, None, int(p[_CALLS]), int(p[_JACOBIANS]), changes)
        change = len(solution.t_events[0]) > 0
        t, y = (found[0 if change else 1][-1] for found in (solution.t_events, solution.y_events))
        if not change:
            events = [onset]
            continue
        changes.append(t)
        p[_CONTACT] = 1.0 - p[_CONTACT]
        events = [separation] if p[_CONTACT] else [onset, widest]
        if p[_CONTACT]:
            p[_CHI] = p[_DAMPING] / max(_gap_rate(t, *(unit * y), p), p[_FLOOR])
