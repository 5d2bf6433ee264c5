"""The picture of a scene: its mechanism as assembled, with joints, ground, drives and gravity.

All sizes are in metres of the drawing and scale with the mechanism, so the picture can be zoomed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...base.arguments import Checks
from ...plots.results import _axes
from ...scene.scene import (
    Body,
    ClearanceRevolute,
    Damper,
    Fixed,
    Force,
    Gravity,
    Prismatic,
    Revolute,
    Scene,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from .plane import Clutter, hull
from .pose import GROUND, GROUND_COLOUR, Pose, ends_of, owner_of
from .symbols import along, arc, beside, dashpot, drum, spiral, typical, varies, zigzag

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


# Sizes relative to the diagonal of the mechanism, chosen by eye on the ready-made mechanisms.
_BAR = 0.016  # half the width of a bar
_PIN = 0.011  # radius of an ideal pin
_BLOCK = (0.055, 0.034)  # half length and half width of a sliding block
_SUPPORT = 0.055  # height of a support on ground
_COIL = 0.018  # half the width of a spring or damper
_ARROW = 0.16  # length of the arrow of a force
_HEAD = 0.022  # length of the head of an arrow
_LETTER = (0.013, 0.032)  # width and height of a letter in a picture about four inches wide


def plot_scene(scene: Scene, ax: Axes | None = None, *, exaggerate: float = 1.0, labels: bool = True) -> Axes:
    """Draw the assembled mechanism of a scene.

    Bodies are bars or plates through their points, with a cross at the centre of mass; ground is hatched.
    Ideal pins are small circles, guides are rails with a block, welds are squares. A pin with clearance is a
    journal (a disc in the colour of its body) in a bearing of true radius. Springs are zigzags or spirals,
    dampers are cylinders with a piston or drums with shoes. Drives, given forces and torques are arrows,
    straight or curved, with two heads if they change direction; gravity is an arrow in the corner.

    Parameters
    ----------
    scene : Scene
        The scene; it is checked and assembled.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    exaggerate : float
        Factor by which clearances, and eccentricities, are drawn larger than they are [-]; the picture states
        it.
    labels : bool
        Write the names of bodies, joints and forces.

    Returns
    -------
    Axes

    Raises
    ------
    SceneError
        If the scene cannot be assembled.
    ValueError, TypeError
        If `exaggerate` is no finite number above 0.

    Examples
    --------
    >>> from chebclear import mechanisms
    >>> plot_scene(mechanisms.four_bar(), exaggerate=100.0).get_xlabel()
    'x [m]'
    """
    checks = Checks()
    checks.real("exaggerate", exaggerate, "-", above=0.0)
    if not isinstance(scene, Scene):
        checks.add(f"scene must be a Scene, got {scene!r}", wrong_type=True)
    checks.finish()
    pose = Pose(scene)
    ax = _axes(ax)
    pen = _Pen(ax, pose, float(exaggerate))
    for joint in scene.joints:
        pen.ground(joint)
    for body in scene.bodies:
        pen.body(body)
    for joint in scene.joints:
        pen.joint(joint)
    for drive in scene.drives:
        pen.drive(drive)
    for force in scene.forces:
        pen.force(force)
    gravity = sum(
        (np.array(force.acceleration) for force in scene.forces if isinstance(force, Gravity)), np.zeros(2)
    )
    pen.finish(gravity, labels)
    return ax


class _Pen:
    """Draws on axes; notes what labels have to keep clear of."""

    def __init__(self, ax: Axes, pose: Pose, exaggerate: float) -> None:
        self.ax, self.pose, self.exaggerate = ax, pose, exaggerate
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
        if isinstance(joint, Prismatic):
            return  # drawn with its block
        point = self.pose.at(next(end for end in ends if owner_of(end) == GROUND))
        radius = self._radius(joint)
        height = max(_SUPPORT * self.unit, 1.8 * radius)
        half = max(0.6 * height, 1.15 * radius)
        corners = np.array([(-half, -height), (-0.55 * half, 0.0), (0.55 * half, 0.0), (half, -height)])
        self._polygon(point + corners, GROUND_COLOUR, 1, alpha=0.2)
        foot, reach = point - np.array([0.0, height]), np.array([1.5 * half, 0.0])
        self.clutter.add(point, foot, 0.8 * half)
        self._hatched(foot - reach, foot + reach)

    def _hatched(self, start: Array, end: Array) -> None:
        """A line with hatching to its right, as ground is drawn."""
        way = (end - start) / np.hypot(*(end - start))
        below = np.array([way[1], -way[0]])
        pitch = 0.014 * self.unit
        self.clutter.add(start, end, pitch)
        self._line([start, end], GROUND_COLOUR, 1.4, 1)
        for place in np.arange(0.5 * pitch, np.hypot(*(end - start)), pitch):
            top = start + place * way
            self._line([top, top + pitch * (below - way)], GROUND_COLOUR, 0.7, 1)

    # Bodies

    def body(self, body: Body) -> None:
        """A bar or plate through the points of a body, thicker around its bearings."""
        colour = self.pose.colours[body.name]
        radius = _BAR * self.unit
        points = self.pose.points[body.name]
        discs = [(point, radius) for point in points]
        self._polygon(hull(discs), colour, 2, alpha=0.35)
        for first, second in itertools.combinations_with_replacement(points, 2):
            self.clutter.add(first, second, radius)
        for centre, bearing in self.lugs.get(body.name, []):
            lug = 1.25 * bearing + 0.3 * radius
            self._polygon(hull([(centre, lug)]), colour, 2, alpha=0.35)
            self.clutter.add(centre, centre, lug)
        centre = self.pose.at(f"{body.name}.center_of_mass")
        arm = 0.6 * radius
        for across in ((arm, 0.0), (0.0, arm)):
            self._line([centre - across, centre + across], colour, 1.1, 6)

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
            self._disc(place, _PIN * self.unit, "white", "0.15", 7)
        elif isinstance(joint, Prismatic):
            self._guide(joint)
        elif isinstance(joint, Fixed):
            half = 0.7 * _PIN * self.unit
            square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
            self._polygon(place + square, "0.15", 7, alpha=1.0)

    def _radius(self, joint: Any) -> float:
        """Radius of the symbol of a joint."""
        if isinstance(joint, ClearanceRevolute):
            return joint.journal_radius + self.exaggerate * joint.clearance
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
        bearing, journal = (self.pose.at(end) for end in ends_of(joint))
        outer, inner = (self.pose.colours[owner_of(end)] for end in ends_of(joint))
        self._disc(bearing, self._radius(joint), "white", outer, 4, width=1.6)
        shown = bearing + self.exaggerate * (journal - bearing)
        self._disc(shown, joint.journal_radius, inner, inner, 5, alpha=0.75)
        self._disc(shown, 0.1 * joint.journal_radius, "white", "white", 7)

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
            side = -1.0 if across[1] > 1e-9 or (abs(across[1]) <= 1e-9 and across[0] > 0.0) else 1.0
            foot = place + side * half_width * across
            ends = [foot - reach * way, foot + reach * way]
            self._hatched(*(ends if side < 0.0 else ends[::-1]))
        else:
            far = float((place - start) @ way)
            low, high = min(0.0, far - 1.8 * half_length), max(0.0, far + 1.8 * half_length)
            for offset in (-0.55 * _BAR * self.unit, 0.55 * _BAR * self.unit):
                offside = start + offset * across
                self._line([offside + low * way, offside + high * way], self.pose.colours[rail], 0.9, 3)
        moving = block if block != GROUND else rail
        corners = [
            place + x * half_length * way + y * half_width * across
            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        # Behind the bodies: a pin in the block stays in sight.
        self._polygon(np.array(corners), self.pose.colours[moving], 1.5, alpha=0.45)

    # Drives

    def drive(self, drive: Any) -> None:
        """An arrow around a driven pin or along a driven guide; it points where the drive goes first."""
        joint = next((joint for joint in self.pose.scene.joints if joint.name == drive.joint), None)
        if joint is None:
            return
        motion = getattr(drive, "motion", None)
        both = varies(motion) if motion is not None else False
        place = self.pose.at(ends_of(joint)[1])
        if isinstance(joint, Prismatic):
            way = self.pose.direction(joint.axis, owner_of(joint.a))
            half_length, half_width = self._block(joint)
            side = np.array([-way[1], way[0]]) * (half_width + 0.03 * self.unit)
            self._arrow(place + side - half_length * way, place + side + half_length * way, "0.1", both)
            self.clutter.add(place + side - half_length * way, place + side + half_length * way, 0.0)
            return
        sign = drive.speed if motion is None else typical(motion)
        radius = max(0.06 * self.unit, 1.7 * self._radius(joint))
        self.named = [(at, name, radius if name == joint.name else clear) for at, name, clear in self.named]
        self._curved_arrow(place, radius, sign < 0.0, "0.1", both)

    def _curved_arrow(self, place: Array, radius: float, clockwise: bool, colour: str, both: bool) -> None:
        path = arc(place, radius, 35.0, 290.0)[:: -1 if clockwise else 1]
        self.clutter.add(place, place, radius)
        self._line(path, colour, 1.3, 8)
        self._arrow_head(path[-1], path[-1] - path[-4], colour)
        if both:
            self._arrow_head(path[0], path[0] - path[3], colour)

    def _arrow(self, start: Array, tip: Array, colour: str, both: bool) -> None:
        way, _, _ = along(start, tip)
        head = _HEAD * self.unit * way
        self._line([start + head if both else start, tip - head], colour, 1.3, 8)
        self._arrow_head(tip - head, way, colour)
        if both:
            self._arrow_head(start + head, -way, colour)

    # Forces

    def force(self, force: Any) -> None:
        """The symbol of a spring, a damper, a given force or a torque; gravity is drawn in the end."""
        if isinstance(force, (Spring, Damper)):
            self._link(force)
        elif isinstance(force, (TorsionSpring, TorsionDamper)):
            place, radius = self._between(force.a, force.b)
            lines = []
            if isinstance(force, TorsionSpring) and force.stiffness:
                lines += spiral(place, 1.2 * radius, 2.4 * radius)
            if force.damping:
                lines += drum(place, 2.7 * radius)
            self._symbol(lines, place, 3.4 * radius, force.name)
        elif isinstance(force, Torque) and typical(force.torque):
            place, radius = self._between(force.reaction, force.body)
            colour = self.pose.colours[force.body]
            self._curved_arrow(place, 3.8 * radius, typical(force.torque) < 0.0, colour, varies(force.torque))
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
                self._hatched(place + across, place - across)
        self.clutter.add(start, end, 2.5 * width)
        self._symbol(lines, 0.5 * (start + end), 2.5 * width, force.name)

    def _symbol(self, lines: Sequence[Array], place: Array, radius: float, name: str) -> None:
        for line in lines:
            self._line(line, "0.2", 1.1, 6.5)
        self.clutter.add(place, place, radius)
        self.named.append((place, name, radius))

    def _between(self, first: str, second: str) -> tuple[Array, float]:
        """Where something turns one body against another, and the radius of what stands there."""
        for joint in self.pose.scene.joints:
            if {first, second} == set(map(owner_of, ends_of(joint))):
                return self.pose.at(ends_of(joint)[1]), max(_PIN * self.unit, 0.6 * self._radius(joint))
        body = second if second != GROUND else first
        return self.pose.at(f"{body}.center_of_mass"), _PIN * self.unit

    def _given(self, force: Force) -> None:
        """An arrow that points at where the force acts."""
        components = (typical(force.x), typical(force.y))
        if not any(components):
            return
        owner = owner_of(force.point)
        way = self.pose.direction(components, owner if force.frame == "body" else GROUND)
        tip = self.pose.at(force.point) - 0.5 * _HEAD * self.unit * way
        tail = tip - _ARROW * self.unit * way
        self._arrow(tail, tip, self.pose.colours[owner], varies(force.x) or varies(force.y))
        self.clutter.add(tail, tip, 0.0)
        self.named.append((tail, force.name, 0.0))

    def _arrow_head(self, foot: Array, direction: Array, colour: str) -> None:
        way, across, _ = along(np.zeros(2), direction)
        size = _HEAD * self.unit
        corners = [foot + size * way, foot + 0.45 * size * across, foot - 0.45 * size * across]
        self._polygon(np.array(corners), colour, 8, alpha=1.0)

    # Frame and text

    def finish(self, gravity: Array, labels: bool) -> None:
        """Labels, the factor of exaggeration, gravity and the axes."""
        ax = self.ax
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("x [m]")
        ax.set_ylabel("y [m]")
        ax.margins(0.18)
        ax.autoscale_view()
        if labels:
            self._labels()
        clearance = [joint for joint in self.pose.scene.joints if isinstance(joint, ClearanceRevolute)]
        if clearance and self.exaggerate != 1.0:
            ax.text(
                0.02,
                0.02,
                f"clearances drawn {self.exaggerate:g} times larger",
                transform=ax.transAxes,
                fontsize="small",
                color="0.3",
                zorder=10,
            )
        strength = float(np.hypot(*gravity))
        if strength > 0.0:
            tail = (0.94, 0.90)
            ax.annotate(
                "",
                xy=(tail[0] + 0.1 * gravity[0] / strength, tail[1] + 0.1 * gravity[1] / strength),
                xytext=tail,
                xycoords="axes fraction",
                arrowprops={"arrowstyle": "-|>", "color": "0.1", "linewidth": 1.3},
                zorder=10,
            )
            ax.text(
                tail[0],
                tail[1] + 0.02,
                f"{strength:.4g} m/s²",
                transform=ax.transAxes,
                ha="center",
                fontsize="small",
                zorder=10,
            )

    def _labels(self) -> None:
        box = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7}
        width, height = _LETTER[0] * self.unit, _LETTER[1] * self.unit
        for body in self.pose.scene.bodies:
            spot: Array = np.mean(self.pose.points[body.name], axis=0)
            half = np.array([0.5 * width * len(body.name), 0.0])
            self.clutter.add(spot - half, spot + half, 0.5 * height)
            self.ax.text(
                spot[0],
                spot[1],
                body.name,
                fontsize="small",
                weight="bold",
                color=self.pose.colours[body.name],
                ha="center",
                va="center",
                bbox=box,
                zorder=9,
            )
        for place, names, radius in self._joints_by_place():
            text = ", ".join(names)
            away = place - self.pose.centre
            outward = away / (np.hypot(*away) or 1.0)
            size = (width * len(text), height)
            anchor, across, up = self.clutter.place(place, radius + 0.012 * self.unit, size, outward)
            self.ax.text(
                anchor[0],
                anchor[1],
                text,
                fontsize="x-small",
                style="italic",
                color="0.25",
                ha=across,
                va=up,
                bbox=box,
                zorder=9,
            )

    def _joints_by_place(self) -> Iterator[tuple[Array, list[str], float]]:
        """Joints that lie on each other share a label."""
        left = list(self.named)
        while left:
            place = left[0][0]
            near = [item for item in left if np.hypot(*(item[0] - place)) < 0.02 * self.unit]
            left = [item for item in left if not any(item is other for other in near)]
            yield place, [name for _, name, _ in near], max(radius for _, _, radius in near)

    # Strokes

    def _polygon(self, corners: Array, colour: str, layer: float, alpha: float) -> None:
        from matplotlib.colors import to_rgba
        from matplotlib.patches import Polygon

        self.ax.add_patch(
            Polygon(
                corners,
                closed=True,
                facecolor=to_rgba(colour, alpha),
                edgecolor=colour,
                linewidth=1.0,
                zorder=layer,
            )
        )

    def _disc(
        self,
        centre: Array,
        radius: float,
        face: str,
        edge: str,
        layer: float,
        *,
        width: float = 1.0,
        alpha: float = 1.0,
    ) -> None:
        from matplotlib.colors import to_rgba
        from matplotlib.patches import Circle

        self.ax.add_patch(
            Circle(
                tuple(centre),
                radius,
                facecolor=to_rgba(face, alpha),
                edgecolor=edge,
                linewidth=width,
                zorder=layer,
            )
        )

    def _line(self, points: Sequence[Array] | Array, colour: str, width: float, layer: float) -> None:
        x, y = np.array(points).T
        self.ax.plot(x, y, color=colour, linewidth=width, zorder=layer, solid_capstyle="round")
