"""Reactions of joints against the equations of Newton and Euler, and against statics."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from loops import four_bar, link, slider_crank

GRAVITY = cc.Gravity((0.0, -9.81))


def newton_and_euler(scene, run):
    """What force and moment balance of every body leaves, from named outputs alone.

    The balance is written about the origin of ground with the loads that the scene names; inertia, weight,
    springs and given forces are computed here.
    """
    g = sum((np.array(f.acceleration) for f in scene.forces if isinstance(f, cc.Gravity)), np.zeros(2))
    bodies = {body.name: body for body in scene.bodies}

    def at(reference):
        owner, point = reference.split(".")
        if owner == "ground":
            return np.tile(scene.ground[point], (len(run.t), 1))
        return np.column_stack((run[f"{reference}.x"], run[f"{reference}.y"]))

    def cross(a, b):
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

    left = {}
    for body in scene.bodies:
        center, acceleration = (
            np.column_stack((run[f"{body.name}.{p}x"], run[f"{body.name}.{p}y"])) for p in ("", "a")
        )
        force = body.mass * (acceleration - g)
        moment = body.inertia * run[f"{body.name}.angular_acceleration"] + cross(center, force)
        left[body.name] = [force, moment]

    def load(owner, place, force, moment=0.0):
        if owner in bodies:
            left[owner][0] = left[owner][0] - force
            left[owner][1] = left[owner][1] - cross(place, force) - moment

    for joint in scene.joints:
        force = np.column_stack((run[f"{joint.name}.reaction_x"], run[f"{joint.name}.reaction_y"]))
        moment, place = run[f"{joint.name}.reaction_torque"], at(joint.b)
        load(joint.b.split(".")[0], place, force, moment)
        load(joint.a.split(".")[0], place, -force, -moment)
    for force in scene.forces:
        if isinstance(force, (cc.Spring, cc.Damper)):
            a, b = at(force.a), at(force.b)
            pull = run[f"{force.name}.force"][:, None] * (a - b) / np.linalg.norm(a - b, axis=1)[:, None]
            load(force.b.split(".")[0], b, pull)
            load(force.a.split(".")[0], a, -pull)
        elif isinstance(force, (cc.TorsionSpring, cc.TorsionDamper)):
            none = np.zeros((len(run.t), 2))
            load(force.b, none, none, run[f"{force.name}.torque"])
            load(force.a, none, none, -run[f"{force.name}.torque"])
        elif isinstance(force, cc.Force):
            load(force.point.split(".")[0], at(force.point), np.tile((force.x, force.y), (len(run.t), 1)))
        elif isinstance(force, cc.Torque):
            none = np.zeros((len(run.t), 2))
            load(force.body, none, none, force.torque)
            load(force.reaction, none, none, -force.torque)
    return left


LOADS = [
    GRAVITY,
    cc.Spring("spring", "ground.W", "{last}.P", 300.0, 0.1, damping=4.0),
    cc.TorsionSpring("coil", "crank", "{middle}", 2.0, 0.3, 0.05),
    cc.Force("push", "{middle}.Q", 3.0, -7.0),
    cc.Torque("motor", "crank", 1.5, reaction="{middle}"),
]


def loaded(make, middle, last, **options):
    def filled(force):
        names = {
            f.name: getattr(force, f.name).format(middle=middle, last=last)
            for f in dataclasses.fields(force)
            if isinstance(getattr(force, f.name), str)
        }
        return dataclasses.replace(force, **names)

    return make([filled(force) for force in LOADS], **options)


class TestReactions:
    @pytest.mark.parametrize(
        "scene",
        [
            loaded(slider_crank, "rod", "slider"),
            loaded(slider_crank, "rod", "slider", drives=[cc.motions.Speed("drive", "bearing", 30.0, 0.7)]),
            loaded(
                slider_crank,
                "rod",
                "slider",
                drives=[cc.motions.Motion("drive", "guide", cc.motions.Harmonic(0.05, 9.0, mean=0.4))],
            ),
            loaded(four_bar, "coupler", "rocker"),
            loaded(
                four_bar,
                "coupler",
                "rocker",
                drives=[cc.motions.Motion("drive", "A", cc.motions.Harmonic(0.5, 9.0, mean=0.4))],
            ),
            loaded(
                four_bar,
                "coupler",
                "rocker",
                drives=[cc.motions.Motion("drive", "B", cc.motions.Polynomial([0.2, 0.0, 0.5]))],
            ),
        ],
        ids=["slider-crank", "driven crank", "driven slider", "four-bar", "swung crank", "driven coupler"],
    )
    def test_every_body_of_a_loop_is_in_balance(self, scene):
        run = cc.simulate(scene, duration=0.3, samples=31, outputs=["*"])
        scale = max(abs(run[name]).max() for name in run.columns if "reaction" in name)
        for name, (force, moment) in newton_and_euler(scene, run).items():
            assert abs(force).max() < 1e-9 * scale, name
            assert abs(moment).max() < 1e-9 * scale, name

    @pytest.mark.parametrize("angle", [0.3, 1.2, 2.5, -0.8])
    def test_a_held_slider_crank_is_a_matter_of_statics(self, angle):
        """The rod is a two-force member; the crank's torque is that of its pin force."""
        push = -50.0
        scene = slider_crank(
            [cc.Force("push", "slider.P", push, 0.0)],
            [cc.motions.Motion("hold", "bearing", angle)],
            angle=angle,
        )
        run = cc.simulate(scene, duration=0.1, samples=3, outputs=["*"])
        tilt = -math.asin(0.1 * math.sin(angle) / 0.35)
        rod = -push * np.array([1.0, math.tan(tilt)])  # what the rod does to the slider
        pin = 0.1 * np.array([math.cos(angle), math.sin(angle)])
        for name, truth in {
            "wrist.reaction_x": rod[0],
            "wrist.reaction_y": rod[1],
            "guide.reaction_x": 0.0,
            "guide.reaction_y": -rod[1],
            "pin.reaction_x": rod[0],
            "pin.reaction_y": rod[1],
            "bearing.reaction_x": rod[0],
            "bearing.reaction_y": rod[1],
            "hold.torque": pin[0] * rod[1] - pin[1] * rod[0],
            "hold.power": 0.0,
        }.items():
            np.testing.assert_allclose(run[name], truth, rtol=0.0, atol=1e-11 * 50.0, err_msg=name)

    def test_a_bracket_of_welded_bodies_carries_its_load(self):
        """A cantilever: the weld at its root feels weight and moment of all that hangs on it."""
        scene = cc.Scene(
            [link("beam", 0.5, 2.0), link("tip", 0.2, 1.0), cc.Body("wheel", 1.0, 1.0)],
            [
                cc.Fixed("root", "ground", "beam.P"),
                cc.Fixed("splice", "beam.Q", "tip.P"),
                cc.Revolute("axle", "tip.Q", "wheel"),
            ],
            [GRAVITY, cc.Force("load", "tip.Q", 0.0, -10.0)],
        )
        run = cc.simulate(scene, duration=0.1, samples=3, outputs=["root.*", "splice.*"])
        assert run["root.reaction_x"][0] == 0.0
        assert run["root.reaction_y"] == pytest.approx(4.0 * 9.81 + 10.0)
        moment = 2.0 * 9.81 * 0.25 + 1.0 * 9.81 * 0.6 + (9.81 + 10.0) * 0.7
        assert run["root.reaction_torque"] == pytest.approx(moment)
        assert run["splice.reaction_torque"] == pytest.approx(9.81 * 0.1 + (9.81 + 10.0) * 0.2)
