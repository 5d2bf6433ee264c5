"""The least impact velocity that a contact latches, where the scene does not give one."""

import chebclear as cc
import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


def slow_impact(floor=None):
    """A shaft that reaches the bottom of its bearing at 1.4e-7 m/s, under its weight."""
    law = cc.laws.Flores(1e9, 0.3)
    pin = cc.ClearanceRevolute("pin", "ground.O", "shaft.C", 0.02, 1e-3, law, impact_velocity_floor=floor)
    return cc.Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[cc.Body("shaft", mass=1.0, inertia=1e-3, points={"C": (0.0, 0.0)})],
        joints=[pin],
        forces=[cc.Gravity((0.0, -9.81))],
        start=[cc.ClearanceStart("pin", (0.0, 1e-15 - 1e-3))],
    )


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5])
def test_an_error_estimate_includes_the_floor(rtol):
    exact = cc.simulate(slow_impact(1e-14), duration=0.02, samples=401, rtol=1e-10)
    run = cc.simulate(slow_impact(), duration=0.02, samples=401, rtol=rtol, error="estimate")
    assert run.stats.impacts_at_floor == 1
    for output in ("shaft.vy", "pin.penetration"):
        error = np.max(np.abs(run[output] - exact[output]))
        # It converges with the fourth root of the floor: two tolerances differ by 0.44 of the error.
        assert error <= 3.0 * run.error[output].max_difference


def test_the_floor_told_is_that_of_the_default_tolerance():
    (given,) = slow_impact(0.25).check().impact_velocity_floors
    (default,) = slow_impact().check().impact_velocity_floors
    assert given == 0.25
    # A tenth of √(g R), times rtol; the law's χ v₀ is above 1.
    assert default == pytest.approx(0.1 * 1e-6 * np.sqrt(9.81 * 0.02), rel=1e-9)
