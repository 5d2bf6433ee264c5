"""Types of the results, which functions and methods return."""

from .decisions.allocation import Allocation, Tolerance
from .decisions.contrast import Contrast, Difference, ShareDifference
from .decisions.identification import Identification
from .decisions.lost_motion import LostMotion
from .decisions.measured import Agreement, Measured
from .decisions.modes import Modes
from .decisions.rare import RareShare
from .execution.failures import FailedRun
from .execution.plan import Plan
from .run.accuracy import ErrorEstimate
from .run.contacts import Contact, Contacts, Event, Events
from .run.notices import Notice
from .run.signals.cycles import Cycles
from .run.signals.spectrum import Spectrum
from .run.trajectory import EndState, Stats
from .scene.distributions import Lognormal, Normal, Triangular, Uniform
from .scene.scene import Inspection
from .study.band.band import Band
from .study.band.hybrid import QuantileBand
from .study.band.margin import Margin
from .study.band.zones import RestraintZones
from .study.bifurcation import Bifurcation
from .study.comparison import BoundErrors, Comparison
from .study.features.effects import Effects, Estimate, Swing
from .study.features.features import FeatureResult, FeatureTable
from .study.features.ranking import Rank, Ranking
from .study.features.reach import FeatureInterval
from .study.function import StudyFunction
from .study.polynomials.sensitivity import VarianceShares
from .study.polynomials.surrogate import PolynomialRange, Surrogate
from .study.requirements.conformance import Conformance, Share
from .study.requirements.specification import Specification
from .study.results import StudyResult
from .study.sweep import LiftOff, Resonance, Sweep
from .templates.template import Parameter, Template
from .tradeoffs.bounds import StudyTradeoff, StudyTradeoffPoint
from .tradeoffs.point import TradeoffPoint
from .tradeoffs.recommendation import Recommendation
from .tradeoffs.result import Tradeoff

__all__ = [
    "Agreement",
    "Allocation",
    "Band",
    "Bifurcation",
    "BoundErrors",
    "Comparison",
    "Conformance",
    "Contact",
    "Contacts",
    "Contrast",
    "Cycles",
    "Difference",
    "Effects",
    "EndState",
    "ErrorEstimate",
    "Estimate",
    "Event",
    "Events",
    "FailedRun",
    "FeatureInterval",
    "FeatureResult",
    "FeatureTable",
    "Identification",
    "Inspection",
    "LiftOff",
    "Lognormal",
    "LostMotion",
    "Margin",
    "Measured",
    "Modes",
    "Normal",
    "Notice",
    "Parameter",
    "Plan",
    "PolynomialRange",
    "QuantileBand",
    "Rank",
    "Ranking",
    "RareShare",
    "Recommendation",
    "Resonance",
    "RestraintZones",
    "Share",
    "ShareDifference",
    "Specification",
    "Spectrum",
    "Stats",
    "StudyFunction",
    "StudyResult",
    "StudyTradeoff",
    "StudyTradeoffPoint",
    "Surrogate",
    "Sweep",
    "Swing",
    "Template",
    "Tolerance",
    "Tradeoff",
    "TradeoffPoint",
    "Triangular",
    "Uniform",
    "VarianceShares",
]
