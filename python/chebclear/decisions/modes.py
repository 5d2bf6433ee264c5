"""Natural frequencies and modes of a mechanism about a state, by the exact derivatives of accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.prefixes import format_quantity
from ..base.rows import Array
from ..base.units import unit
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentError, ArgumentTypeError, warn
from ..report import html
from ..report.document import Table
from ..run.trajectory import EndState
from ..scene.scene import Scene, compiled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..plots.animation.animate import Animation

# Acceleration, relative to the square of the speed over the size, up to which a state is at rest.
_AT_REST = 1e-6
# Singular value of the closures, relative to the largest, below which a direction is free.
_FREE = 1e-9
# Eigenvalue, relative to the largest, that is a rounding error: the motion is neither pulled back nor away.
_NEUTRAL = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Modes(html.Tabled, records.Saved, Exports, kind="modes"):
    """Small free motions about a state; see `modes`.

    Attributes
    ----------
    frequencies : Array
        Natural frequency of each mode that oscillates, ascending [Hz], shape (modes,).
    damping : Array
        Damping ratio of each [-]: 1 is critical; negative ones grow.
    shapes : Array
        How each body moves in each mode, complex: changes of x, y [m] and angle [rad] of its frame, scaled so
        that the largest displacement at the size of the mechanism is 1, shape (modes, bodies, 3).
    decays : Array
        Rates of the motions that do not oscillate [1/s]; positive ones grow, shape (decays,).
    bodies : tuple[str, ...]
        Names of the bodies.
    poses : Array
        Position x, y [m] and angle [rad] of each, shape (bodies, 3).
    at_rest : bool
        Whether the state is an equilibrium; else the modes are those of an instant.
    scene : Scene
        The mechanism.
    """

    _axes: ClassVar = {
        "frequencies": ("modes",),
        "damping": ("modes",),
        "shapes": ("modes", "bodies", 3),
        "decays": ("decays",),
        "poses": ("bodies", 3),
    }

    frequencies: Array = field(metadata=unit("Hz"))
    damping: Array
    shapes: NDArray[np.complex128]
    decays: Array = field(metadata=unit("1/s"))
    bodies: tuple[str, ...]
    poses: Array
    at_rest: bool
    scene: Scene

    def __len__(self) -> int:
        return len(self.frequencies)

    @property
    def table(self) -> Table:
        """One row for each mode: frequency, damping, and the body that moves most."""
        rows = []
        for index, (frequency, ratio) in enumerate(zip(self.frequencies, self.damping, strict=True)):
            sizes = np.abs(self.shapes[index]).max(axis=1)
            rows.append(
                [
                    str(index + 1),
                    format_quantity(float(frequency), "Hz", 4),
                    f"{float(frequency) * 60.0:.4g}",
                    f"{100.0 * float(ratio):.3g} %",
                    self.bodies[int(np.argmax(sizes))] if len(sizes) else "-",
                ]
            )
        head = ["mode", "frequency", "in r/min", "damping", "moves most"]
        return Table("Natural frequencies", head, rows)

    def dataset(self) -> Dataset:
        """A row for each mode, with the shapes by their real and imaginary parts, and the poses."""
        variables = {
            "mode": Variable(("mode",), np.arange(1, len(self) + 1), "-"),
            "frequency": Variable(("mode",), self.frequencies, "Hz"),
            "damping": Variable(("mode",), self.damping, "-"),
            "body": Variable(("body",), np.array(self.bodies)),
            "decays": Variable(("decay",), self.decays, "1/s"),
        }
        for k, (name, symbol) in enumerate((("x", "m"), ("y", "m"), ("angle", "rad"))):
            variables[f"poses.{name}"] = Variable(("body",), self.poses[:, k], symbol)
            shape = self.shapes[:, :, k]
            for part, values in (("real", shape.real), ("imaginary", shape.imag)):
                variables[f"shapes.{name}.{part}"] = Variable(("mode", "body"), values, symbol)
        return Dataset("mode", variables, facts_of(self) | {"scene": self.scene.to_json()})

    def __repr__(self) -> str:
        return f"<Modes: {len(self)} of {len(self.bodies)} bodies>"

    def __str__(self) -> str:
        lines = [f"{'at rest' if self.at_rest else 'at an instant of a motion'}: {len(self)} modes"]
        for row in self.table.rows:
            lines.append(f"  {row[0]}: {row[1]} ({row[2]} r/min), damping {row[3]}, {row[4]} moves most")
        growing = int(np.count_nonzero(self.decays > 0.0))
        if growing:
            lines.append(f"  unstable: {growing} motion{'s' if growing > 1 else ''} without oscillation grow")
        return "\n".join(lines)

    def plot(self, mode: int = 1, *, ax: Axes | None = None, size: float = 0.1) -> Axes:
        """Draw the mechanism and its two extreme positions in a mode, counted from 1.

        The largest displacement is drawn with `size`, relative to the size of the mechanism [-].
        """
        from ..plots.drawing.scene import plot_poses

        shape = self.shapes[self._index(mode, size)].real
        return plot_poses(
            self.scene, [self.poses, self.poses + size * shape, self.poses - size * shape], ax=ax
        )

    def animate(self, mode: int = 1, *, size: float = 0.1, frames: int = 40, rate: int = 25) -> Animation:
        """A period of a mode without its decay, in so many frames [-] at a rate of them [1/s]; as `plot`."""
        from ..plots.animation.animate import animate_mode

        return animate_mode(self, self._index(mode, size) + 1, size, frames, rate)

    def _index(self, mode: int, size: float) -> int:
        """The place of a mode, of which this size is drawn."""
        checks = Checks()
        index = checks.whole("mode", mode, least=1, most=max(1, len(self))) - 1
        size = checks.real("size", size, "-", above=0.0)
        checks.finish()
        if not len(self):
            raise ArgumentError("there is no mode: nothing oscillates")
        return index


def modes(scene: Scene, state: EndState | None = None) -> Modes:
    """Natural frequencies, damping and shapes of small free motions of a mechanism.

    They follow from the exact derivatives of the accelerations, with all loops closed. At the start of a
    scene its contacts are open; at the end of a run they are as they are there: let a run come to rest to
    have them closed under their load. Drives hold their coordinates.

    Parameters
    ----------
    scene : Scene
        The mechanism.
    state : EndState, optional
        The end of a run of it, ``run.end``; its start if not given.

    Raises
    ------
    ValueError, TypeError
        If the state is of another mechanism or nothing can move freely.
    SceneError
        If the scene cannot be simulated.

    Examples
    --------
    >>> import chebclear as cc
    >>> block = cc.Body("block", mass=2.0, inertia=1.0)
    >>> rail = cc.Prismatic("rail", "ground", "block", axis=(1.0, 0.0))
    >>> spring = cc.Spring("spring", "ground.far", "block", stiffness=200.0, length=1.0)
    >>> scene = cc.Scene([block], [rail], [spring], ground={"far": (-1.0, 0.0)})
    >>> print(cc.modes(scene))
    at rest: 1 modes
      1: 1.592 Hz (95.49 r/min), damping 0 %, block moves most
    """
    if not isinstance(scene, Scene):
        raise ArgumentTypeError(f"scene must be a Scene, got {scene!r:.80}")
    if state is not None and not isinstance(state, EndState):
        raise ArgumentTypeError(f"state must be the end of a run, run.end, got {state!r:.80}")
    mechanism = compiled(scene)
    found = mechanism.small_motions(None if state is None else state.memory)
    free = _free_directions(found["closures"], found["levers"])
    if free.shape[1] == 0:
        raise ArgumentError("the drives prescribe the whole motion: nothing moves freely")
    count = free.shape[1]
    reduced = [np.linalg.pinv(free) @ found[name] @ free for name in ("by_position", "by_velocity")]
    matrix = np.block([[np.zeros((count, count)), np.eye(count)], reduced])
    values, vectors = np.linalg.eig(matrix)
    speeds, lengths, levers = (np.asarray(found[name]) for name in ("speeds", "lengths", "levers"))
    rates = np.where(speeds > 0.0, speeds / lengths, np.abs(values).max())
    at_rest = bool(np.all(np.abs(found["accelerations"]) * levers <= _AT_REST * rates**2 * lengths))
    if not at_rest:
        warn("the state is no equilibrium: the modes are those of an instant, not of a rest position")
    # Rounding splits a double zero into roots of a rounding error.
    neutral = math.sqrt(_NEUTRAL) * max(float(np.abs(values).max()), float(rates.max()))
    oscillating = [k for k, value in enumerate(values) if value.imag > neutral]
    oscillating.sort(key=lambda k: abs(values[k]))
    chosen = values[oscillating]
    bodies = tuple(body.name for body in scene.bodies)
    moved = (found["bodies"] @ free).astype(complex) @ vectors[:count]
    shapes = [_shape(moved[:, k], found["length"]) for k in oscillating]
    return Modes(
        np.abs(chosen) / (2.0 * np.pi),
        -chosen.real / np.abs(chosen) + 0.0,  # no -0
        np.array(shapes, dtype=complex).reshape(len(oscillating), len(bodies), 3),
        np.sort(values.real[(np.abs(values.imag) <= neutral) & (np.abs(values.real) > neutral)]),
        bodies,
        np.array(found["poses"]).reshape(len(bodies), 3),
        at_rest,
        scene,
    )


def _free_directions(closures: Array, levers: list[float]) -> Array:
    """Directions of the coordinates in which all loops stay closed, shape (coordinates, directions)."""
    # In displacements of points, so that angles and lengths count alike.
    weights = np.array([1.0 / lever if lever > 0.0 else 1.0 for lever in levers])
    if not len(closures):
        return np.diag(weights)
    _, values, rows = np.linalg.svd(closures * weights)
    rank = int(np.count_nonzero(values > _FREE * values.max()))
    free: Array = weights[:, None] * rows[rank:].T
    return free


def _shape(moved: NDArray[np.complex128], length: float) -> NDArray[np.complex128]:
    """A shape whose largest displacement, with angles at the size of the mechanism, is that size and real."""
    by_body = moved.reshape(-1, 3)
    sizes = by_body * np.array([1.0, 1.0, length])
    largest = sizes.ravel()[int(np.argmax(np.abs(sizes)))]
    scaled: NDArray[np.complex128] = by_body * (length / largest)
    return scaled
