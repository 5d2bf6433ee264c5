"""How often the values of a parameter occur: as a drawing, a process or a measurement says it."""

from .scene.distributions import (
    capable as capable,
    eccentric as eccentric,
    inspected as inspected,
    lognormal as lognormal,
    normal as normal,
    sampled as sampled,
    skewed as skewed,
    triangular as triangular,
    uniform as uniform,
)

__all__ = sorted(name for name in vars() if not name.startswith("_"))
