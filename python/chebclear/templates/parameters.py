"""The table ``[parameters]`` of a scene file: named numbers, their intervals, and expressions of others."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from typing import Any

from ..base.arguments import as_whole
from ..base.quantities import Interval
from ..base.shown import did_you_mean
from ..base.units import UnitError, parse_unit, written
from ..errors import ArgumentError, ArgumentTypeError, Problem
from ..scene.distributions import FILE_KEYS, Distribution, inspected
from .changes import written_unit
from .expressions import CONSTANTS, FUNCTIONS, Expression
from .fits import FitError, radial_clearance
from .template import Parameter, evaluation
from .toml_text import Path
from .values import Values

# Each may follow the one before it: so many are within the depth of Python's recursion.
MOST_PARAMETERS = 200
DISTRIBUTIONS = {
    kind.written_as.rpartition(".")[2]: kind for kind in Distribution.kinds.values() if kind.in_words
}
"""How often the values of an interval may be said to occur."""
KEYS = (
    *("nominal", "rel", "plus", "minus", "limits", "fit", "distribution"),
    *FILE_KEYS,
    *("unit", "note"),
)
"""What the table of a parameter may hold."""
# Each gives an interval, and only one may.
_WAYS = (("rel",), ("plus", "minus"), ("limits",), ("fit",))
# These give an interval with their distribution.
_DRAWN = tuple(name for name, key in FILE_KEYS.items() if key.gives_interval)
# These have a middle, which is the nominal value unless another is given.
_CLOSED = ("limits", "fit", *_DRAWN)
_FIT = re.compile(r"\s*[\d.]+\s*[A-Za-z]{1,2}\d{1,2}\s*/\s*[A-Za-z]{1,2}\d{1,2}\s*", re.ASCII)


def read_parameters(given: Any, values: Values) -> dict[str, Parameter]:
    """The parameters of a file by name; notes their nominal values, and those that have none."""
    if not isinstance(given, Mapping):
        values.note(("parameters",), f"must be a table, got {given!r}")
        return {}
    if len(given) > MOST_PARAMETERS:
        values.note(("parameters",), f"has {len(given)} entries; at most {MOST_PARAMETERS} are accepted")
        values.lost |= set(given)
        return {}
    return _Reader(given, values).read()


class _Reader:
    """Goes over the parameters: the closed intervals first, whose middle others may follow."""

    def __init__(self, given: Mapping[str, Any], values: Values) -> None:
        self.given = given
        self.values = values
        self.facts = {name: value if isinstance(value, Mapping) else {} for name, value in given.items()}
        self.units = {name: self._unit(name) for name in given}
        self.closed: dict[str, Interval] = {}
        self.drawn: dict[str, Distribution | None] = {}

    def read(self) -> dict[str, Parameter]:
        for name, facts in self.facts.items():
            self._check_name(name)
            self._check_keys(name, facts)
            side = self._closed_interval(name, facts)
            if any(key in facts for key in _DRAWN):
                one = self.drawn[name] = self._distribution(name, side)
                side = None if one is None else one.interval
            if side is not None:
                self.closed[name] = side
        nominal = self._nominal()
        named = {name: nominal[name] for name in self.given if name in nominal}
        self.values.constants, problems = evaluation(named, self.given.keys() - named.keys())
        self.values.lost |= self.given.keys() - self.values.constants.keys()
        self.values.problems += problems
        return {name: self._parameter(name, nominal[name]) for name in self.given if name in nominal}

    def _parameter(self, name: str, nominal: float | Expression) -> Parameter:
        side, unit = self._interval(name), self.units[name]
        drawn = self.drawn[name] if name in self.drawn else self._distribution(name, side)
        return Parameter(
            name,
            nominal,
            None if side is None else side.in_unit(unit),
            unit,
            self._note(name),
            None if drawn is None else drawn.in_unit(unit),
        )

    def _check_name(self, name: str) -> None:
        if not name.isascii() or not name.isidentifier():
            self.values.note(
                ("parameters", name), "a parameter is named by letters, digits and _, beginning with a letter"
            )
        elif name in CONSTANTS or name in FUNCTIONS or keyword.iskeyword(name):
            what = "constant" if name in CONSTANTS else "function" if name in FUNCTIONS else "word"
            self.values.note(
                ("parameters", name), f'"{name}" is a {what} of expressions: give the parameter another name'
            )

    def _check_keys(self, name: str, facts: Mapping[str, Any]) -> None:
        path: Path = ("parameters", name)
        for key in facts:
            if key not in KEYS:
                hint = did_you_mean(key, KEYS)
                hint = hint or (
                    '; an interval is given by "rel", by "plus" and "minus", by "limits", or by "fit"'
                )
                self.values.unknown((*path, key), hint)
        ways = [way for way in _WAYS if any(key in facts for key in way)]
        if len(ways) > 1:
            words = " and ".join("/".join(way) for way in ways)
            self.values.note(path, f"gives its interval in two ways, by {words}; give one")
        own = [key for key in _DRAWN if key in facts]
        others = [key for key in ("rel", "plus", "minus", "fit") if key in facts]
        if own and others:
            hint = "; limits may stand beside a sample" if "sample" in own else ""
            self.values.note(
                path, f"gives its interval in two ways, by {own[0]} and {others[0]}; give one{hint}"
            )

    def _closed_interval(self, name: str, facts: Mapping[str, Any]) -> Interval | None:
        """The interval whose ends stand in the file or in the tables of fits."""
        if "limits" in facts:
            return self._limits(name, facts["limits"])
        if "fit" not in facts:
            return None
        path: Path = ("parameters", name, "fit")
        if not isinstance(facts["fit"], str):
            self.values.note(path, f'must be a text such as "25 H7/f6", got {facts["fit"]!r}')
            return None
        try:
            return radial_clearance(facts["fit"])
        except FitError as error:
            self.values.note(path, f'"{facts["fit"]}" {error}')
            return None

    def _limits(self, name: str, value: Any) -> Interval | None:
        path: Path = ("parameters", name, "limits")
        if not isinstance(value, list) or len(value) != 2:
            self.values.note(path, f"must be a pair [lower, upper], got {value!r}")
            return None
        unit = self.units[name] or "unit"
        ends = [
            self.values.constant(end, (*path, index), unit, alone=True) for index, end in enumerate(value)
        ]
        if ends[0] is None or ends[1] is None:
            return None
        if not ends[0] < ends[1]:
            self.values.note(path, f"the lower limit must come first, got {value!r}")
            return None
        return Interval(ends[0], ends[1])

    def _nominal(self) -> dict[str, float | Expression]:
        """The nominal values as they are written: numbers and expressions."""
        nominal: dict[str, float | Expression] = {}
        for name, value in self.given.items():
            path: Path = ("parameters", name)
            if isinstance(value, Mapping):
                if "nominal" not in value:
                    if name in self.closed:
                        nominal[name] = self.closed[name].nominal
                    elif not any(key in value for key in _CLOSED):
                        self.values.note(path, "misses nominal, limits or a fit")
                    continue
                value, path = value["nominal"], (*path, "nominal")
            if isinstance(value, str) and _FIT.fullmatch(value):
                self.values.note(path, f'is an ISO fit: write {{ fit = "{value}" }} without a nominal value')
                continue
            number = self.values.number(value, self.units[name] or "unit", path)
            if number is not None:
                nominal[name] = number
        return nominal

    def _interval(self, name: str) -> Interval | None:
        facts, middle = self.facts[name], self.values.constants.get(name)
        closed = self.closed.get(name)
        if closed is not None:
            if middle is not None and not closed.lower <= middle <= closed.upper:
                ends = " to ".join(written(end, self.units[name]) for end in (closed.lower, closed.upper))
                self.values.note(
                    ("parameters", name, "nominal"), f"must be in the interval, {ends}: change both"
                )
                return closed
            return closed if middle is None else Interval.about(closed.lower, middle, closed.upper)
        if middle is None or not any(key in facts for key in ("rel", "plus", "minus")):
            return None
        sides = self._relative(name, middle) if "rel" in facts else self._distances(name)
        if sides is None:
            return None
        minus, plus = sides
        if not middle - minus < middle + plus:
            key = next(key for key in ("rel", "plus", "minus") if key in facts)
            self.values.note(("parameters", name, key), "the interval has no width")
            return None
        return Interval.about(middle - minus, middle, middle + plus)

    def _distribution(self, name: str, side: Interval | None) -> Distribution | None:
        """How often the values in the interval occur, if it is said."""
        path: Path = ("parameters", name)
        facts = self.facts[name]
        asked = [key for key in FILE_KEYS if key in facts]
        word = facts.get("distribution")
        if word is None:
            # What only one kind has, as a sample, says which it is.
            word = next((word for word, kind in DISTRIBUTIONS.items() if _says(asked, kind)), None)
        if word is None:
            for key in asked:
                self.values.note((*path, key), f"needs a distribution: {_kinds_with(key)}")
            return None
        if not isinstance(word, str) or word not in DISTRIBUTIONS:
            accepted = ", ".join(f'"{one}"' for one in DISTRIBUTIONS)
            self.values.note((*path, "distribution"), f"must be one of {accepted}, got {word!r}")
            return None
        kind = DISTRIBUTIONS[word]
        sorted_out = False
        given: dict[str, Any] = {}
        for key in asked:
            value = self._of_distribution(key, facts[key], (*path, key), self.units[name] or "unit")
            if key == "inspected":
                sorted_out = value is True
            elif key not in kind.file_keys:
                self.values.note((*path, key), f'does not go with "{word}": {_kinds_with(key)}')
            else:
                given[key] = value
        if any(self.values.has_problem((*path, key)) for key in asked):
            return None
        try:
            made = kind.in_file(side, given, facts)
            return self._inspected(made, side, path) if sorted_out else made
        except (ArgumentError, ArgumentTypeError) as error:
            for problem in error.problems:
                self._refuse(problem, facts, path)
            return None

    def _inspected(self, made: Distribution, side: Interval | None, path: Path) -> Distribution:
        """What is left of a distribution between the limits."""
        lower, upper = made.support
        if side is None:
            self.values.note((*path, "inspected"), "needs limits beside it")
            return made
        if side.lower <= lower and upper <= side.upper:
            self.values.note((*path, "inspected"), "changes nothing: no part is beyond the interval")
            return made
        return inspected(made, side.lower, side.upper)

    def _refuse(self, problem: Problem, facts: Mapping[str, Any], path: Path) -> None:
        """Note what a distribution refuses at its key, or at the interval."""
        key, _, place = problem.path.partition("[")
        where: Path = (*path, key) if key in facts or key in KEYS else path
        if place:  # of a list
            where = (*path, "sample", int(place.rstrip("]")))
        elif key == "values":
            where = (*path, "sample")
        elif key in ("lower", "upper") and "limits" in facts:
            where = path = (*path, "limits")
        message = problem.message if len(where) > len(path) else f"{key} {problem.message}"
        self.values.note(where, message)

    def _of_distribution(self, key: str, value: Any, path: Path, unit: str) -> Any:
        """What a key of a distribution holds, or None, and a note."""
        holds = FILE_KEYS[key].holds
        if holds == "yes or no":
            if not isinstance(value, bool):
                self.values.note(path, f"must be true or false, got {value!r}")
            return value
        if holds == "count":
            if as_whole(value) is None:
                self.values.note(path, f"must be a whole number, got {value!r}")
            return value
        if holds == "values":
            if not isinstance(value, list):
                self.values.note(path, f"must be a list of the values themselves, got {value!r}")
                return None
            return [
                self.values.constant(one, (*path, index), unit, alone=True) for index, one in enumerate(value)
            ]
        return self.values.constant(value, path, "-" if holds == "number" else unit, alone=True)

    def _relative(self, name: str, middle: float) -> tuple[float, float] | None:
        path: Path = ("parameters", name, "rel")
        rel = self.values.constant(self.facts[name]["rel"], path, "-", alone=True)
        if rel is None:
            return None
        if not 0.0 < rel < 1.0:
            self.values.note(path, f"must be above 0 and below 1, the half-width over the value, got {rel!r}")
            return None
        return rel * abs(middle), rel * abs(middle)

    def _distances(self, name: str) -> tuple[float, float] | None:
        facts, path = self.facts[name], ("parameters", name)
        minus, plus = (
            self.values.constant(facts[key], (*path, key), self.units[name] or "unit", alone=True)
            if key in facts
            else 0.0
            for key in ("minus", "plus")
        )
        if minus is None or plus is None:
            return None
        if plus < 0.0 or minus < 0.0:
            key = "plus" if "plus" in facts else "minus"
            self.values.note((*path, key), "plus and minus are distances from nominal, at least 0")
            return None
        return minus, plus

    def _unit(self, name: str) -> str:
        """The unit that is given, or that of the nominal value; all others of the parameter must fit it."""
        facts = self.facts[name]
        if "unit" in facts:
            try:
                parse_unit(str(facts["unit"]))
            except UnitError as error:
                self.values.note(("parameters", name, "unit"), str(error))
                return ""
            return str(facts["unit"])
        unit = written_unit(self.given[name])
        try:
            parse_unit(unit)
        except UnitError:  # reported where the value is read
            return ""
        return unit

    def _note(self, name: str) -> str:
        facts, side = self.facts[name], self.closed.get(name)
        note = str(facts.get("note", ""))
        if "fit" not in facts or side is None:
            return note
        ends = " to ".join(f"{2e6 * end:g}" for end in (side.lower, side.upper))
        words = f"radial; {facts['fit']} leaves {ends} um between the diameters"
        return f"{note}; {words}" if note else words


def _says(keys: list[str], kind: type[Distribution]) -> bool:
    """Whether a key means a kind without its word: all that this kind takes give an interval."""
    return any(key in kind.file_keys for key in keys) and all(
        key.gives_interval for key in kind.file_keys.values()
    )


def _kinds_with(key: str) -> str:
    """The kinds that a key may stand with, as a hint."""
    words = [word for word, kind in DISTRIBUTIONS.items() if key in kind.file_keys]
    return f'give distribution = "{words[0]}"' if words else "give one as well"
