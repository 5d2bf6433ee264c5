"""Closed loops of ideal joints, with loads, drives and starts: a slider-crank and a four-bar."""

import math

import chebclear as cc


def link(name, length, mass, angle=0.0, center=None, inertia=None):
    return cc.Body(
        name,
        mass,
        mass * length**2 / 12.0 if inertia is None else inertia,
        center_of_mass=(0.5 * length, 0.0) if center is None else center,
        points={"P": (0.0, 0.0), "Q": (length, 0.0)},
        angle=angle,
    )


def slider_crank(forces=(), drives=(), start=(), flywheel=0.0, angle=0.7):
    """An ideal slider-crank, crank 0.1 m, rod 0.35 m; all joints at named points."""
    crank, rod = 0.1, 0.35
    tilt = -math.asin(crank * math.sin(angle) / rod)
    return cc.Scene(
        [
            link("crank", crank, 0.4, angle, center=(0.02, 0.0), inertia=3e-3 + flywheel),
            link("rod", rod, 0.6, tilt, center=(0.15, 0.01)),
            cc.Body("slider", 0.8, 1e-3, points={"P": (0.0, 0.0), "T": (0.05, 0.02)}),
        ],
        [
            cc.Revolute("bearing", "ground.O", "crank.P"),
            cc.Revolute("pin", "crank.Q", "rod.P"),
            cc.Revolute("wrist", "rod.Q", "slider.P"),
            cc.Prismatic("guide", "ground.O", "slider.P", (1.0, 0.0)),
        ],
        forces,
        drives,
        ground={"O": (0.0, 0.0), "W": (0.8, 0.1)},
        start=start,
    )


def four_bar(forces=(), drives=(), start=()):
    return cc.Scene(
        [link("crank", 0.1, 0.2, 0.4), link("coupler", 0.25, 0.5, 0.6), link("rocker", 0.2, 0.4, 1.8)],
        [
            cc.Revolute("A", "ground.A", "crank.P"),
            cc.Revolute("B", "crank.Q", "coupler.P"),
            cc.Revolute("C", "coupler.Q", "rocker.Q"),
            cc.Revolute("D", "ground.D", "rocker.P"),
        ],
        forces,
        drives,
        ground={"A": (0.0, 0.0), "D": (0.3, 0.0), "W": (0.15, 0.3)},
        start=start,
    )
