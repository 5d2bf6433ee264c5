"""Contact laws, friction laws and oil films of clearance joints, and wear."""

from .decisions.wear import Archard as Archard, wear_life as wear_life
from .mechanisms import hertz_stiffness as hertz_stiffness
from .scene.laws import (
    ContactFormula as ContactFormula,
    ExactRestitution as ExactRestitution,
    FiniteBearing as FiniteBearing,
    Flores as Flores,
    FrictionFormula as FrictionFormula,
    GuideFriction as GuideFriction,
    Hertz as Hertz,
    HuntCrossley as HuntCrossley,
    Impact as Impact,
    JournalFriction as JournalFriction,
    KelvinVoigt as KelvinVoigt,
    LankaraniNikravesh as LankaraniNikravesh,
    ModifiedCoulomb as ModifiedCoulomb,
    ShortBearing as ShortBearing,
    SmoothedCoulomb as SmoothedCoulomb,
    StickSlip as StickSlip,
)

__all__ = sorted(name for name in vars() if not name.startswith("_"))
