"""Bars, pins and slots of another program, and the scene file that they make."""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..base.units import unit
from ..errors import Problem, SceneError
from ..templates.reader import FORMAT, loads
from ..templates.template import Template
from ..templates.toml_text import write_toml

STEEL = 7850.0
"""Density of what has no mass of its own [kg/m³]."""


@dataclass
class Link:
    """A rigid body between pins; its frame has the first pin as origin and the second on the x axis.

    Points of the plane are complex numbers, in the unit of length of the source until `template` scales them.
    """

    name: str
    points: dict[str, complex]
    """The pins in the frame of the link."""
    angle: float = field(default=0.0, metadata=unit("rad"))
    """Angle of the frame at the start [rad]; a guess unless the link is driven."""
    mass: float = field(default=0.0, metadata=unit("kg"))
    """Mass [kg]; 0 if the source has none."""
    inertia: float = field(default=0.0, metadata=unit("kg m²"))
    """Moment of inertia about the center of mass [kg m²]; 0 if the source has none."""
    center: complex | None = None
    """Center of mass in the frame of the link."""

    @classmethod
    def through(cls, name: str, places: Mapping[str, complex], **more: Any) -> Link:
        """The link whose pins are at these places of the plane at the start."""
        origin, *others = places.values()
        along = next((place - origin for place in others if place != origin), 1.0 + 0.0j)
        turn = along / abs(along)
        points = {pin: (place - origin) / turn for pin, place in places.items()}
        if len(points) == 2:
            points = {pin: complex(abs(point)) for pin, point in points.items()}
        return cls(name, points, cmath.phase(turn), **more)

    def add(self, pin: str, first: str, second: str, distance: float, angle: float) -> None:
        """Add a pin by polar coordinates about the first of two others; the second is at angle 0."""
        start = self.points[first]
        bearing = cmath.phase(self.points[second] - start) + angle
        self.points[pin] = start + cmath.rect(distance, bearing)

    def bars(self) -> tuple[float, complex, float]:
        """Length, center and second moment about it of bars from the middle of the pins to each of them."""
        middle = sum(self.points.values()) / len(self.points)
        lengths = {pin: abs(point - middle) for pin, point in self.points.items()}
        whole = sum(lengths.values())
        halves = {pin: 0.5 * (point + middle) for pin, point in self.points.items()}
        center = sum(lengths[pin] * halves[pin] for pin in halves) / whole if whole else middle
        moment = sum(
            lengths[pin] * (lengths[pin] ** 2 / 12 + abs(halves[pin] - center) ** 2) for pin in halves
        )
        return whole, center, moment


@dataclass
class Slot:
    """A straight slot of a link or of ground in which a pin slides on a block that does not turn in it."""

    pin: str
    owner: str
    point: complex
    """A point of the line in the frame of the owner."""
    along: complex
    """Direction of the line in that frame."""
    mass: float = field(default=0.0, metadata=unit("kg"))
    """Mass of the block [kg]; 0 if the source has none."""


@dataclass
class Load:
    """A constant force on a link."""

    name: str
    link: str
    point: complex
    """Where it acts, in the frame of the link."""
    vector: complex = field(metadata=unit("N"))
    """Its components [N]."""
    frame: str
    """``"body"`` if it turns with the link, otherwise ``"ground"``."""


