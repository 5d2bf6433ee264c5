from . import (
    distributions as distributions,
    errors as errors,
    features as features,
    laws as laws,
    mechanisms as mechanisms,
    motions as motions,
    plots as plots,
    results as results,
)
from .base.quantities import (
    Interval as Interval,
    rpm as rpm,
)
from .decisions.allocation import allocate as allocate
from .decisions.centering import center as center
from .decisions.contrast import contrast as contrast
from .decisions.identification import identify as identify
from .decisions.lost_motion import lost_motion as lost_motion
from .decisions.measured import load_measured as load_measured
from .decisions.modes import modes as modes
from .decisions.rare import rare_share as rare_share
from .decisions.stack_up import stack_up as stack_up
from .errors import (
    ChebclearError as ChebclearError,
    ChebclearWarning as ChebclearWarning,
)
from .linkages.reading import read_linkage as read_linkage
from .loading import load_result as load_result
from .plots.animation.animate import animate as animate
from .run.settings import Settings as Settings
from .run.simulation import simulate as simulate
from .run.trajectory import Trajectory as Trajectory
from .scene.distributions import (
    lognormal as lognormal,
    normal as normal,
    triangular as triangular,
    uniform as uniform,
)
from .scene.forces import (
    Bushing as Bushing,
    Damper as Damper,
    Force as Force,
    Gravity as Gravity,
    Spring as Spring,
    Torque as Torque,
    TorsionDamper as TorsionDamper,
    TorsionSpring as TorsionSpring,
)
from .scene.motions import (
    BodyStart as BodyStart,
    ClearanceStart as ClearanceStart,
    GuideStart as GuideStart,
    JointStart as JointStart,
)
from .scene.parts import (
    Body as Body,
    ClearancePrismatic as ClearancePrismatic,
    ClearanceRevolute as ClearanceRevolute,
    Fixed as Fixed,
    PinInSlot as PinInSlot,
    Prismatic as Prismatic,
    Revolute as Revolute,
    Stop as Stop,
)
from .scene.scene import Scene as Scene
from .study.band.zones import restraint_zones as restraint_zones
from .study.bifurcation import bifurcation as bifurcation
from .study.comparison import compare as compare
from .study.conforming import conformance as conformance
from .study.requirements.specification import require as require
from .study.study import Study as Study
from .templates.reader import (
    load as load,
    loads as loads,
)
from .tradeoffs.of_scene import tradeoff as tradeoff
from .tradeoffs.of_study import study_tradeoff as study_tradeoff
from .version import __version__ as __version__
