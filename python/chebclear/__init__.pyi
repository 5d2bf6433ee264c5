from . import mechanisms as mechanisms
from .base.quantities import (
    Interval as Interval,
    interval as interval,
    rpm as rpm,
)
from .errors import (
    ArgumentError as ArgumentError,
    ChebclearError as ChebclearError,
    ChebclearWarning as ChebclearWarning,
    HorizonWarning as HorizonWarning,
    InputError as InputError,
    MemoryLimitError as MemoryLimitError,
    MissingProgramError as MissingProgramError,
    Problem as Problem,
    SceneError as SceneError,
    SettingsError as SettingsError,
    SimulationError as SimulationError,
    StartError as StartError,
    StoreError as StoreError,
)
from .execution.failures import FailedRun as FailedRun
from .execution.plan import Plan as Plan
from .loading import load_result as load_result
from .mechanisms import hertz_stiffness as hertz_stiffness
from .plots.public import (
    Animation as Animation,
    animate as animate,
    plot_band as plot_band,
    plot_bifurcation as plot_bifurcation,
    plot_coefficients as plot_coefficients,
    plot_contacts as plot_contacts,
    plot_orbit as plot_orbit,
    plot_poincare as plot_poincare,
    plot_prediction as plot_prediction,
    plot_ranking as plot_ranking,
    plot_scene as plot_scene,
    plot_sensitivity as plot_sensitivity,
    plot_shares as plot_shares,
    plot_spectrogram as plot_spectrogram,
    plot_study_tradeoff as plot_study_tradeoff,
    plot_tornado as plot_tornado,
    plot_tradeoff as plot_tradeoff,
    plot_trajectory as plot_trajectory,
    print_style as print_style,
)
from .run.accuracy import ErrorEstimate as ErrorEstimate
from .run.contacts import (
    Contact as Contact,
    Contacts as Contacts,
    Event as Event,
    Events as Events,
)
from .run.features import (
    Extremum as Extremum,
    Feature as Feature,
    contact_share as contact_share,
    impacts as impacts,
    impulse as impulse,
    loss as loss,
    lowest as lowest,
    mean as mean,
    peak as peak,
    peak_to_peak as peak_to_peak,
    rms as rms,
    time_of_lowest as time_of_lowest,
    time_of_peak as time_of_peak,
    wear as wear,
)
from .run.settings import Settings as Settings
from .run.simulation import simulate as simulate
from .run.trajectory import (
    EndState as EndState,
    Stats as Stats,
    Trajectory as Trajectory,
)
from .scene.scene import (
    Body as Body,
    BodyStart as BodyStart,
    ClearanceRevolute as ClearanceRevolute,
    ClearanceStart as ClearanceStart,
    Damper as Damper,
    Fixed as Fixed,
    Flores as Flores,
    Force as Force,
    Gravity as Gravity,
    Harmonic as Harmonic,
    Hertz as Hertz,
    HuntCrossley as HuntCrossley,
    Inspection as Inspection,
    JointStart as JointStart,
    LankaraniNikravesh as LankaraniNikravesh,
    ModifiedCoulomb as ModifiedCoulomb,
    Motion as Motion,
    Polynomial as Polynomial,
    Prismatic as Prismatic,
    Revolute as Revolute,
    Scene as Scene,
    SmoothedCoulomb as SmoothedCoulomb,
    Speed as Speed,
    Spring as Spring,
    Table as Table,
    Torque as Torque,
    TorsionDamper as TorsionDamper,
    TorsionSpring as TorsionSpring,
)
from .study.band.band import Band as Band
from .study.band.hybrid import (
    Normal as Normal,
    QuantileBand as QuantileBand,
    Uniform as Uniform,
    normal as normal,
    uniform as uniform,
)
from .study.band.margin import Margin as Margin
from .study.band.zones import (
    RestraintZones as RestraintZones,
    restraint_zones as restraint_zones,
)
from .study.bifurcation import (
    Bifurcation as Bifurcation,
    bifurcation as bifurcation,
)
from .study.comparison import (
    BoundErrors as BoundErrors,
    Comparison as Comparison,
    compare as compare,
)
from .study.features.effects import (
    Effects as Effects,
    Estimate as Estimate,
    Swing as Swing,
)
from .study.features.features import (
    FeatureResult as FeatureResult,
    FeatureTable as FeatureTable,
)
from .study.features.ranking import (
    Rank as Rank,
    Ranking as Ranking,
)
from .study.features.reach import FeatureInterval as FeatureInterval
from .study.polynomials.sensitivity import VarianceShares as VarianceShares
from .study.polynomials.surrogate import (
    PolynomialRange as PolynomialRange,
    Surrogate as Surrogate,
)
from .study.results import StudyResult as StudyResult
from .study.study import Study as Study
from .templates.reader import (
    load as load,
    loads as loads,
)
from .templates.template import (
    Parameter as Parameter,
    Template as Template,
)
from .tradeoffs.bounds import (
    StudyTradeoff as StudyTradeoff,
    StudyTradeoffPoint as StudyTradeoffPoint,
)
from .tradeoffs.of_scene import tradeoff as tradeoff
from .tradeoffs.of_study import study_tradeoff as study_tradeoff
from .tradeoffs.point import TradeoffPoint as TradeoffPoint
from .tradeoffs.recommendation import Recommendation as Recommendation
from .tradeoffs.result import Tradeoff as Tradeoff
from .version import __version__ as __version__
