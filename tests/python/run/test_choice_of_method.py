"""What the automatic choice of the method costs beside the methods themselves, in evaluations."""

import dataclasses
import warnings

import chebclear as cc
import pytest

METHODS = ("adams", "rodas4", "rodas5p", "dop853")


def work(run: cc.Trajectory) -> float:
    """Evaluations; a Jacobian, which contains one, counts two and a factorization a half."""
    return run.stats.evaluations + run.stats.jacobians + 0.5 * run.stats.factorizations


def held() -> cc.Scene:
    """A heavy slider that slides on a loose pin with friction, on a crank that stands still."""
    return cc.mechanisms.slider_crank(
        crank_speed=0.0,
        crank_angle=2.2153591,
        clearance=8.3456e-7,
        rod_mass=0.002,
        slider_mass=20.0,
        slider_inertia=0.01,
        gravity=9.81,
        contact=cc.laws.LankaraniNikravesh(1.9688e14, 0.736),
        friction=cc.laws.ModifiedCoulomb(0.1138, 0.0853, 3.7718e-5, 5.6576e-5),
    )


def loose() -> cc.Scene:
    """A slow slider-crank whose wrist sticks."""
    friction = cc.laws.ModifiedCoulomb(0.3, 0.2, 1e-6, 1.5e-6)
    return cc.mechanisms.slider_crank(crank_speed=1.0, clearance=1e-4, gravity=9.81, friction=friction)


def wiper() -> cc.Scene:
    """A four-bar with a loose pin and a blade on its rocker, pressed to a pane."""
    friction = cc.laws.SmoothedCoulomb(0.3, 1e-6)
    scene = cc.mechanisms.four_bar(
        clearance_at=("rocker_pin",), clearance=5e-5, crank_speed=4.0, gravity=9.81, friction=friction
    )
    rubs = cc.motions.Expression("-T*tanh(rocker.angular_velocity/w)", {"T": 1.0, "w": 1e-4})
    return dataclasses.replace(scene, forces=[*scene.forces, cc.Torque("blade", "rocker", rubs)])


def run(scene: cc.Scene, method: str, duration: float, rtol: float, max_steps: int) -> cc.Trajectory:
    """A run that may use up its steps."""
    body = scene.bodies[0].name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.simulate(
            scene,
            duration=duration,
            samples=2,
            rtol=rtol,
            method=method,
            outputs=[f"{body}.angle"],
            max_steps=max_steps,
            on_failure="return",
        )


@pytest.mark.parametrize(
    ("scene", "duration", "rtol"),
    [(held(), 0.1, 2.9e-8), (loose(), 0.5, 1e-4), (wiper(), 0.1, 1e-4)],
    ids=["held", "loose", "wiper"],
)
def test_the_automatic_choice_costs_at_most_twice_the_best_method(
    scene: cc.Scene, duration: float, rtol: float
) -> None:
    others = [run(scene, method, duration, rtol, 6000) for method in METHODS]
    best = min(work(other) for other in others if other.success)
    auto = run(scene, "auto", duration, rtol, int(best))
    assert auto.success
    assert work(auto) <= 2.0 * best


def test_a_choice_does_not_depend_on_samples_or_outputs() -> None:
    few, many = (
        cc.simulate(loose(), duration=0.3, samples=samples, rtol=1e-4, outputs=outputs)
        for samples, outputs in (
            (2, ["slider.x"]),
            (3001, ["slider.x", "energy.total", "wrist.normal_force"]),
        )
    )
    assert few.stats == many.stats
    assert few["slider.x"][-1] == many["slider.x"][-1]


def test_the_adams_method_says_where_stability_makes_it_dear() -> None:
    stuck = run(wiper(), "adams", 0.4, 1e-4, 5000)
    (notice,) = [notice for notice in stuck.notices if notice.code == "stability"]
    assert notice.numbers["steps"] == stuck.stats.steps
    assert 0.5 * stuck.stats.steps < notice.numbers["limited"] <= stuck.stats.steps
    assert notice.numbers["share"] < 0.5
    # Not of a motion without friction, nor of the automatic choice.
    smooth = cc.simulate(cc.mechanisms.pendulum_in_bearing(clearance_at=()), duration=1.0, method="adams")
    chosen = run(wiper(), "auto", 0.4, 1e-4, 5000)
    assert not any(notice.code == "stability" for notice in [*smooth.notices, *chosen.notices])
