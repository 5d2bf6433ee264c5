"""Contact and friction laws of clearance joints."""

from .mechanisms import hertz_stiffness
from .scene.scene import (
    ExactRestitution,
    Flores,
    Hertz,
    HuntCrossley,
    Impact,
    KelvinVoigt,
    LankaraniNikravesh,
    ModifiedCoulomb,
    SmoothedCoulomb,
    StickSlip,
)

__all__ = [
    "ExactRestitution",
    "Flores",
    "Hertz",
    "HuntCrossley",
    "Impact",
    "KelvinVoigt",
    "LankaraniNikravesh",
    "ModifiedCoulomb",
    "SmoothedCoulomb",
    "StickSlip",
    "hertz_stiffness",
]
