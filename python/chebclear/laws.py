"""Contact laws, friction laws and oil films of clearance joints."""

from .mechanisms import hertz_stiffness
from .scene.scene import (
    ExactRestitution,
    FiniteBearing,
    Flores,
    Hertz,
    HuntCrossley,
    Impact,
    KelvinVoigt,
    LankaraniNikravesh,
    ModifiedCoulomb,
    ShortBearing,
    SmoothedCoulomb,
    StickSlip,
)

__all__ = [
    "ExactRestitution",
    "FiniteBearing",
    "Flores",
    "Hertz",
    "HuntCrossley",
    "Impact",
    "KelvinVoigt",
    "LankaraniNikravesh",
    "ModifiedCoulomb",
    "ShortBearing",
    "SmoothedCoulomb",
    "StickSlip",
    "hertz_stiffness",
]
