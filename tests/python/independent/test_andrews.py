"""Andrews' squeezing mechanism against published values, and its three loops against the independent code."""

from dataclasses import dataclass

import andrews
import cartesian
import chebclear as cc
import numpy as np
import pytest


@dataclass
class Spring:
    a: str
    b: str
    stiffness: float
    length: float
    damping: float = 0.0


@dataclass
class Torque:
    body: str
    torque: float
    reaction: str = "ground"


def test_published_values_are_reproduced_by_the_independent_formulation():
    forces = [
        Spring("K3.D", "ground.C", andrews.SPRING_STIFFNESS, andrews.SPRING_LENGTH),
        Torque("K1", andrews.TORQUE),
    ]
    run = cartesian.simulate(andrews.scene(), andrews.DURATION, 2, rtol=1e-11, forces=forces)
    # Solutions at rtol 1e-11 and 1e-12 agree to 1e-11; the published angles are 3e-10 off, the rates 5e-8.
    assert andrews.published_angles(run) == pytest.approx(andrews.REFERENCE, rel=1e-9)
    rates = andrews.published_angles(run, "angular_velocity")
    assert rates == pytest.approx(andrews.REFERENCE_RATES, rel=1e-7)
    assert run.residual < 1e-12


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
