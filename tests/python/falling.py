"""A block that falls along a guide on a planet known as intervals: every band has a closed form."""

import math

import chebclear as cc
import numpy as np

TIME = {"duration": 0.4, "samples": 41}


def faller(gravity=9.81, tilt=0.5 * math.pi, mass=2.0):
    """A block on a guide without friction: along the guide it falls by gravity sin(tilt) t^2 / 2."""
    return cc.Scene(
        [cc.Body("block", mass=mass, inertia=0.1)],
        [cc.Prismatic("guide", "ground", "block", axis=(math.cos(tilt), math.sin(tilt)))],
        [cc.Gravity((0.0, -gravity))],
    )


def height(t, gravity, tilt):
    return -0.5 * gravity * np.sin(tilt) ** 2 * t**2


PLANET = {"gravity": cc.Interval(8.0, 11.0), "tilt": cc.Interval(0.3, 1.2)}


def planet_study(**options):
    return cc.Study(faller, PLANET, ["block.y", "block.vy"], **(TIME | {"rtol": 1e-10} | options))
