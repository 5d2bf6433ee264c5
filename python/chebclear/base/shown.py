"""Names in words, what a wrong name may mean, and the ``repr`` of records, in at most twelve lines."""

from __future__ import annotations

import dataclasses
import difflib
import math
import textwrap
from collections.abc import Container, Iterable, Sequence

import numpy as np

MOST_LINES = 12
"""Most lines of a ``repr`` [-]."""
WIDTH = 100
"""Most characters of a line of a ``repr`` [-], unless a single field is longer."""


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names with commas; of many, the first ones and the number of the others.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c", "d"], most=2)
    ('a, b, c', 'a, b and 2 more')
    """
    known = list(names)
    if len(known) <= most:
        return ", ".join(known)
    return f"{', '.join(known[:most])} and {len(known) - most} more"


def in_a_sentence(names: Sequence[str]) -> str:
    """Names in a sentence; of many the first ones.

    >>> in_a_sentence(["slider.x", "slider.vx"]), in_a_sentence(list("abcdef"))
    ('slider.x and slider.vx', 'a, b, c and 3 more')
    """
    if len(names) > 4:
        return listed(names, most=3)
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def of_many(share: float) -> str:
    """A share in words, never rounded up: of a hundred, or of as many as its misses need to be counted.

    >>> of_many(0.9095), of_many(0.999), of_many(0.9999), of_many(0.5), of_many(float("nan"))
    ('90 of 100', '999 of 1,000', '9,999 of 10,000', '50 of 100', '-')
    """
    if math.isnan(share):
        return "-"
    rest = 1.0 - share
    # Of so many that about one misses; half of one is rounded down.
    every = max(100, 10 ** math.ceil(-math.log10(2.0 * rest) - 1e-9)) if rest > 1e-9 else 100
    return f"{math.floor(share * every + 1e-6):,} of {every:,}"


def capital(text: str) -> str:
    """A text that begins with a capital letter; the others stay, unlike with ``str.capitalize``."""
    return text[:1].upper() + text[1:]


def shortened(lines: Sequence[str], most: int = MOST_LINES) -> list[str]:
    """Lines, without the middle ones if there are too many.

    >>> shortened(["1", "2", "3", "4", "5"], most=3)
    ['1', '...', '5']
    """
    if len(lines) <= most:
        return list(lines)
    last = (most - 1) // 2
    return [*lines[: most - 1 - last], "...", *lines[len(lines) - last :]]


def spoken(record: object) -> str:
    """A ``repr`` from the ``str`` of a record, in lines of limited length."""
    lines = f"<{type(record).__name__}: {record}>".splitlines()
    return "\n".join(shortened([piece for line in lines for piece in textwrap.wrap(line, WIDTH)]))


class Shown:
    """Base of records whose ``repr`` fits a prompt: arrays by shape, long collections by length."""

    def __repr__(self) -> str:
        fields = [item for item in dataclasses.fields(self) if item.repr]  # type: ignore[arg-type]
        name = type(self).__name__
        lines, indent = [f"{name}("], " " * (len(name) + 1)
        for number, item in enumerate(fields):
            end = ")" if number == len(fields) - 1 else ","
            piece = f"{item.name}={_short(getattr(self, item.name))}{end}"
            gap = "" if lines[-1].endswith("(") or not lines[-1].strip() else " "
            if number and len(lines[-1]) + len(gap) + len(piece) > WIDTH:
                lines.append(indent + piece)
            else:
                lines[-1] += gap + piece
        return "\n".join(shortened(lines))


def _short(value: object) -> str:
    """A value in a line: arrays by their shape, long collections by their length."""
    if isinstance(value, np.ndarray):
        return f"<array {value.shape}>"
    named = isinstance(value, tuple) and hasattr(value, "_fields")
    text = str(value) if named else repr(value)
    if len(text) <= 80 and "\n" not in text:
        return text
    if isinstance(value, tuple | list | dict):
        return f"<{len(value)} entries>"
    return f"<{type(value).__name__}>"


# Longer names get no suggestion [-]: the time grows with the product of lengths, and nobody mistypes a line.
_LONGEST_NAME = 100
# Words of other programs and textbooks, and the names that they may mean, in groups. Short ones are letters
# of formulas.
_OTHER_WORDS = """
com cog cg cm centroid center_of_gravity = center_of_mass
j i izz moment_of_inertia = inertia
theta phi rot rotation = angle
omega = angular_velocity | speed
alpha = angular_acceleration
pos position = x y | displacement | angle
v vel velocity speed = vx vy | angular_velocity | lengthening | penetration_rate sliding_velocity | speed
a acc accel acceleration = ax ay | angular_acceleration
g = acceleration
m = mass
k = stiffness
c = damping | clearance
d = damping
e = restitution
t = time
mu = coefficient | sliding_coefficient
rest_length free_length natural_length = length
radius = journal_radius
direction = axis
play gap = clearance
depth indentation = penetration
force = normal_force friction_force | reaction_x reaction_y
reaction = reaction_x reaction_y
friction = friction_force
torque = reaction_torque
moment = torque | reaction_torque
max maximum highest largest upper = peak
min minimum smallest lower valley = lowest
range span ptp stroke swing amplitude pk2pk travel = peak_to_peak
argmax time_of_max time_of_maximum = time_of_peak
argmin time_of_min time_of_minimum = time_of_lowest
average avg median integral = mean
std root_mean_square effective = rms
hits count collisions contacts = impacts
energy_loss dissipation dissipated = loss
"""
_MEANT = {
    word: [group.split() for group in meant.split("|")]
    for words, _, meant in (line.partition("=") for line in _OTHER_WORDS.strip().splitlines())
    for word in words.split()
}


def synonyms(word: object, known: Container[str]) -> list[str]:
    """The known names that a word of another program or textbook may stand for.

    >>> synonyms("omega", {"speed"}), synonyms("Velocity", {"vx", "vy", "speed"})
    (['speed'], ['vx', 'vy'])
    """
    groups = ([name for name in group if name in known] for group in _MEANT.get(str(word).lower(), ()))
    return next(filter(None, groups), [])


def suggested(names: Iterable[str]) -> str:
    """``'; did you mean "..." or "..."?'``, or nothing without names."""
    words = " or ".join(f'"{name}"' for name in names)
    return f"; did you mean {words}?" if words else ""


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """``'; did you mean "..."?'`` with what a wrong name may stand for or is nearest to, or nothing."""
    if len(str(name)) > _LONGEST_NAME:
        return ""
    # Upper and lower case count least: "Slider.X" is closer to "slider.x" than to "slider.y".
    same = {other.lower(): other for other in known}
    nearest = difflib.get_close_matches(str(name).lower(), list(same), n=1)
    return suggested(synonyms(name, same.values()) or [same[one] for one in nearest])


def meant_or_known(name: object, known: Iterable[str], most: int = 12) -> str:
    """What `did_you_mean` says, or the known names if none is near.

    >>> meant_or_known("rod", ["rod_length", "clearance"]), meant_or_known("x", ["b", "a"])
    ('; did you mean "rod_length"?', '; known are b, a')
    """
    names = list(known)
    longer = [other for other in names if other.lower().startswith(str(name).lower())]
    hint = did_you_mean(name, names) or (suggested(longer) if len(longer) <= 3 else "")
    return hint if hint or not names else f"; known are {listed(names, most)}"
