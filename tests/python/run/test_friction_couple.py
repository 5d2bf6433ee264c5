"""Friction acts at the two contact points, which lie apart by the penetration: a couple remains."""

from pathlib import Path

import chebclear as cc
import numpy as np
import pytest
from momenta import momenta

LAWS = Path(__file__).parents[3] / "docs" / "laws.md"
RADIUS = 0.02
# Mass and inertia about the center of mass.
BODIES = {"shaft": (2.0, 4e-4), "housing": (3.0, 1e-2)}


def free_pair(stiffness):
    friction = cc.laws.ModifiedCoulomb(0.4, 0.3, 1e-3, 1.5e-3)
    contact = cc.laws.LankaraniNikravesh(stiffness, 0.9)
    shaft, housing = (BODIES[name] for name in ("shaft", "housing"))
    return cc.Scene(
        bodies=[
            cc.Body("shaft", *shaft, points={"C": (0.0, 0.0)}),
            cc.Body("housing", *housing, center_of_mass=(0.01, 0.02), points={"hole": (0.05, -0.03)}),
        ],
        joints=[cc.ClearanceRevolute("pin", "housing.hole", "shaft.C", RADIUS, 1e-3, contact, friction)],
        start=[
            cc.ClearanceStart("pin", (0.0, 0.0), (0.7, 0.2)),
            cc.BodyStart("shaft", angular_velocity=40.0),
        ],
    )


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("stiffness", [1e10, 1e7, 4e5])
def test_a_free_pair_drifts_by_exactly_the_couple_of_friction(stiffness):
    run = cc.simulate(free_pair(stiffness), duration=0.012, samples=8001, rtol=1e-9)
    momentum = momenta(run)[2]
    depth, force = np.maximum(run["pin.penetration"], 0.0), run["pin.friction_force"]

    def integral(moment):
        return np.concatenate([[0.0], np.cumsum(0.5 * run.t[1] * (moment[1:] + moment[:-1]))])

    drift, exchanged = momentum - momentum[0], integral(RADIUS * force)
    # What remains is the quadrature: 2e-3 of eight short contacts, 6e-9 of a single long one.
    assert np.max(np.abs(drift - integral(depth * force))) < 5e-3 * np.max(np.abs(drift))
    part, deepest = drift[-1] / exchanged[-1], depth.max() / RADIUS
    assert 0.8 * deepest < part < deepest
    if stiffness != 1e7:
        in_words = [f"{100.0 * value:.{0 if value > 0.01 else 1}f} %" for value in (deepest, part)]
        for text in (LAWS.read_text(encoding="utf-8"), cc.ClearanceRevolute.__doc__):
            assert all(words in text for words in in_words)
