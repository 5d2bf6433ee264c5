"""The paper's case study in Exudyn, with its own circle-in-circle contact; see README.md.

Exudyn's Hunt-Crossley factor is 3/2 (1 - e'), the paper's 3/4 (1 - e²): the same for e' = 1 - (1 - e²)/2.
Its friction is one coefficient with a linear ramp: only the frictionless scene has the very same equations.
The impact velocity is read at the end of a step, as no contact is located: errors fall with the first power
of the step, and no setting comes near a reference over two revolutions. Crank, rod and slider are one
kinematic tree, without constraints, so that the explicit solvers can be used; a flywheel keeps the speed of
the crank. The settings are the best that were found; with most others it stops at the first impact.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

sys.exudynFast = True  # before the import: the build without range checks, a third faster
import exudyn as exu  # noqa: E402
import exudyn.itemInterface as items  # noqa: E402
import numpy as np  # noqa: E402

SPEED = 2000 * math.pi / 30
FLYWHEEL = 1e4  # moment of inertia that keeps the speed of the crank within 1e-9 [kg m²]
START = 1e-9  # length of the first step [s]


@dataclass
class Run:
    """Slider velocity [m/s] at the instants asked for, and the work."""

    vx: np.ndarray
    steps: int


def simulate(
    convention: str,
    *,
    method: str,
    step: float,
    tolerance: float = 1e-8,
    duration: float,
    samples: int,
    impact_velocity_floor: float,
    times: np.ndarray | None = None,
) -> Run:
    """One run with steps of at most ``step`` [s]; ``tolerance`` is that of DOPRI5.

    Exudyn records at the ends of steps only. With ``times`` every step is recorded and the velocities are
    interpolated there by cubics; without, ``samples`` of position, velocity and acceleration are recorded.
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node, contact = _model(mbs, convention, impact_velocity_floor)
    kinds = exu.OutputVariableType
    sensors = [
        mbs.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
        for kind in (kinds.Coordinates, kinds.Coordinates_t, kinds.Coordinates_tt)
    ]
    mbs.AddSensor(
        items.SensorObject(objectNumber=contact, storeInternal=True, outputVariableType=kinds.Force)
    )
    mbs.Assemble()
    settings = _settings(method, step, tolerance, duration)
    solution = settings.solutionSettings
    solution.writeSolutionToFile = False
    solution.sensorsWritePeriod = duration / (samples - 1) if times is None else 1e-12
    solver = {
        "DOPRI5": exu.DynamicSolverType.DOPRI5,
        "trapezoidal": exu.DynamicSolverType.TrapezoidalIndex2,
        "generalized alpha": exu.DynamicSolverType.GeneralizedAlpha,
    }[method]
    if not mbs.SolveDynamic(settings, solverType=solver, showHints=False):
        raise RuntimeError("SolveDynamic stopped")
    velocity, acceleration = (mbs.GetSensorStoredData(sensor) for sensor in sensors[1:])
    steps = mbs.sys["dynamicSolver"].it.currentStepIndex
    if times is None:
        return Run(velocity[:, 3], steps)
    return Run(_interpolate(times, velocity[:, 0], velocity[:, 3], acceleration[:, 3]), steps)


def _model(mbs: exu.MainSystem, convention: str, impact_velocity_floor: float) -> tuple[int, int]:
    printed = convention == "as_printed"
    crank, rod, rod_mass, slider_mass = 0.05, 0.12, 0.21, 0.14
    journal_radius, clearance, restitution = 9.8e-3, 2e-5, 0.9
    sigma = (1 - 0.3**2) / 207e9 / (math.pi if printed else 1)
    bearing_radius = journal_radius + clearance
    stiffness = 4 / (3 * 2 * sigma) * math.sqrt(journal_radius * bearing_radius / clearance)
    inertia = rod_mass * rod**2 / (3 if printed else 12)
    # As printed the sliding velocity is the relative velocity times 0.01 at most: friction is almost off.
    friction = 0.03 if convention == "corrected" else 0.0
    node = mbs.AddNode(
        items.NodeGenericODE2(
            numberOfODE2Coordinates=3,
            referenceCoordinates=[0.0] * 3,
            initialCoordinates=[0.0, 0.0, 0.0],
            initialCoordinates_t=[SPEED, -SPEED - crank * SPEED / rod, 0.0],
        )
    )
    joints = exu.JointType
    offsets, centers = exu.Vector3DList(), exu.Vector3DList()
    transformations, inertias = exu.Matrix3DList(), exu.Matrix3DList()
    for offset in ([0, 0, 0], [crank, 0, 0], [crank + rod, 0, 0]):
        offsets.Append(offset)
        transformations.Append(np.eye(3))
    for center, about in (([0, 0, 0], FLYWHEEL), ([rod / 2, 0, 0], inertia), ([0, 0, 0], 1e-4)):
        centers.Append(center)
        inertias.Append(np.diag([about, about, about]))
    tree = mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[joints.RevoluteZ, joints.RevoluteZ, joints.PrismaticX],
            linkParents=[-1, 0, -1],
            jointTransformations=transformations,
            jointOffsets=offsets,
            linkInertiasCOM=inertias,
            linkCOMs=centers,
            linkMasses=[0.3, rod_mass, slider_mass],
        )
    )
    slider, bearing = (
        mbs.AddMarker(items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=place))
        for link, place in ((2, [0, 0, 0]), (1, [rod, 0, 0]))
    )
    history = mbs.AddNode(
        items.NodeGenericData(numberOfDataCoordinates=4, initialCoordinates=[clearance, 0.0, 0.0, 0.0])
    )
    contact = mbs.AddObject(
        items.ObjectContactSphereSphere(
            markerNumbers=[slider, bearing],
            nodeNumber=history,
            spheresRadii=[journal_radius, bearing_radius],
            isHollowSphere1=True,
            dynamicFriction=friction,
            frictionProportionalZone=1e-3,
            contactStiffness=stiffness,
            contactStiffnessExponent=1.5,
            restitutionCoefficient=1 - (1 - restitution**2) / 2,
            minimumImpactVelocity=impact_velocity_floor,
            impactModel=1,
        )
    )
    return node, contact


def _settings(method: str, step: float, tolerance: float, duration: float) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = duration
    integration.numberOfSteps = round(duration / step)
    integration.verboseMode = 0
    # The iteration tolerance is a force, K times a gap: the default of 1 stops at the first impact.
    integration.discontinuous.iterationTolerance = 1e4
    integration.discontinuous.maxIterations = 20
    integration.minimumStepSize = 1e-11
    if method == "DOPRI5":
        integration.absoluteTolerance = integration.relativeTolerance = tolerance
        integration.initialStepSize = START
        integration.explicitIntegration.computeEndOfStepAccelerations = True
    else:
        integration.newton.useModifiedNewton = True
        integration.generalizedAlpha.spectralRadius = 0.9
    return settings


def _interpolate(times: np.ndarray, t: np.ndarray, value: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Cubics through values and rates."""
    keep = np.concatenate(([True], np.diff(t) > 0))
    t, value, rate = t[keep], value[keep], rate[keep]
    right = np.clip(np.searchsorted(t, times, side="left"), 1, len(t) - 1)
    left = right - 1
    h = t[right] - t[left]
    s = (times - t[left]) / h
    return (
        (1 + 2 * s) * (1 - s) ** 2 * value[left]
        + s * (1 - s) ** 2 * h * rate[left]
        + s**2 * (3 - 2 * s) * value[right]
        - s**2 * (1 - s) * h * rate[right]
    )