@dataclass
class Linkage:
    """What another program's mechanism consists of."""

    title: str
    ground: dict[str, complex] = field(default_factory=dict)
    links: dict[str, Link] = field(default_factory=dict)
    slots: list[Slot] = field(default_factory=list)
    crank: tuple[str, str] | None = None
    """The driven link and its pin on ground."""
    crank_speed: float | None = field(default=None, metadata=unit("rad/s"))
    """Angular velocity of the crank [rad/s]; None if the source has no unit of time."""
    length_unit: float | None = field(default=None, metadata=unit("m"))
    """Unit of the lengths [m]; None if the source has none."""
    gravity: tuple[float, float] | None = field(default=None, metadata=unit("m/s²"))
    """Acceleration of free fall [m/s²]."""
    forces: list[Load] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)

    def refuse(self, path: str, message: str) -> None:
        """Note what cannot be read."""
        self.problems.append(Problem(path, message))

    def holding(self, *pins: str) -> Link | None:
        """The link that has these pins."""
        return next((link for link in self.links.values() if link.points.keys() >= set(pins)), None)

    def finish(self) -> None:
        """Raise all problems together."""
        if self.problems:
            raise SceneError(self.problems)

    def template(self, scale: float, speed: float, density: float, section: float | None) -> Template:
        """The scene file, for a unit of lengths [m] and a speed of the crank [rad/s].

        Links without a mass have this density [kg/m³] and bars of this cross section [m²].
        """
        parameters: dict[str, Any] = {}
        bodies = {name: self._body(name, scale, density, section, parameters) for name in self.links}
        points = {name: body["points"] for name, body in bodies.items()}
        points["ground"] = {pin: _pair(scale * place) for pin, place in self.ground.items()}
        joints = []
        for slot in self.slots:
            block, guide = f"{slot.pin}_block", f"{slot.pin}_guide"
            points[slot.owner][guide] = _pair(scale * slot.point)
            bodies[block] = self._block(block, slot, density, section)
            ends = {"a": f"{slot.owner}.{guide}", "b": block}
            joints.append({"type": "prismatic", "name": guide, **ends, "axis": _pair(slot.along)})
        forces: list[dict[str, Any]] = (
            [{"type": "gravity", "acceleration": list(self.gravity)}] if self.gravity else []
        )
        for force in self.forces:
            points[force.link][force.name] = _pair(scale * force.point)
            x, y = _pair(force.vector)
            acts = {"point": f"{force.link}.{force.name}", "x": x, "y": y, "frame": force.frame}
            forces.append({"type": "force", "name": force.name, **acts})
        drives = []
        if self.crank is not None:
            driven, pin = self.crank
            parameters["crank_speed"] = f"{speed!r} rad/s"
            motion = {"joint": pin, "speed": "crank_speed", "angle": self.links[driven].angle}
            drives.append({"type": "speed", "name": "drive", **motion})
        self.finish()
        scene = {"format": FORMAT, "title": self.title, "parameters": parameters, "ground": points["ground"]}
        scene |= {"bodies": list(bodies.values()), "joints": joints + self._pins(), "forces": forces}
        return loads(write_toml(scene | {"drives": drives}), self.title or "linkage")

    def _pins(self) -> list[dict[str, Any]]:
        """A revolute joint between the first of the bodies at a pin and each of the others."""
        joints = []
        sliding = {slot.pin: f"{slot.pin}_block" for slot in self.slots}
        names = dict.fromkeys([*self.ground, *(pin for link in self.links.values() for pin in link.points)])
        for pin in names:
            ends = [f"{link.name}.{pin}" for link in self.links.values() if pin in link.points]
            if self.crank is not None and self.crank[1] == pin:
                ends.sort(key=f"{self.crank[0]}.{pin}".__ne__)  # the drive is of the first
            grounded = [f"ground.{pin}"] * (pin in self.ground)
            start, *others = grounded + [block for one, block in sliding.items() if one == pin] + ends
            for number, end in enumerate(others, start=1):
                name = pin if number == 1 else f"{pin}_{number}"
                joints.append({"type": "revolute", "name": name, "a": start, "b": end})
        return joints

    def _body(
        self, name: str, scale: float, density: float, section: float | None, parameters: dict[str, Any]
    ) -> dict[str, Any]:
        link = self.links[name]
        points: dict[str, Any] = {pin: _pair(scale * point) for pin, point in link.points.items()}
        length, center, moment = link.bars()
        mass = link.mass or density * self._section(f"links.{name}", section) * length * scale
        if not length:
            self.refuse(f"links.{name}", "has all its pins at one place")
        elif f"{name}_length".isidentifier():
            second = list(points)[1]
            parameters[f"{name}_length"] = f"{points[second][0]!r} m"
            points[second] = [f"{name}_length", 0.0]
        return {
            "name": name,
            "mass": mass,
            "inertia": link.inertia or mass * moment / (length or 1.0) * scale**2,
            "center_of_mass": _pair(scale * (center if link.center is None else link.center)),
            "points": points,
            "angle": link.angle,
        }

    def _block(self, name: str, slot: Slot, density: float, section: float | None) -> dict[str, Any]:
        """A cube, of the width of the bars if the source has no mass."""
        mass = slot.mass or density * self._section(f"slots.{slot.pin}", section) ** 1.5
        return {"name": name, "mass": mass, "inertia": mass * (mass / density) ** (2 / 3) / 6}

    def _section(self, path: str, section: float | None) -> float:
        if section is None:
            self.refuse(path, "has no mass: give cross_section, that of its bars [m²]")
            return 1.0
        return section


def _pair(place: complex) -> list[float]:
    return [place.real, place.imag]
