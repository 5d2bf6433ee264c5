"""Linkages and mechanisms of pylinkage, objects or the JSON that it writes.

Read are ``Ground``, ``Crank``, ``RRRDyad``, ``RRPDyad``, and ``FixedDyad`` and ``PointTracker`` between pins
of one link; of its mechanisms ground, revolute, prismatic and tracker joints, links and driver links. A
linkage is read in the position in which it is.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from typing import Any

from ..base.arguments import as_number
from ..errors import SceneError
from .linkage import Link, Linkage, Slot


def of_components(source: Any) -> Linkage:
    """A `pylinkage.Linkage`."""
    reader = _Components(source)
    # In the order in which pylinkage solves them, so that the links of an anchor are known.
    for part in getattr(source, "_solve_order", None) or source._find_solve_order():
        reader.read_part(part)
    return reader.read


class _Components:
    """Makes a linkage of the components of pylinkage."""

    def __init__(self, source: Any) -> None:
        self.read = Linkage("" if source.name == str(id(source)) else str(source.name))
        self.names: dict[int, str] = {}
        for number, part in enumerate(source.components, start=1):
            # pylinkage calls by its address in memory what the user has not named.
            named = part.name != str(id(part))
            name = plain_name(part.name) if named else f"{type(part).__name__}{number}"
            if name in self.names.values():
                self.read.refuse(name, "is the name of two components")
            self.names[id(part)] = name

    def name(self, part: Any) -> str:
        """The name of a component or of the output of one."""
        return self.names[id(getattr(part, "_parent", part))]

    def read_part(self, part: Any) -> None:
        name, kind, read = self.name(part), type(part).__name__, self.read
        if kind == "Ground":
            read.ground[name] = complex(*part.position)
        elif kind == "Crank" and read.crank is None:
            self.bar(f"{name}_link", part.anchor, part, part.radius)
            read.crank = (f"{name}_link", self.name(part.anchor))
        elif kind == "RRRDyad":
            self.bar(f"{name}_link1", part.anchor1, part, part.distance1)
            self.bar(f"{name}_link2", part.anchor2, part, part.distance2)
        elif kind == "RRPDyad":
            self.bar(f"{name}_link", part.revolute_anchor, part, part.distance)
            self.slot(part)
        elif kind in ("FixedDyad", "PointTracker"):
            first, second = self.name(part.anchor1), self.name(part.anchor2)
            _point(read, name, first, second, part.distance, part.angle)
        else:
            read.refuse(name, "is a second Crank" if kind == "Crank" else f"is a {kind}, which is not read")

    def bar(self, name: str, anchor: Any, part: Any, length: float) -> None:
        bearing = cmath.phase(complex(*part.position) - complex(*anchor.position))
        points = {self.name(anchor): 0j, self.name(part): complex(length)}
        self.read.links[name] = Link(name, points, bearing)

    def slot(self, part: Any) -> None:
        """The line of a slider, through two pins of ground or of one link."""
        read, name = self.read, self.name(part)
        ends = self.name(part.line_anchor1), self.name(part.line_anchor2)
        link = read.holding(*ends)
        if read.ground.keys() >= set(ends):
            owner, places = "ground", read.ground
        elif link is not None:
            owner, places = link.name, link.points
        else:
            read.refuse(name, f"slides along a line through {ends[0]} and {ends[1]}, which no link joins")
            return
        start, end = (places[one] for one in ends)
        read.slots.append(Slot(name, owner, start, end - start))


def _point(read: Linkage, name: str, first: str, second: str, distance: float, angle: float) -> None:
    link = read.holding(first, second)
    if link is not None:
        link.add(name, first, second, distance, angle)
    elif read.ground.keys() >= {first, second}:
        frame = Link("", read.ground)
        frame.add(name, first, second, distance, angle)
    else:
        read.refuse(name, f"is placed by {first} and {second}, which no link joins: no rigid body has it")


def of_mechanism(values: Mapping[str, Any]) -> Linkage:
    """A mechanism as pylinkage writes it to JSON."""
    read = Linkage(str(values.get("name", "")))
    joints, links = _tables(read, values, "joints"), _tables(read, values, "links")
    kinds = {pin: joint.get("type", "revolute") for pin, joint in joints.items()}
    for link in links.values():
        fixed = link.get("joints", []) if link.get("type") == "ground" else [link.get("motor_joint")]
        kinds |= dict.fromkeys(set(fixed) & set(kinds), "ground")
    places = {}
    for pin, joint in joints.items():
        if kinds[pin] not in ("ground", "revolute", "prismatic", "tracker"):
            read.refuse(f"joints.{pin}", f'has the type "{kinds[pin]}", which is not read')
        if kinds[pin] != "tracker":
            places[pin] = _place(read, f"joints.{pin}.position", joint.get("position"))
    read.ground = {pin: place for pin, place in places.items() if kinds[pin] == "ground"}
    for name, link in links.items():
        _read_link(read, name, link, places, kinds)
    read.finish()
    for pin, joint in joints.items():
        path = f"joints.{pin}"
        if kinds[pin] == "prismatic":
            along = _place(read, f"{path}.axis", joint.get("axis", [1.0, 0.0]))
            point = _place(read, f"{path}.line_point", joint.get("line_point", [0.0, 0.0]))
            read.slots.append(Slot(pin, "ground", point, along))
        elif kinds[pin] == "tracker":
            ends = (str(joint.get("ref_joint1_id")), str(joint.get("ref_joint2_id")))
            polar = _place(read, path, [joint.get("distance", 0.0), joint.get("angle", 0.0)])
            _point(read, pin, *ends, polar.real, polar.imag)
    return read


def _read_link(
    read: Linkage, name: str, link: Mapping[str, Any], places: Mapping[str, complex], kinds: Mapping[str, str]
) -> None:
    kind, path = link.get("type", "link"), f"links.{name}"
    pins = [pin for pin in link.get("joints", []) if kinds.get(pin) != "tracker"]
    motor, start = link.get("motor_joint"), link.get("initial_angle", 0.0)
    if kind == "ground":
        return
    if kind not in ("link", "driver"):
        read.refuse(path, f'has the type "{kind}", which is not read')
    elif len(pins) < 2 or not places.keys() >= set(pins):
        read.refuse(path, "must have two joints or more, which are in the list of joints")
    elif kind == "link":
        read.links[name] = Link.through(name, {pin: places[pin] for pin in pins})
    elif len(pins) != 2 or motor not in pins or read.crank is not None:
        read.refuse(path, "is driven: one such link is read, of two joints, one of them its motor_joint")
    else:
        pins.sort(key=lambda pin: pin != motor)
        read.links[name] = Link.through(name, {pin: places[pin] for pin in pins})
        read.crank = (name, pins[0])
        turn = _place(read, path, [start, 0.0]).real - read.links[name].angle
        if abs(cmath.rect(1.0, turn) - 1.0) > 1e-9:
            read.refuse(path, "is not drawn at its initial_angle: save the mechanism at its start")


def _tables(read: Linkage, values: Mapping[str, Any], name: str) -> dict[str, Mapping[str, Any]]:
    """The entries of a list by their names, if all that they name are texts."""
    found = values.get(name)
    for one in found if isinstance(found, list) else [None]:
        given = one if isinstance(one, Mapping) else {}
        more = given.get("joints", [])
        names = [given.get("id"), given.get("type", ""), given.get("motor_joint", "")]
        if not isinstance(more, list) or not all(isinstance(text, str) for text in names + more):
            read.refuse(
                name, "must be a list of tables with an id, as mechanism_to_json of pylinkage writes it"
            )
            raise SceneError(read.problems)
    entries = [_without_dots(one) for one in found or []]
    tables: dict[str, Mapping[str, Any]] = {one["id"]: one for one in entries}
    if len(tables) < len(entries):
        read.refuse(name, "must have ids that differ, also with _ in the place of dots")
    return tables


def plain_name(name: str) -> str:
    """A name that a scene accepts: the builder of pylinkage calls joints ``"ground.O_crank.0"``."""
    return name.replace(".", "_")


def _without_dots(entry: Mapping[str, Any]) -> dict[str, Any]:
    """An entry with names that a scene accepts."""
    plain = dict(entry)
    for key in ("id", "motor_joint", "ref_joint1_id", "ref_joint2_id"):
        if isinstance(plain.get(key), str):
            plain[key] = plain_name(plain[key])
    if "joints" in plain:
        plain["joints"] = [plain_name(pin) for pin in plain["joints"]]
    return plain


def _place(read: Linkage, path: str, pair: Any) -> complex:
    numbers = (
        [as_number(one) for one in pair] if isinstance(pair, (list, tuple)) and len(pair) == 2 else [None]
    )
    known = [number for number in numbers if number is not None and math.isfinite(number)]
    if len(known) == 2:
        return complex(*known)
    read.refuse(path, f"must be two finite numbers, got {pair!r:.80}")
    return 0j
