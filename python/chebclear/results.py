"""Types of the results, which functions and methods return."""

from .decisions.allocation import Allocation as Allocation, Tolerance as Tolerance
from .decisions.centering import (
    CenteredShare as CenteredShare,
    Centering as Centering,
    Move as Move,
)
from .decisions.contrast import (
    Contrast as Contrast,
    Difference as Difference,
    ShareDifference as ShareDifference,
)
from .decisions.identification import Identification as Identification
from .decisions.lost_motion import LostMotion as LostMotion
from .decisions.measured import Agreement as Agreement, Measured as Measured
from .decisions.modes import Modes as Modes
from .decisions.near_limits import NearLimits as NearLimits
from .decisions.rare_result import (
    Cause as Cause,
    RareShare as RareShare,
    SplittingSystem as SplittingSystem,
    SplittingSystems as SplittingSystems,
)
from .decisions.stack_up_result import (
    Contribution as Contribution,
    StackUp as StackUp,
    StackUpValue as StackUpValue,
)
from .decisions.wear import WearLife as WearLife
from .execution.costs import Plan as Plan
from .execution.failures import FailedRun as FailedRun
from .notices import Notice as Notice
from .run.accuracy import ErrorEstimate as ErrorEstimate
from .run.contacts import Contact as Contact, Contacts as Contacts, Event as Event, Events as Events
from .run.signals import Cycles as Cycles, Spectrum as Spectrum
from .run.trajectory import EndState as EndState, Stats as Stats
from .scene.distributions import (
    Capable as Capable,
    Eccentric as Eccentric,
    Inspected as Inspected,
    Lognormal as Lognormal,
    Normal as Normal,
    Sampled as Sampled,
    Skewed as Skewed,
    Triangular as Triangular,
    Uniform as Uniform,
)
from .scene.parts import Inspection as Inspection
from .study.band.band import Band as Band
from .study.band.hybrid import QuantileBand as QuantileBand
from .study.band.margin import Margin as Margin
from .study.band.zones import RestraintZones as RestraintZones
from .study.bifurcation import Bifurcation as Bifurcation
from .study.comparison import BoundErrors as BoundErrors, Comparison as Comparison
from .study.features.effects import Effects as Effects, Estimate as Estimate, Swing as Swing
from .study.features.features import FeatureResult as FeatureResult, FeatureTable as FeatureTable
from .study.features.ranking import Rank as Rank, Ranking as Ranking
from .study.features.reach import FeatureInterval as FeatureInterval
from .study.function import StudyFunction as StudyFunction
from .study.polynomials.sensitivity import VarianceShares as VarianceShares
from .study.polynomials.surrogate import PolynomialRange as PolynomialRange, Surrogate as Surrogate
from .study.requirements.conformance import Conformance as Conformance, Share as Share
from .study.requirements.specification import Specification as Specification
from .study.results import StudyResult as StudyResult
from .study.runs import Runs as Runs
from .study.sweep import LiftOff as LiftOff, Resonance as Resonance, Sweep as Sweep
from .templates.template import Parameter as Parameter, Template as Template
from .tradeoffs.bounds import StudyTradeoff as StudyTradeoff, StudyTradeoffPoint as StudyTradeoffPoint
from .tradeoffs.recommendation import Recommendation as Recommendation, TradeoffPoint as TradeoffPoint
from .tradeoffs.result import Tradeoff as Tradeoff

__all__ = sorted(name for name in vars() if not name.startswith("_"))
