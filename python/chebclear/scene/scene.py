"""The scene: bodies, joints, forces, drives and couplings as the user writes them.

Everything here is an immutable record of names and numbers: scenes can be compared, hashed, copied, pickled
and written to JSON and back without losing a bit. The core checks the content of a scene when it is checked
or simulated; all problems are then reported at once, with their paths.

Units are SI with angles in radians. Positions are in the frame of the body they belong to. A point of a body
is written ``"body.point"``; ``"body"`` alone is the origin of its frame and ``"body.center_of_mass"`` always
exists, as does the fixed body ``"ground"``.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, get_args

from ..base.arguments import Checks
from ..base.quantities import Interval as Interval, rpm as rpm
from ..base.units import unit
from ..errors import ArgumentError, Problem, SceneError
from ..notices import Notice
from ..report import html
from ..report.document import Listing
from .description import describe_scene, summarize_scene
from .motions import Coupling, Speed
from .parts import AnyForce, Body, Drive, Inspection, Joint, Start
from .schema import Part, Points, Vector, at_or_below, read, write

if TYPE_CHECKING:
    from .. import _core


@dataclass(frozen=True, repr=False)
class Scene(Part):
    """A mechanism as the user describes it.

    Parameters
    ----------
    bodies : sequence of Body
        The moving bodies.
    joints : sequence of Revolute, Prismatic, Fixed, ClearanceRevolute, ClearancePrismatic, PinInSlot or Stop
        The joints.
    forces : sequence of Gravity, Spring, Damper, Bushing, TorsionSpring, TorsionDamper, Force or Torque
        The forces.
    drives : sequence of Speed or Motion
        The prescribed motions.
    ground : mapping of str to (float, float)
        Named points of the fixed body ``"ground"`` [m].
    start : sequence of JointStart, BodyStart, ClearanceStart or GuideStart
        Initial conditions that do not follow from the joints, the drives and the initial guesses of the
        angles of the bodies.
    couplings : sequence of Coupling
        Coordinates that follow others: gears, racks, belts, cams.

    Examples
    --------
    A pendulum:

    >>> import chebclear as cc
    >>> bob = cc.Body("bob", mass=1.0, inertia=0.01, points={"pivot": (0.0, 0.5)}, angle=0.3)
    >>> pin = cc.Revolute("pin", "ground.pivot", "bob.pivot")
    >>> scene = cc.Scene([bob], [pin], [cc.Gravity((0.0, -9.81))], ground={"pivot": (0.0, 0.0)})
    >>> cc.Scene.from_json(scene.to_json()) == scene
    True
    """

    _choices: ClassVar = {
        "bodies": (Body,),
        "joints": get_args(Joint),
        "forces": get_args(AnyForce),
        "drives": get_args(Drive),
        "start": get_args(Start),
        "couplings": (Coupling,),
    }

    bodies: Sequence[Body]
    joints: Sequence[Joint]
    forces: Sequence[AnyForce] = ()
    drives: Sequence[Drive] = ()
    ground: Mapping[str, Vector] = field(default_factory=lambda: Points({}), metadata=unit("m"))
    start: Sequence[Start] = ()
    couplings: Sequence[Coupling] = ()

    def _repr_html_(self) -> str:
        # Pictures stand above scenes: only a notebook asks from here for one.
        from ..plots.drawing.scene import mechanism_picture

        words = Listing("scene", self.describe(), repr(self)[1:-1])
        try:
            self.check()
        except SceneError:  # described with its problems
            return html.fragment("", [words])
        return html.fragment("", [mechanism_picture(self), words])

    def __repr__(self) -> str:
        return summarize_scene(self)

    def to_json(self, indent: int | None = None) -> str:
        """The scene as JSON text; `from_json` reads the same scene back, bit for bit.

        JSON has no numbers that are not finite: they are written as ``"NaN"``, ``"Infinity"`` and
        ``"-Infinity"``.

        Parameters
        ----------
        indent : int, optional
            Spaces to indent by [-]; one line if not given.

        Raises
        ------
        SceneError
            If a field has the wrong type; all problems of the scene are then reported together.
        """
        if indent is None:
            return self._line
        checks = Checks()
        spaces = checks.whole("indent", indent, least=0, most=80)
        checks.finish()
        return json.dumps(json.loads(self._line), indent=spaces)

    def __getstate__(self) -> dict[str, Any]:
        # Cached values are no part of the scene: its pickle must not depend on whether it was simulated.
        return {item.name: getattr(self, item.name) for item in dataclasses.fields(self)}

    @functools.cached_property
    def _line(self) -> str:
        # Cached: a scene is immutable, and compiling, comparing and storing it need the text.
        problems: list[Problem] = []
        text = json.dumps(write(self, (Scene,), "", problems), allow_nan=False)
        if problems:
            raise SceneError(problems + _further_problems(text, problems))
        return text

    @classmethod
    def from_json(cls, text: str) -> Scene:
        """Read a scene that `to_json` wrote.

        Parameters
        ----------
        text : str
            JSON text.

        Raises
        ------
        SceneError
            If the text is not valid JSON, or has unknown or missing fields.
        """
        problems: list[Problem] = []
        try:
            plain = json.loads(text)
            scene = read(plain, (Scene,), "", problems)
        except ValueError as error:
            raise SceneError([("scene", f"is not valid JSON: {error}")]) from None
        except RecursionError:
            raise SceneError([("scene", "is not a scene: it is nested too deeply")]) from None
        if problems:
            raise SceneError(problems)
        assert isinstance(scene, Scene)
        return scene

    @property
    def period(self) -> float:
        """Time of one revolution of the drive at constant speed [s], the slowest one if there are several.

        Raises
        ------
        ValueError
            If nothing is driven at constant speed.
        """
        if period := revolution_time(self):
            return period
        raise ArgumentError(
            "no drive of the scene turns at constant speed: it has no period; give times in seconds"
        )

    def check(self) -> Inspection:
        """Check the scene and assemble its mechanism, without simulating it.

        Returns
        -------
        Inspection
            Degrees of freedom and the names of all outputs.

        Raises
        ------
        SceneError
            With every problem that was found.
        """
        return self._inspection

    @functools.cached_property
    def _mechanism(self) -> _core.Mechanism:
        from .. import _core  # here only: writing down a scene needs no core

        return _core.Mechanism(self.to_json())

    @functools.cached_property
    def _inspection(self) -> Inspection:
        facts = json.loads(self._mechanism.facts())
        fields: dict[str, Any] = {
            name: tuple(fact) if isinstance(fact, list) else fact for name, fact in facts.items()
        }
        fields["poses"] = tuple((x, y, angle) for x, y, angle in facts["poses"])
        fields["notices"] = Notice.of_core(facts["notices"])
        return Inspection(**fields)

    def describe(self) -> str:
        """The scene in words: its parts with units, its degrees of freedom, and the cut joints with the
        reason.

        Returns
        -------
        str
            Text to print. A scene that cannot be simulated is described as well, with all its problems.
        """
        return describe_scene(self)


def revolution_time(scene: Scene) -> float:
    """Time of a revolution of the slowest drive at constant speed [s]; 0 if there is none."""
    speeds = [abs(drive.speed) for drive in scene.drives if isinstance(drive, Speed) and drive.speed]
    return 2.0 * math.pi / min(speeds) if speeds else 0.0


def compiled(scene: Scene) -> _core.Mechanism:
    """The compiled mechanism of a scene; it is compiled once."""
    return scene._mechanism


def _further_problems(text: str, known: Sequence[Problem]) -> list[Problem]:
    """Further problems of a scene whose fields of wrong type were replaced by placeholders."""
    from .. import _core

    try:
        _core.Mechanism(text)
    except SceneError as error:
        return [problem for problem in error.problems if not any(_within(problem, found) for found in known)]
    return []


def _within(problem: Problem, known: Problem) -> bool:
    """Whether a problem follows from a known one."""
    if at_or_below(problem.path, known.path):
        return True
    # The points of a table are checked together, with the path of its points.
    table = re.fullmatch(r"(.*)\.(points|values)(\[\d+\])?", known.path)
    return table is not None and problem.path == f"{table[1]}.points"
