"""Independent codes solve the same scene: hand-derived equations, SciPy's and SUNDIALS' integrators.

The model below is written for its one mechanism, from the laws of the contact alone. It restarts at
every contact change. Trajectories with impacts are chaotic, so they are compared over the first changes.
"""

import itertools
import math
from dataclasses import dataclass

import chebclear as cc
import numpy as np
import pytest

scipy_integrate = pytest.importorskip("scipy.integrate", reason="needs scipy, of the extra `test`")
scipy_optimize = pytest.importorskip("scipy.optimize")

LENGTH = 1e-5  # unit of positions in the state of the solvers [m]: one tolerance serves all components


@dataclass
class Contact:
    """Journal in a bearing: Eq. (1) to (11) of the paper, written down anew."""

    stiffness: float
    restitution: float
    friction: tuple[float, float, float, float]
    journal_radius: float
    clearance: float
    surface: bool = True
    floor: float = 1e-6
    chi: float | None = None  # hysteresis factor; None in free flight

    def forces(self, e, rate, spin):
        """Normal force, friction along the tangent, and the sum on the journal."""
        size = math.hypot(*e)
        depth = size - self.clearance
        if self.chi is None or depth <= 0.0:
            return 0.0, np.zeros(2)
        n = np.array(e) / size
        t = np.array([-n[1], n[0]])
        slip = rate @ t + spin if self.surface else rate @ t * depth / size
        normal = max(self.stiffness * depth**1.5 * (1.0 + self.chi * (rate @ n)), 0.0)
        static, sliding, low, high = self.friction
        speed = abs(slip)
        if speed < low:
            mu = static * math.sin(0.5 * math.pi * speed / low)
        elif speed < high:
            mu = 0.5 * (static + sliding) + 0.5 * (static - sliding) * math.cos(
                math.pi * (speed - low) / (high - low)
            )
        else:
            mu = sliding
        friction = -math.copysign(mu, slip) * normal
        return friction, friction * t - normal * n

    def change(self, depth_rate):
        """Begin a contact with this velocity, or end it."""
        damping = 0.75 * (1.0 - self.restitution**2)
        self.chi = damping / max(depth_rate, self.floor) if self.chi is None else None


class SliderCrank:
    """The paper's mechanism in the slider's position and the rod's angle, about the moving crank pin."""

    def __init__(self, convention):
        printed = convention == "as_printed"
        self.crank, self.rod, self.speed = 0.05, 0.12, 2000.0 * math.pi / 30.0
        self.rod_mass, self.slider_mass = 0.21, 0.14
        self.pin_inertia = self.rod_mass * self.rod**2 * (1.0 / (3.0 if printed else 12.0) + 0.25)
        sigma = (1.0 - 0.3**2) / 207e9 / (math.pi if printed else 1.0)
        journal, bearing = 9.8e-3, 9.82e-3
        stiffness = 4.0 / (3.0 * 2.0 * sigma) * math.sqrt(journal * bearing / 2e-5)
        self.contact = Contact(stiffness, 0.9, (0.04, 0.03, 1e-3, 1.5e-3), journal, 2e-5, surface=not printed)
        self.scene = cc.mechanisms.slider_crank(convention=convention, impact_velocity_floor=1e-6)
        self.start = np.array([self.crank + self.rod, 0.0, 0.0, -self.crank * self.speed / self.rod])
        self.units = np.array([LENGTH, LENGTH / self.rod, 1.0, 1.0 / self.rod])
        self.outputs = {"slider.x": 0, "rod.angle": 1, "slider.vx": 2, "rod.angular_velocity": 3}

    def gap(self, t, y):
        x, angle, v, rate = y
        pin = self.crank * np.array([math.cos(self.speed * t), math.sin(self.speed * t)])
        along = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        e = np.array([x, 0.0]) - pin - self.rod * along
        e_rate = np.array([v, 0.0]) - self.speed * np.array([-pin[1], pin[0]]) - self.rod * rate * across
        return e, e_rate, pin, along, across

    def derivative(self, t, y):
        e, e_rate, pin, along, across = self.gap(t, y)
        bearing = self.contact.journal_radius + self.contact.clearance
        friction, force = self.contact.forces(e, e_rate, -y[3] * bearing)
        half = 0.5 * self.rod * self.rod_mass
        # Moments about the pin, which itself accelerates toward the crank's axis.
        moment = half * self.speed**2 * (along[0] * pin[1] - along[1] * pin[0])
        moment -= self.rod * across @ force + bearing * friction
        return np.array([y[2], y[3], force[0] / self.slider_mass, moment / self.pin_inertia])


