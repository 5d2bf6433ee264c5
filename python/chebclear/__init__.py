"""Dynamics of planar mechanisms with joint clearance and interval parameters.

A `Scene` says what the mechanism is, `simulate` gives its `Trajectory`, and a `Study` gives the `Band` of
every output when parameters are only known to lie in intervals. Units are SI with angles in radians.
"""

from __future__ import annotations

from importlib import import_module

# As checkers of types know it: the module that has it takes longer to import than all else here.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from . import mechanisms
    from .base.quantities import Interval, interval, rpm
    from .errors import (
        ArgumentError,
        ChebclearError,
        ChebclearWarning,
        HorizonWarning,
        InputError,
        MemoryLimitError,
        MissingProgramError,
        Problem,
        SceneError,
        SettingsError,
        SimulationError,
        StartError,
        StoreError,
    )
    from .execution.failures import FailedRun
    from .execution.plan import Plan
    from .loading import load_result
    from .mechanisms import hertz_stiffness
    from .plots.public import (
        Animation,
        animate,
        plot_band,
        plot_bifurcation,
        plot_coefficients,
        plot_contacts,
        plot_orbit,
        plot_poincare,
        plot_prediction,
        plot_ranking,
        plot_scene,
        plot_sensitivity,
        plot_shares,
        plot_spectrogram,
        plot_study_tradeoff,
        plot_tornado,
        plot_tradeoff,
        plot_trajectory,
        print_style,
    )
    from .run.accuracy import ErrorEstimate
    from .run.contacts import Contact, Contacts, Event, Events
    from .run.features import (
        Extremum,
        Feature,
        contact_share,
        impacts,
        impulse,
        loss,
        lowest,
        mean,
        peak,
        peak_to_peak,
        rms,
        time_of_lowest,
        time_of_peak,
        wear,
    )
    from .run.settings import Settings
    from .run.simulation import simulate
    from .run.trajectory import EndState, Stats, Trajectory
    from .scene.scene import (
        Body,
        BodyStart,
        ClearanceRevolute,
        ClearanceStart,
        Damper,
        Fixed,
        Flores,
        Force,
        Gravity,
        Harmonic,
        Hertz,
        HuntCrossley,
        Inspection,
        JointStart,
        LankaraniNikravesh,
        ModifiedCoulomb,
        Motion,
        Polynomial,
        Prismatic,
        Revolute,
        Scene,
        SmoothedCoulomb,
        Speed,
        Spring,
        Table,
        Torque,
        TorsionDamper,
        TorsionSpring,
    )
    from .study.band.band import Band
    from .study.band.hybrid import Normal, QuantileBand, Uniform, normal, uniform
    from .study.band.margin import Margin
    from .study.band.zones import RestraintZones, restraint_zones
    from .study.bifurcation import Bifurcation, bifurcation
    from .study.comparison import BoundErrors, Comparison, compare
    from .study.costs import StudyTradeoff, StudyTradeoffPoint
    from .study.features.effects import Effects, Estimate, Swing
    from .study.features.features import FeatureResult, FeatureTable
    from .study.features.ranking import Rank, Ranking
    from .study.features.reach import FeatureInterval
    from .study.polynomials.sensitivity import VarianceShares
    from .study.polynomials.surrogate import PolynomialRange, Surrogate
    from .study.results import StudyResult
    from .study.study import Study
    from .templates.reader import load, loads
    from .templates.template import Parameter, Template
    from .tradeoffs.of_scene import tradeoff
    from .tradeoffs.point import TradeoffPoint
    from .tradeoffs.recommendation import Recommendation
    from .tradeoffs.result import Tradeoff

    __version__: str

__all__ = [
    "Animation",
    "ArgumentError",
    "Band",
    "Bifurcation",
    "Body",
    "BodyStart",
    "BoundErrors",
    "ChebclearError",
    "ChebclearWarning",
    "ClearanceRevolute",
    "ClearanceStart",
    "Comparison",
    "Contact",
    "Contacts",
    "Damper",
    "Effects",
    "EndState",
    "ErrorEstimate",
    "Estimate",
    "Event",
    "Events",
    "Extremum",
    "FailedRun",
    "Feature",
    "FeatureInterval",
    "FeatureResult",
    "FeatureTable",
    "Fixed",
    "Flores",
    "Force",
    "Gravity",
    "Harmonic",
    "Hertz",
    "HorizonWarning",
    "HuntCrossley",
    "InputError",
    "Inspection",
    "Interval",
    "JointStart",
    "LankaraniNikravesh",
    "Margin",
    "MemoryLimitError",
    "MissingProgramError",
    "ModifiedCoulomb",
    "Motion",
    "Normal",
    "Parameter",
    "Plan",
    "Polynomial",
    "PolynomialRange",
    "Prismatic",
    "Problem",
    "QuantileBand",
    "Rank",
    "Ranking",
    "Recommendation",
    "RestraintZones",
    "Revolute",
    "Scene",
    "SceneError",
    "Settings",
    "SettingsError",
    "SimulationError",
    "SmoothedCoulomb",
    "Speed",
    "Spring",
    "StartError",
    "Stats",
    "StoreError",
    "Study",
    "StudyResult",
    "StudyTradeoff",
    "StudyTradeoffPoint",
    "Surrogate",
    "Swing",
    "Table",
    "Template",
    "Torque",
    "TorsionDamper",
    "TorsionSpring",
    "Tradeoff",
    "TradeoffPoint",
    "Trajectory",
    "Uniform",
    "VarianceShares",
    "__version__",
    "animate",
    "bifurcation",
    "compare",
    "contact_share",
    "hertz_stiffness",
    "impacts",
    "impulse",
    "interval",
    "load",
    "load_result",
    "loads",
    "loss",
    "lowest",
    "mean",
    "mechanisms",
    "normal",
    "peak",
    "peak_to_peak",
    "plot_band",
    "plot_bifurcation",
    "plot_coefficients",
    "plot_contacts",
    "plot_orbit",
    "plot_poincare",
    "plot_prediction",
    "plot_ranking",
    "plot_scene",
    "plot_sensitivity",
    "plot_shares",
    "plot_spectrogram",
    "plot_study_tradeoff",
    "plot_tornado",
    "plot_tradeoff",
    "plot_trajectory",
    "print_style",
    "restraint_zones",
    "rms",
    "rpm",
    "simulate",
    "time_of_lowest",
    "time_of_peak",
    "tradeoff",
    "uniform",
    "wear",
]

