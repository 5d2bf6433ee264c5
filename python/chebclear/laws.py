"""Contact and friction laws of clearance joints."""

from .mechanisms import hertz_stiffness
from .scene.scene import Flores, Hertz, HuntCrossley, LankaraniNikravesh, ModifiedCoulomb, SmoothedCoulomb

__all__ = [
    "Flores",
    "Hertz",
    "HuntCrossley",
    "LankaraniNikravesh",
    "ModifiedCoulomb",
    "SmoothedCoulomb",
    "hertz_stiffness",
]
