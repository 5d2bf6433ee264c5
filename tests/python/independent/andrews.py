"""Andrews' squeezing mechanism: seven bodies, three closed loops, one degree of freedom, driven by a torque.

Data, start values and reference solution at t = 0.03 s as in `[MazziaMagherini2008]` (27 equations of index 3
in the angles β, θ, γ, φ, δ, ω, ε) and `[HairerWanner1996]`, section VII.7. Here the bodies K1 to K7 have
frames whose angles are sums of those; `published_angles` goes back.
"""

import chebclear as cc

DURATION = 0.03  # [s]
TORQUE = 0.033  # on K1 [N m]
SPRING_STIFFNESS = 4530.0  # [N/m], from K3.D to ground.C
SPRING_LENGTH = 0.07785  # unstretched [m]

NAMES = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")
START = dict(
    zip(
        NAMES,
        (
            -0.0617138900142764496358948458001,
            0.0,
            0.455279819163070380255912382449,
            0.222668390165885884674473185609,
            0.487364979543842550225598953530,
            -0.222668390165885884674473185609,
            1.23054744454982119249735015568,
        ),
        strict=True,
    )
)
REFERENCE = dict(
    zip(
        NAMES,
        (
            0.1581077119629904e2,
            -0.1575637105984298e2,
            0.4082224013073101e-1,
            -0.5347301163226948,
            0.5244099658805304,
            0.5347301163226948,
            0.1048080741042263e1,
        ),
        strict=True,
    )
)
"""Angles at the end [rad]."""
REFERENCE_RATES = dict(
    zip(
        NAMES,
        (
            0.1139920302151208e4,
            -0.1424379294994111e4,
            0.1103291221937134e2,
            0.1929337464421385e2,
            0.5735699284790808,
            -0.1929337464421385e2,
            0.3231791658026955,
        ),
        strict=True,
    )
)
"""Their rates [rad/s]."""


def scene(forces=()):
    """The mechanism with the given forces; the spring and the torque on K1 belong to it."""
    start = START
    rr, ra, d, da = 7e-3, 92e-5, 28e-3, 115e-4
    ss, sa, sb, sc, sd = 35e-3, 1874e-5, 1043e-5, 18e-3, 2e-2
    e, ea, zt, ta, tb = 2e-2, 1421e-5, 4e-2, 2308e-5, 916e-5
    zf, fa, u, ua, ub = 2e-2, 1421e-5, 4e-2, 1228e-5, 449e-5
    return cc.Scene(
        ground={"O": (0.0, 0.0), "A": (-0.06934, -0.00227), "B": (-0.03635, 0.03273), "C": (0.014, 0.072)},
        bodies=[
            cc.Body("K1", 0.04325, 2.194e-6, (ra, 0.0), points={"F": (rr, 0.0)}, angle=start["beta"]),
            cc.Body(
                "K2",
                0.00365,
                4.410e-7,
                (-da, 0.0),
                points={"E": (-d, 0.0)},
                angle=start["beta"] + start["theta"],
            ),
            cc.Body(
                "K3",
                0.02373,
                5.255e-6,
                (sb, -sa),
                points={"E": (0.0, -ss), "D": (sd, -sc)},
                angle=start["gamma"],
            ),
            cc.Body(
                "K4",
                0.00706,
                5.667e-7,
                (0.0, ea - e),
                points={"E": (0.0, -e)},
                angle=start["phi"] + start["delta"],
            ),
            cc.Body("K5", 0.07050, 1.169e-5, (ta, -tb), points={"G": (zt, 0.0)}, angle=start["delta"]),
            cc.Body(
                "K6",
                0.00706,
                5.667e-7,
                (zf - fa, 0.0),
                points={"E": (zf, 0.0)},
                angle=start["omega"] + start["epsilon"],
            ),
            cc.Body("K7", 0.05498, 1.912e-5, (ub, -ua), points={"H": (0.0, -u)}, angle=start["epsilon"]),
        ],
        joints=[
            cc.Revolute("crank", "ground.O", "K1"),
            cc.Revolute("F", "K1.F", "K2"),
            cc.Revolute("B", "ground.B", "K3"),
            cc.Revolute("A5", "ground.A", "K5"),
            cc.Revolute("A7", "ground.A", "K7"),
            cc.Revolute("G", "K5.G", "K4"),
            cc.Revolute("H", "K7.H", "K6"),
            cc.Revolute("E3", "K2.E", "K3.E"),
            cc.Revolute("E4", "K2.E", "K4.E"),
            cc.Revolute("E6", "K2.E", "K6.E"),
        ],
        forces=forces,
    )


def published_angles(run, suffix="angle"):
    """The last sample in the angles of the publications; ``"angular_velocity"`` gives their rates."""
    k1, k2, k3, k4, k5, k6, k7 = (run[f"K{body}.{suffix}"][-1] for body in range(1, 8))
    return dict(zip(NAMES, (k1, k2 - k1, k3, k4 - k5, k5, k6 - k7, k7), strict=True))