# Where public names come from. Each is imported when it is asked for: all of them take half a second, and the
# command line answers Ctrl-C earlier than that.
_LATE = {
    "base.quantities": ["Interval", "interval", "rpm"],
    "errors": [
        "ArgumentError",
        "ChebclearError",
        "ChebclearWarning",
        "HorizonWarning",
        "InputError",
        "MemoryLimitError",
        "MissingProgramError",
        "Problem",
        "SceneError",
        "SettingsError",
        "SimulationError",
        "StartError",
        "StoreError",
    ],
    "mechanisms": ["hertz_stiffness"],
    "run.accuracy": ["ErrorEstimate"],
    "run.contacts": ["Contact", "Contacts", "Event", "Events"],
    "run.features": [
        "Extremum",
        "Feature",
        "contact_share",
        "impacts",
        "impulse",
        "loss",
        "lowest",
        "mean",
        "peak",
        "peak_to_peak",
        "rms",
        "time_of_lowest",
        "time_of_peak",
        "wear",
    ],
    "run.settings": ["Settings"],
    "run.simulation": ["simulate"],
    "run.trajectory": ["EndState", "Stats", "Trajectory"],
    "scene.scene": [
        "Body",
        "BodyStart",
        "ClearanceRevolute",
        "ClearanceStart",
        "Damper",
        "Fixed",
        "Flores",
        "Force",
        "Gravity",
        "Harmonic",
        "Hertz",
        "HuntCrossley",
        "Inspection",
        "JointStart",
        "LankaraniNikravesh",
        "ModifiedCoulomb",
        "Motion",
        "Polynomial",
        "Prismatic",
        "Revolute",
        "Scene",
        "SmoothedCoulomb",
        "Speed",
        "Spring",
        "Table",
        "Torque",
        "TorsionDamper",
        "TorsionSpring",
    ],
    "execution.failures": ["FailedRun"],
    "execution.plan": ["Plan"],
    "loading": ["load_result"],
    "study.band.band": ["Band"],
    "study.band.margin": ["Margin"],
    "study.band.hybrid": ["Normal", "QuantileBand", "Uniform", "normal", "uniform"],
    "study.band.zones": ["RestraintZones", "restraint_zones"],
    "study.bifurcation": ["Bifurcation", "bifurcation"],
    "study.comparison": ["BoundErrors", "Comparison", "compare"],
    "study.costs": ["StudyTradeoff", "StudyTradeoffPoint"],
    "study.features.effects": ["Effects", "Estimate", "Swing"],
    "study.features.features": ["FeatureResult", "FeatureTable"],
    "study.features.ranking": ["Rank", "Ranking"],
    "study.features.reach": ["FeatureInterval"],
    "study.polynomials.sensitivity": ["VarianceShares"],
    "study.polynomials.surrogate": ["PolynomialRange", "Surrogate"],
    "study.results": ["StudyResult"],
    "study.study": ["Study"],
    "templates.reader": ["load", "loads"],
    "templates.template": ["Parameter", "Template"],
    "tradeoffs.of_scene": ["tradeoff"],
    "tradeoffs.point": ["TradeoffPoint"],
    "tradeoffs.recommendation": ["Recommendation"],
    "tradeoffs.result": ["Tradeoff"],
    "plots.public": [
        "Animation",
        "animate",
        "print_style",
        *(name for name in __all__ if name.startswith("plot_")),
    ],
}
_ROOMS = {name: room for room, names in _LATE.items() for name in names}


def __dir__() -> list[str]:
    # The rooms of the package are reachable, but only public names are listed.
    return [*__all__, "__doc__", "__file__", "__name__", "__path__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module(".base.files", __name__).package_version()
    if name == "mechanisms":
        return import_module(".mechanisms", __name__)
    if name in _ROOMS:
        # Kept, so that the next time costs nothing.
        found = globals()[name] = getattr(import_module(f".{_ROOMS[name]}", __name__), name)
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