def depth_of(model, t, y):
    return math.hypot(*model.gap(t, y)[0]) - model.contact.clearance


def phase_by_scipy(method, model, t, y, times):
    """One phase with SciPy: states at `times` within it, and its end."""

    def gap(t, z):
        return depth_of(model, t, z * model.units) / LENGTH

    gap.terminal, gap.direction = True, 1.0 if model.contact.chi is None else -1.0
    run = scipy_integrate.solve_ivp(
        lambda t, z: model.derivative(t, z * model.units) / model.units,
        (t, times[-1]),
        y / model.units,
        method,
        rtol=1e-13 if method == "DOP853" else 1e-12,
        # No step may pass a contact by.
        atol=1e-12,
        max_step=(times[-1] - t) / 50.0,
        dense_output=True,
        events=gap,
    )
    assert run.status >= 0, run.message
    end = run.t[-1]
    return (
        [run.sol(s) * model.units for s in times if s <= end],
        end,
        run.y[:, -1] * model.units,
        run.status == 1,
    )


def phase_by_cvode(method, model, t, y, times):
    """One phase with CVODE of SUNDIALS."""
    cvode = pytest.importorskip("sksundae.cvode", reason="needs scikit-sundae, of the extra `crosscheck`")

    def derivative(t, z, out):
        out[:] = model.derivative(t, z * model.units) / model.units

    def gap(t, z, out):
        out[0] = depth_of(model, t, z * model.units) / LENGTH

    gap.terminal, gap.direction = [True], [1 if model.contact.chi is None else -1]
    solver = cvode.CVODE(
        derivative,
        method=method,
        rtol=1e-13,
        atol=1e-12,
        max_num_steps=1_000_000,
        max_step=(times[-1] - t) / 50.0,
        eventsfn=gap,
        num_events=1,
    )
    inside = [s for s in times if s > t]
    run = solver.solve(np.array([t, *inside]), y / model.units)
    states = [z * model.units for s, z in zip(run.t[1:], run.y[1:], strict=True) if s in inside]
    landed = run.t_events is not None and len(run.t_events) > 0
    end, last = (run.t_events[-1], run.y_events[-1]) if landed else (run.t[-1], run.y[-1])
    return states, float(end), np.array(last) * model.units, landed


def solve(phase, method, model, times):
    """States at all times, and the instants of the contact changes."""
    t, y, changes, states = 0.0, model.start, [], [model.start]
    for _ in itertools.count():
        left = times[len(states) :]
        if not len(left):
            return np.array(states), changes
        found, t, y, landed = phase(method, model, t, y, left)
        states += found
        if landed:
            e, rate = model.gap(t, y)[:2]
            model.contact.change(float(rate @ e) / math.hypot(*e))
            changes.append(t)


CODES = {"Radau": (phase_by_scipy, "Radau"), "CVODE BDF": (phase_by_cvode, "BDF")}
# Duration of the comparison [s]: so many contact changes that errors have not grown a thousandfold.
SCENES = {
    "slider-crank, as printed": ("as_printed", 1.0e-3),
    "slider-crank, corrected": ("corrected", 0.6e-3),
}


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_gate_14_independent_codes_agree(scene, code):
    convention, duration = SCENES[scene]
    model = SliderCrank(convention)
    run = cc.simulate(model.scene, duration=duration, samples=101, rtol=1e-11)
    states, changes = solve(*CODES[code], model, run.t)
    located = run.events.time[np.isin(run.events.kind, ("onset", "separation"))]
    assert len(located) == len(changes) >= 4
    np.testing.assert_allclose(located, changes, rtol=0.0, atol=1e-6 * duration)
    worst = 0.0
    for name, place in model.outputs.items():
        ours, theirs = run[name], states[:, place]
        worst = max(worst, float(np.abs(ours - theirs).max() / np.ptp(theirs)))
    print(f"{scene}, {code}: {len(changes)} contact changes, off by {worst:.1e} of the range")
    assert worst <= 1e-6
