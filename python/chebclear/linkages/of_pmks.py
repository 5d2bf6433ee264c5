"""Links of PMKS+, which hold a whole mechanism, and its files, which hold the same text.

The text is ``switches.scale.speed,step.units.joints..links..forces..selection`` and one or two checks. Whole
numbers are of base 64, behind a 0 if they are negative; others are thousandths. It is described in the
repository of PMKS+ (PMKS-Web/PMKSWeb, ``services/transcoding``).
"""

from __future__ import annotations

import cmath

from ..base.quantities import rpm
from ..errors import SceneError
from .linkage import Link, Linkage, Load, Slot

Record = list[str]

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
# Inch, centimeter, meter [m] with the mass [kg], moment of inertia [kg m²] and force [N] of each.
_UNITS = (
    (0.0254, 0.45359237, 0.45359237 * 0.0254**2, 4.4482216152605),
    (0.01, 1e-3, 1e-4, 1.0),
    (1.0, 1.0, 1.0, 1.0),
)
_CLOCKWISE, _WEIGHTLESS = 1 << 0, 1 << 8
_PRISMATIC, _INPUT, _GROUNDED, _WELDED, _SEALED = (1 << bit for bit in (0, 1, 2, 3, 5))
_LOCAL, _OUTWARD = 1 << 0, 1 << 1


def of_link(text: str) -> Linkage:
    """The mechanism that a link or a file of PMKS+ holds."""
    try:
        head, joints, links, forces, rest = _sections(text.strip().rpartition("?")[2])
        reader = _Reader(head, joints)
        reader.read_links(links)
        for joint in joints:
            reader.read_joint(joint)
        for force in forces:
            reader.read_force(force)
    except (ValueError, LookupError, ZeroDivisionError):
        problem = "is no link of PMKS+ in centimeters, inches or meters, or a damaged one: copy it again"
        raise SceneError([("link", problem)]) from None
    if "." in rest:
        extra = rest.partition(".")[2]
        reader.read.refuse("link", f'ends with "{extra:.20}", which is not read: gears, friction or the like')
    return reader.read


def _sections(text: str) -> tuple[Record, list[Record], list[Record], list[Record], str]:
    """The settings, the records of joints, links and forces, and the rest."""
    body, mark, digest = text.partition("*")
    if not body or body[-1] != _DIGITS[(len(body) - 1) % 62] or (mark and digest != _digest(body)):
        raise ValueError("the checks do not fit")
    *head, left = body[:-1].split(".", 4)
    lists: list[list[Record]] = []
    for _ in range(3):
        records = []
        while left and not left.startswith("."):
            record, _, left = left.partition(".")
            records.append(record.split(","))
        left = left[1:]
        lists.append(records)
    joints, links, forces = lists
    return head, joints, links, forces, left


def _digest(text: str) -> str:
    """The hash FNV-1a of 32 bits in six digits."""
    value = 0x811C9DC5
    for letter in text.encode():
        value = (value ^ letter) * 0x01000193 % 2**32
    return "".join(_DIGITS[value // 62**place % 62] for place in range(5, -1, -1))


def _bits(text: str) -> int:
    number = 0
    for letter in text:
        number = 64 * number + _DIGITS.index(letter)
    return number


def _whole(text: str) -> int:
    return -_bits(text[1:]) if text.startswith("0") else _bits(text)


def _decimal(text: str) -> float:
    return _whole(text) / 1000


class _Reader:
    """Makes a linkage of the records of a text."""

    def __init__(self, head: Record, joints: list[Record]) -> None:
        switches, speed, unit = _bits(head[0]), _whole(head[2].partition(",")[0]), _bits(head[3][:1])
        length, self.mass, self.inertia, self.force = _UNITS[unit]
        self.places = {joint[0][1:]: complex(_decimal(joint[2]), _decimal(joint[3])) for joint in joints}
        self.flags = {joint[0][1:]: _bits(joint[0][:1]) for joint in joints}
        self.blocks: dict[str, tuple[str, float]] = {}
        """Of each sliding joint that a block joins to a pin: the pin and the mass of the block [kg]."""
        self.read = Linkage("PMKS+", length_unit=length)
        self.read.crank_speed = rpm(-speed if switches & _CLOCKWISE else speed)
        self.read.gravity = None if switches & _WEIGHTLESS else (0.0, -9.81)
        for pin, flag in self.flags.items():
            if flag & _GROUNDED and not flag & _PRISMATIC:
                self.read.ground[pin] = self.places[pin]

    def read_links(self, links: list[Record]) -> None:
        inputs = {pin for pin, flag in self.flags.items() if flag & _INPUT}
        for kind, _, mass, inertia, x, y, _, *rest in links:
            root, name, pins = kind[0], kind[2:], rest[: rest.index("")]
            if root not in "YAMG":
                continue  # a part of a welded link, which is read as a whole
            if kind[1] == "P":
                self.blocks |= {a: (b, self.mass * _decimal(mass)) for a in pins for b in pins if a != b}
                continue
            pins.sort(key=lambda pin: pin not in inputs)  # the frame of a crank begins at its pin on ground
            link = Link.through(name, {pin: self.places[pin] for pin in pins})
            link.mass = self.mass * _decimal(mass)
            if root in "YG":
                link.inertia = self.inertia * _decimal(inertia)
            if root in "YM":
                link.center = self._inside(link, complex(_decimal(x), _decimal(y)))
            self.read.links[name] = link

    def _inside(self, link: Link, place: complex) -> complex:
        """A place in the frame of a link."""
        origin = self.places[next(iter(link.points))]
        return (place - origin) / cmath.rect(1.0, link.angle)

    def read_joint(self, joint: Record) -> None:
        pin = joint[0][1:]
        flag, read = self.flags[pin], self.read
        angle, carrier, first, second, speed, mass = (joint[4:] + [""] * 6)[:6]
        if flag & _INPUT:
            turning = [link.name for link in read.links.values() if pin in link.points]
            if pin not in read.ground or len(turning) != 1 or read.crank is not None:
                message = "is an input: one is read, that turns a single link against ground"
                read.refuse(f"joints.{pin}", message)
            else:
                read.crank = (turning[0], pin)
                read.crank_speed = rpm(_decimal(speed)) if speed else read.crank_speed
        if not flag & _PRISMATIC:
            return
        if flag & (_WELDED | _SEALED):
            read.refuse(f"joints.{pin}", "is a welded slider or a cylinder, which is not read")
        sliding, block = self.blocks.get(pin, (pin, 0.0))
        block = block or self.mass * _decimal(mass or "0")
        if flag & _GROUNDED:
            along = cmath.rect(1.0, _decimal(angle))
            read.slots.append(Slot(sliding, "ground", self.places[pin], along, block))
        else:
            points = read.links[carrier].points
            read.slots.append(Slot(sliding, carrier, points[first], points[second] - points[first], block))

    def read_force(self, force: Record) -> None:
        name, owner, flag = force[0][1:], force[1], _bits(force[0][:1])
        x, y, to_x, to_y, size = (_decimal(text) for text in force[3:8])
        if not flag & _OUTWARD:
            self.read.refuse(f"forces.{name}", "has its arrow inward; turn it outward")
        link, start = self.read.links[owner], complex(x, y)
        arrow = complex(to_x, to_y) - start
        vector = self.force * size * arrow / abs(arrow)
        frame = "ground"
        if flag & _LOCAL:
            vector, frame = vector / cmath.rect(1.0, link.angle), "body"
        self.read.forces.append(Load(name, owner, self._inside(link, start), vector, frame))
