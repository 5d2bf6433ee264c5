"""Springs, dampers, given forces and motions against closed forms."""

import math

import chebclear as cc
import numpy as np
import pytest
from loops import slider_crank


def cart(forces=(), drives=(), start=(), axis=(1.0, 0.0)):
    """A cart of 2 kg on a rail."""
    return cc.Scene(
        [cc.Body("cart", 2.0, 0.3, points={"P": (0.0, 0.0)})],
        [cc.Prismatic("rail", "ground.O", "cart.P", axis)],
        forces,
        drives,
        ground={"O": (0.0, 0.0), "wall": (-1.0, 0.0)},
        start=start,
    )


class TestFunctionsOfTime:
    @pytest.mark.parametrize("count", [2, 3, 4, 5, 12])
    def test_a_table_is_the_spline_of_scipy(self, count):
        spline = pytest.importorskip("scipy.interpolate").CubicSpline
        random = np.random.default_rng(count)
        times = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 1.0, count - 1))])
        values = random.uniform(-1.0, 1.0, count)
        truth = spline(times, values)
        run = cc.simulate(
            cart(drives=[cc.motions.Motion("drive", "rail", cc.motions.Table(times, values))]),
            duration=times[-1],
            samples=201,
            outputs=["rail.displacement", "rail.velocity", "rail.acceleration", "drive.force"],
        )
        for order, name in enumerate(["displacement", "velocity", "acceleration"]):
            np.testing.assert_allclose(run[f"rail.{name}"], truth(run.t, order), rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(run["drive.force"], 2.0 * truth(run.t, 2), rtol=0.0, atol=1e-10)


def unit_speeds(angle):
    """Speeds of slider-crank's centers of mass and rod at unit crank speed, by the textbook."""
    crank, rod = 0.1, 0.35
    sine, cosine = np.sin(angle), np.cos(angle)
    tilt = np.arcsin(-crank * sine / rod)
    turning = -crank * cosine / (rod * np.cos(tilt))
    pin = np.array([-crank * sine, crank * cosine])
    arm = np.array([0.15 * np.cos(tilt) - 0.01 * np.sin(tilt), 0.15 * np.sin(tilt) + 0.01 * np.cos(tilt)])
    rod_speed = pin + turning * np.array([-arm[1], arm[0]])
    slider = -crank * sine - turning * rod * np.sin(tilt)
    return rod_speed, turning, slider


def reduced_inertia(angle, flywheel):
    """Moment of inertia of the slider-crank seen from its crank."""
    rod_speed, turning, slider = unit_speeds(angle)
    rod_inertia = 0.6 * 0.35**2 / 12.0
    return (
        3e-3
        + flywheel
        + 0.4 * 0.02**2
        + 0.6 * np.sum(rod_speed**2, axis=0)
        + rod_inertia * turning**2
        + 0.8 * slider**2
    )


class TestFlywheel:
    @pytest.mark.parametrize("flywheel", [0.0, 0.05])
    @pytest.mark.parametrize("torque", [0.0, 0.4])
    def test_speed_follows_from_the_work_done(self, flywheel, torque):
        """½ J(θ) ω² = ½ J(θ₀) ω₀² + T (θ - θ₀), with J(θ) by the textbook."""
        scene = slider_crank(
            [cc.Torque("motor", "crank", torque)],
            start=[cc.JointStart("bearing", position=0.7, velocity=20.0)],
            flywheel=flywheel,
        )
        run = cc.simulate(
            scene,
            duration=1.0,
            samples=401,
            rtol=1e-9,
            outputs=["bearing.angle", "bearing.angular_velocity", "energy.*"],
        )
        angle, speed = run["bearing.angle"], run["bearing.angular_velocity"]
        energy = 0.5 * reduced_inertia(0.7, flywheel) * 400.0 + torque * (angle - 0.7)
        np.testing.assert_allclose(speed, np.sqrt(2.0 * energy / reduced_inertia(angle, flywheel)), rtol=1e-7)
        np.testing.assert_allclose(run["energy.input"], torque * (angle - 0.7), rtol=0.0, atol=1e-7)
        assert angle[-1] > 3.0 * math.pi


@pytest.mark.parametrize("method", ["auto", "rodas4", "rodas5p"])
@pytest.mark.parametrize("damping", [1e6, 1e8])
def test_a_stiff_damper_hands_on_the_force_of_a_drive(damping, method):
    """Inside steps too, where the error of the velocity times the damping is a force."""
    amplitude, frequency = 0.1, 10.0
    scene = cc.Scene(
        [cc.Body("driver", 1.0, 1e-3), cc.Body("driven", 1.0, 1e-3)],
        [
            cc.Prismatic(name, "ground", body, axis=(1.0, 0.0))
            for name, body in (("a", "driver"), ("b", "driven"))
        ],
        [cc.Damper("damper", "driver", "driven", damping)],
        [cc.motions.Motion("motor", "a", f"{amplitude}/{frequency}*sin({frequency}*time) - 0.1")],
    )
    run = cc.simulate(scene, duration=2.0, samples=1001, outputs=["motor.force"], method=method)
    # v' = c (v_a - v) from rest: a steady oscillation once the start has died away.
    cos, sin = np.cos(frequency * run.t), np.sin(frequency * run.t)
    driver, scale = amplitude * cos, damping**2 + frequency**2
    driven = damping * amplitude * (damping * cos + frequency * sin) / scale
    force = -amplitude * frequency * sin + damping * (driver - driven)
    assert run["motor.force"][5:] == pytest.approx(force[5:], abs=0.005 * 2.0 * amplitude * frequency)
