"""Dynamics of planar mechanisms with joint clearance and interval parameters.

A `Scene` says what the mechanism is, `simulate` gives its `Trajectory`, and a `Study` gives the `Band` of
every output when parameters are only known to lie in intervals. Units are SI with angles in radians.
"""

from . import mechanisms
from .accuracy import ErrorEstimate
from .errors import ChebclearError, ChebclearWarning, Problem, SceneError, SimulationError
from .mechanisms import hertz_stiffness
from .plot import (
    plot_band,
    plot_orbit,
    plot_sensitivity,
    plot_spectrogram,
    plot_trajectory,
)
from .plot_costs import plot_study_tradeoff, plot_tradeoff
from .quantities import Interval, interval, rpm
from .recommend import Recommendation
from .records import package_version
from .results import BoundErrors, Comparison, StudyResult, compare
from .scene import (
    Body,
    ClearanceRevolute,
    Fixed,
    Flores,
    Gravity,
    Hertz,
    HuntCrossley,
    Inspection,
    LankaraniNikravesh,
    ModifiedCoulomb,
    Prismatic,
    Revolute,
    Scene,
    SmoothedCoulomb,
    Speed,
)
from .simulation import Events, Settings, Stats, Trajectory, simulate
from .study import Study
from .study_tradeoff import StudyTradeoff, StudyTradeoffPoint
from .surrogate import Band, Surrogate
from .tradeoff import tradeoff
from .tradeoff_result import Tradeoff, TradeoffPoint

__version__ = package_version()

__all__ = [
    "Band",
    "Body",
    "BoundErrors",
    "ChebclearError",
    "ChebclearWarning",
    "ClearanceRevolute",
    "Comparison",
    "ErrorEstimate",
    "Events",
    "Fixed",
    "Flores",
    "Gravity",
    "Hertz",
    "HuntCrossley",
    "Inspection",
    "Interval",
    "LankaraniNikravesh",
    "ModifiedCoulomb",
    "Prismatic",
    "Problem",
    "Recommendation",
    "Revolute",
    "Scene",
    "SceneError",
    "Settings",
    "SimulationError",
    "SmoothedCoulomb",
    "Speed",
    "Stats",
    "Study",
    "StudyResult",
    "StudyTradeoff",
    "StudyTradeoffPoint",
    "Surrogate",
    "Tradeoff",
    "TradeoffPoint",
    "Trajectory",
    "__version__",
    "compare",
    "hertz_stiffness",
    "interval",
    "mechanisms",
    "plot_band",
    "plot_orbit",
    "plot_sensitivity",
    "plot_spectrogram",
    "plot_study_tradeoff",
    "plot_tradeoff",
    "plot_trajectory",
    "rpm",
    "simulate",
    "tradeoff",
]
