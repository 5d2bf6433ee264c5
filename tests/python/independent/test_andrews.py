"""Andrews' squeezing mechanism against published values, and its three loops against the independent code."""

import andrews
import cartesian
import chebclear as cc
import numpy as np
import pytest


@pytest.mark.parametrize("method", ["rodas5p", "rodas4", "dop853", "adams"])
def test_andrews_mechanism_has_the_published_values(method):
    scene = andrews.scene(
        [
            cc.Spring("spring", "K3.D", "ground.C", andrews.SPRING_STIFFNESS, andrews.SPRING_LENGTH),
            cc.Torque("motor", "K1", andrews.TORQUE),
        ]
    )
    run = cc.simulate(
        scene, duration=andrews.DURATION, samples=2, rtol=1e-9 if method == "rodas4" else 1e-10, method=method
    )
    # Rates grow to 1e3 rad/s; the published values themselves are good to 3e-10 and 5e-8.
    assert andrews.published_angles(run) == pytest.approx(andrews.REFERENCE, rel=1e-7)
    rates = andrews.published_angles(run, "angular_velocity")
    assert rates == pytest.approx(andrews.REFERENCE_RATES, rel=1e-6)
    other = cartesian.simulate(scene, andrews.DURATION, 2, rtol=1e-12)
    for name in ("K4.angle", "K6.angle", "K3.angular_velocity", "K1.angular_acceleration"):
        np.testing.assert_allclose(run[name][-1], other[name][-1], rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("method", ["rodas5p", "dop853"])
def test_three_closed_loops_fall_as_in_the_independent_formulation(method):
    scene = andrews.scene([cc.Gravity((0.0, -9.81))])
    assert scene.check().degrees_of_freedom == 1
    run = cc.simulate(scene, duration=0.2, samples=41, rtol=1e-10, method=method)
    other = cartesian.simulate(scene, 0.2, 41, rtol=1e-11)
    assert np.ptp(run["K1.angle"]) > 1.0
    for name in run.columns:
        scale = np.abs(other[name]).max()
        np.testing.assert_allclose(run[name], other[name], atol=1e-7 * scale, err_msg=name)
