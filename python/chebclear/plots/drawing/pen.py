"""Drawing of the parts of a mechanism as strokes, with the areas that labels must avoid."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.forces import Bushing, Damper, Force, Spring, Torque, TorsionDamper, TorsionSpring
from ...scene.motions import Coupling
from ...scene.parts import (
    GROUND,
    Body,
    ClearancePrismatic,
    ClearanceRevolute,
    Fixed,
    PinInSlot,
    Prismatic,
    Revolute,
    Stop,
    ends_of,
    owner_of,
)
from .guides import draw_guide, half_size, part_in, place_in
from .plane import Clutter, hull
from .pose import GROUND_COLOR, Pose
from .strokes import (
    Owner,
    Stroke,
    along,
    arc,
    beside,
    dashpot,
    drum,
    spiral,
    typical,
    varies,
    zigzag,
)

Array = NDArray[np.float64]

# Sizes relative to the diagonal of the mechanism, chosen by eye on the ready-made mechanisms.
_BAR = 0.016  # half the width of a bar
_PIN = 0.011  # radius of an ideal pin
_BLOCK = (0.055, 0.034)  # half length and half width of a sliding block
_SUPPORT = 0.055  # height of a support on ground
_COIL = 0.018  # half the width of a spring or damper
_ARROW = 0.16  # length of the arrow of a force
_HEAD = 0.022  # length of the head of an arrow
_DASH = 0.02  # length of a dash

_WITH_FACES = (ClearancePrismatic, PinInSlot, Stop)


def strokes_of(
    pose: Pose, exaggerate: float = 1.0, travel: Mapping[str, tuple[float, float]] | None = None
) -> Pen:
    """Draw all parts of a scene, with clearances and eccentricities enlarged by a factor [-].

    How far the block of each guide goes back and forth from where it is [m] makes rails as long.
    """
    pen = Pen(pose, exaggerate, travel or {})
    for joint in pose.scene.joints:
        pen.ground(joint)
    for body in pose.scene.bodies:
        pen.body(body)
    for joint in pose.scene.joints:
        pen.joint(joint)
    for drive in pose.scene.drives:
        pen.drive(drive)
    for force in pose.scene.forces:
        pen.force(force)
    for coupling in pose.scene.couplings:
        pen.coupling(coupling)
    return pen


class Pen:
    """Draws parts as strokes and records the areas that labels must avoid."""

    def __init__(self, pose: Pose, exaggerate: float, travel: Mapping[str, tuple[float, float]]) -> None:
        self.pose, self.exaggerate, self.travel = pose, exaggerate, travel
        self.strokes: list[Stroke] = []
        self.unit = pose.size
        self.clutter = Clutter()
        self.named: list[tuple[Array, str, float]] = []  # joints: where, name, radius to keep clear of
        self.lugs: dict[str, list[tuple[Array, float]]] = {}  # bearings of each body: where, bearing radius
        for joint in pose.scene.joints:
            if isinstance(joint, ClearanceRevolute):
                radius = joint.journal_radius + exaggerate * joint.clearance
                self.lugs.setdefault(owner_of(joint.bearing), []).append((pose.at(joint.bearing), radius))

    # Ground

    def ground(self, joint: Any) -> None:
        """What stands under a joint on ground: a support, or a hatched rail."""
        ends = ends_of(joint)
        if GROUND not in map(owner_of, ends):
            return
        if isinstance(joint, (Prismatic, *_WITH_FACES)):
            return  # drawn with what slides
        point = self.pose.at(next(end for end in ends if owner_of(end) == GROUND))
        radius = self._radius(joint)
        height = max(_SUPPORT * self.unit, 1.8 * radius)
        half = max(0.6 * height, 1.15 * radius)
        corners = np.array([(-half, -height), (-0.55 * half, 0.0), (0.55 * half, 0.0), (half, -height)])
        self.area(point + corners, GROUND, GROUND_COLOR, 1, alpha=0.2)
        foot, reach = point - np.array([0.0, height]), np.array([1.5 * half, 0.0])
        self.clutter.add(point, foot, 0.8 * half)
        self.hatched(foot - reach, foot + reach)

    def hatched(self, start: Array, end: Array) -> None:
        """A line with hatching to its right, as ground is drawn."""
        way = (end - start) / np.hypot(*(end - start))
        below = np.array([way[1], -way[0]])
        pitch = 0.014 * self.unit
        self.clutter.add(start, end, pitch)
        self.line([start, end], GROUND, GROUND_COLOR, 1.4, 1)
        for place in np.arange(0.5 * pitch, np.hypot(*(end - start)), pitch):
            top = start + place * way
            self.line([top, top + pitch * (below - way)], GROUND, GROUND_COLOR, 0.7, 1)

    # Bodies

    def body(self, body: Body) -> None:
        """A bar or plate through the points of a body, thicker around its bearings."""
        color = self.pose.colors[body.name]
        radius = _BAR * self.unit
        points = self.pose.points[body.name]
        discs = [(point, radius) for point in points]
        self.area(hull(discs), body.name, color, 2, alpha=0.35)
        for first, second in itertools.combinations_with_replacement(points, 2):
            self.clutter.add(first, second, radius, body.name)
        for center, bearing in self.lugs.get(body.name, []):
            lug = 1.25 * bearing + 0.3 * radius
            self.area(hull([(center, lug)]), body.name, color, 2, alpha=0.35)
            self.clutter.add(center, center, lug)
        if body.mass == 0.0:
            return
        center = self.pose.at(f"{body.name}.center_of_mass")
        arm = 0.6 * radius
        for across in ((arm, 0.0), (0.0, arm)):
            self.line([center - across, center + across], body.name, color, 1.1, 6)

    # Joints

    def joint(self, joint: Any) -> None:
        """The symbol of a joint."""
        ends = ends_of(joint)
        place = self.pose.at(ends[1])
        lug = isinstance(joint, ClearanceRevolute) and owner_of(joint.bearing) != GROUND
        keep = self._radius(joint) * (1.25 if lug else 1.0)
        self.named.append((place, joint.name, keep))
        self.clutter.add(place, place, keep)
        if isinstance(joint, ClearanceRevolute):
            self._clearance(joint)
        elif isinstance(joint, Revolute):
            self.disc(place, _PIN * self.unit, owner_of(ends[1]), "white", "0.15", 7)
        elif isinstance(joint, Prismatic):
            self._guide(joint)
        elif isinstance(joint, _WITH_FACES):
            draw_guide(self, joint, self.travel.get(joint.name, (0.0, 0.0)))
        elif isinstance(joint, Fixed):
            half = 0.7 * _PIN * self.unit
            square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
            self.area(place + square, owner_of(ends[1]), "0.15", 7, alpha=1.0)

    def _radius(self, joint: Any) -> float:
        """Radius of the symbol of a joint."""
        if isinstance(joint, ClearanceRevolute):
            return joint.journal_radius + self.exaggerate * joint.clearance
        if isinstance(joint, _WITH_FACES):
            return max(half_size(joint)[1], _PIN * self.unit)
        return self._block(joint)[0] if isinstance(joint, Prismatic) else _PIN * self.unit

    def _block(self, joint: Prismatic) -> tuple[float, float]:
        """Half length and half width of a sliding block; large enough to hold a pin with clearance."""
        place = self.pose.at(joint.b)
        held = [0.0]
        for pin in self.pose.scene.joints:
            if isinstance(pin, ClearanceRevolute) and owner_of(joint.b) in map(owner_of, ends_of(pin)):
                radius = self._radius(pin)
                if np.hypot(*(self.pose.at(pin.journal) - place)) < radius:
                    held.append(radius)
        length, width = (share * self.unit for share in _BLOCK)
        return max(length, 1.8 * max(held)), max(width, 1.5 * max(held))

    def _clearance(self, joint: ClearanceRevolute) -> None:
        bearing = self.pose.at(joint.bearing)
        holder, turner = map(owner_of, ends_of(joint))
        outer, inner = self.pose.colors[holder], self.pose.colors[turner]
        self.disc(bearing, self._radius(joint), holder, "white", outer, 4, width=1.6)
        shown, _ = place_in(self.pose, joint, self.exaggerate)
        part = part_in(self, joint)
        self.disc(shown, joint.journal_radius, part, inner, inner, 5, alpha=0.75)
        self.disc(shown, 0.1 * joint.journal_radius, part, "white", "white", 7)

    def _guide(self, joint: Prismatic) -> None:
        """Rail on body a along the axis, and a block on body b."""
        rail, block = owner_of(joint.a), owner_of(joint.b)
        way = self.pose.direction(joint.axis, rail)
        across = np.array([-way[1], way[0]])
        start, place = self.pose.at(joint.a), self.pose.at(joint.b)
        half_length, half_width = self._block(joint)
        if GROUND in (rail, block):
            # The rail passes under the block, whichever side it lies on.
            reach = 1.8 * half_length
            back, forth = self.travel.get(joint.name, (0.0, 0.0))
            side = -1.0 if across[1] > 1e-9 or (abs(across[1]) <= 1e-9 and across[0] > 0.0) else 1.0
            foot = place + side * half_width * across
            ends = [foot + (back - reach) * way, foot + (forth + reach) * way]
            self.hatched(*(ends if side < 0.0 else ends[::-1]))
        else:
            far = float((place - start) @ way)
            back, forth = self.travel.get(joint.name, (0.0, 0.0))
            low = min(0.0, far + back - 1.8 * half_length)
            high = max(0.0, far + forth + 1.8 * half_length)
            for offset in (-0.55 * _BAR * self.unit, 0.55 * _BAR * self.unit):
                offside = start + offset * across
                self.line([offside + low * way, offside + high * way], rail, self.pose.colors[rail], 0.9, 3)
        moving = block if block != GROUND else rail
        corners = [
            place + x * half_length * way + y * half_width * across
            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        # Behind the bodies: a pin in the block stays in sight.
        self.area(np.array(corners), block, self.pose.colors[moving], 1.5, alpha=0.45)

    # Drives

    def drive(self, drive: Any) -> None:
        """An arrow around a driven pin or along a driven guide; it points where the drive goes first."""
        joint = next((joint for joint in self.pose.scene.joints if joint.name == drive.joint), None)
        if joint is None:
            return
        motion = getattr(drive, "motion", None)
        both = varies(motion) if motion is not None else False
        end = ends_of(joint)[1]
        place = self.pose.at(end)
        if isinstance(joint, Prismatic):
            way = self.pose.direction(joint.axis, owner_of(joint.a))
            half_length, half_width = self._block(joint)
            side = np.array([-way[1], way[0]]) * (half_width + 0.03 * self.unit)
            start, tip = place + side - half_length * way, place + side + half_length * way
            self._arrow(start, tip, owner_of(joint.a), "0.1", both)
            self.clutter.add(start, tip, 0.0)
            return
        sign = drive.speed if motion is None else typical(motion)
        radius = max(0.06 * self.unit, 1.7 * self._radius(joint))
        self.named = [(at, name, radius if name == joint.name else clear) for at, name, clear in self.named]
        self._curved_arrow(place, radius, (end, end), sign < 0.0, "0.1", both)

    def _curved_arrow(
        self, place: Array, radius: float, owner: Owner, clockwise: bool, color: str, both: bool
    ) -> None:
        path = arc(place, radius, 35.0, 290.0)[:: -1 if clockwise else 1]
        self.clutter.add(place, place, radius)
        self.line(path, owner, color, 1.3, 8)
        self._arrow_head(path[-1], path[-1] - path[-4], owner, color)
        if both:
            self._arrow_head(path[0], path[0] - path[3], owner, color)

    def _arrow(self, start: Array, tip: Array, owner: Owner, color: str, both: bool) -> None:
        way, _, _ = along(start, tip)
        head = _HEAD * self.unit * way
        self.line([start + head if both else start, tip - head], owner, color, 1.3, 8)
        self._arrow_head(tip - head, way, owner, color)
        if both:
            self._arrow_head(start + head, -way, owner, color)

    # Forces

    def force(self, force: Any) -> None:
        """The symbol of a spring, a damper, a given force or a torque; gravity is drawn in the end."""
        if isinstance(force, (Spring, Damper)):
            self._link(force)
        elif isinstance(force, Bushing):
            place, radius = self.pose.at(force.b), _PIN * self.unit
            rings = [arc(place, size * radius, 0.0, 360.0) for size in (1.6, 2.6)]
            self._symbol(rings, (force.b, force.b), place, 2.8 * radius, force.name)
        elif isinstance(force, (TorsionSpring, TorsionDamper)):
            end, radius = self._between(force.a, force.b)
            place = self.pose.at(end)
            lines = []
            if isinstance(force, TorsionSpring) and force.stiffness:
                lines += spiral(place, 1.2 * radius, 2.4 * radius)
            if force.damping:
                lines += drum(place, 2.7 * radius)
            self._symbol(lines, (end, end), place, 3.4 * radius, force.name)
        elif isinstance(force, Torque) and typical(force.torque):
            end, radius = self._between(force.reaction, force.body)
            place, clockwise = self.pose.at(end), typical(force.torque) < 0.0
            color = self.pose.colors[force.body]
            self._curved_arrow(place, 3.8 * radius, (end, end), clockwise, color, varies(force.torque))
            self.named.append((place, force.name, 3.8 * radius))
        elif isinstance(force, Force):
            self._given(force)

    def _link(self, force: Spring | Damper) -> None:
        start, end = self.pose.at(force.a), self.pose.at(force.b)
        way, _, length = along(start, end)
        width = min(_COIL * self.unit, 0.2 * length)
        spring = isinstance(force, Spring) and force.stiffness > 0.0
        if spring and force.damping:
            lead, shift = 0.1 * length, 1.4 * width
            inner = start + lead * way, end - lead * way
            both = [(shift, zigzag(*inner, width)), (-shift, dashpot(*inner, width))]
            lines = beside(start, end, lead, both)
        else:
            lines = zigzag(start, end, width) if spring else dashpot(start, end, width)
        for name, place, inwards in ((force.a, start, way), (force.b, end, -way)):
            if owner_of(name) == GROUND:
                across = 1.8 * width * np.array([-inwards[1], inwards[0]])
                self.hatched(place + across, place - across)
        self.clutter.add(start, end, 2.5 * width)
        self._symbol(lines, (force.a, force.b), 0.5 * (start + end), 2.5 * width, force.name)

    def coupling(self, coupling: Coupling) -> None:
        """A dashed line between what is coupled."""
        ends = [self._coupled(name) for name in (coupling.driven, coupling.driver)]
        start, end = map(self.pose.at, ends)
        way, _, length = along(start, end)
        count = max(1, round(length / (2.0 * _DASH * self.unit)))
        dashes = np.linspace(0.0, length, 2 * count + 2)[1:-1].reshape(-1, 2)
        if length > _PIN * self.unit:
            lines = [start + dash[:, None] * way for dash in dashes]
            self._symbol(lines, (ends[0], ends[1]), 0.5 * (start + end), 0.0, coupling.name)

    def _coupled(self, name: str) -> str:
        """A point at which a coupled coordinate shows: of its joint, or one about which its body turns."""
        owner = name.rpartition(".")[0]
        joints = self.pose.scene.joints
        for joint in joints:
            if joint.name == owner:
                return ends_of(joint)[1]
        for joint in joints:
            for end in ends_of(joint):
                if owner_of(end) == owner and owner != GROUND:
                    return end
        return owner

    def _symbol(self, lines: Sequence[Array], owner: Owner, place: Array, radius: float, name: str) -> None:
        for line in lines:
            self.line(line, owner, "0.2", 1.1, 6.5)
        self.clutter.add(place, place, radius)
        self.named.append((place, name, radius))

    def _between(self, first: str, second: str) -> tuple[str, float]:
        """The point where something turns one body against another, and the radius of what stands there."""
        for joint in self.pose.scene.joints:
            if {first, second} == set(map(owner_of, ends_of(joint))):
                return ends_of(joint)[1], max(_PIN * self.unit, 0.6 * self._radius(joint))
        body = second if second != GROUND else first
        return f"{body}.center_of_mass", _PIN * self.unit

    def _given(self, force: Force) -> None:
        """An arrow that points at where the force acts."""
        components = (typical(force.x), typical(force.y))
        if not any(components):
            return
        owner = owner_of(force.point)
        turns = force.frame == "body"
        way = self.pose.direction(components, owner if turns else GROUND)
        tip = self.pose.at(force.point) - 0.5 * _HEAD * self.unit * way
        tail = tip - _ARROW * self.unit * way
        moves: Owner = owner if turns else (force.point, force.point)
        self._arrow(tail, tip, moves, self.pose.colors[owner], varies(force.x) or varies(force.y))
        self.clutter.add(tail, tip, 0.0)
        self.named.append((tail, force.name, 0.0))

    def _arrow_head(self, foot: Array, direction: Array, owner: Owner, color: str) -> None:
        way, across, _ = along(np.zeros(2), direction)
        size = _HEAD * self.unit
        corners = [foot + size * way, foot + 0.45 * size * across, foot - 0.45 * size * across]
        self.area(np.array(corners), owner, color, 8, alpha=1.0)

    # Strokes

    def area(self, corners: Array, owner: Owner, color: str, layer: float, *, alpha: float) -> None:
        self.strokes.append(Stroke("area", corners, owner, layer, color, face=color, alpha=alpha))

    def disc(
        self,
        center: Array,
        radius: float,
        owner: Owner,
        face: str,
        edge: str,
        layer: float,
        *,
        width: float = 1.0,
        alpha: float = 1.0,
    ) -> None:
        self.strokes.append(Stroke("disc", center[None, :], owner, layer, edge, width, face, alpha, radius))

    def line(
        self, points: Sequence[Array] | Array, owner: Owner, color: str, width: float, layer: float
    ) -> None:
        self.strokes.append(Stroke("line", np.array(points), owner, layer, color, width))
