"""Reading scene files, TOML or JSON that `Scene.to_json` wrote: every problem at once, with its line."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import Field, fields
from pathlib import Path as FilePath
from typing import Any

from ..base.arguments import as_number, did_you_mean
from ..base.quantities import Interval
from ..errors import Problem, SceneError
from ..run.settings import METHODS
from ..scene.scene import Scene
from ..scene.schema import Part, at_or_below
from .expressions import Expression, ExpressionError, parse
from .template import Parameter, Template, evaluated, path_text
from .toml_text import MOST_CHARACTERS, Path, Place, read_toml
from .units import UnitError, convert, is_quantity, parse_unit

FORMAT = 1
"""Number of the scene file format."""
MOST_PARAMETERS = 200
RUN_UNITS = {
    "duration": "s",
    "samples": "-",
    "skip": "s",
    "rtol": "-",
    "position_tolerance": "m",
    "velocity_tolerance": "m/s",
    "max_steps": "-",
    "max_events": "-",
}
"""Numbers of the table ``run``, with their units."""
_WHOLE = ("samples", "max_steps", "max_events")
_PARAMETER_KEYS = ("nominal", "rel", "plus", "minus", "limits", "unit", "note")
_HEAD = ("format", "title", "parameters", "run")


def load(path: str | os.PathLike[str]) -> Template:
    """Read a scene file.

    Parameters
    ----------
    path : path
        A TOML file, see the documentation of scene files; or JSON that `Scene.to_json` wrote.

    Returns
    -------
    Template
        Called with values of its parameters it gives the `Scene`; ``template.study()`` is the study of its
        intervals.

    Raises
    ------
    SceneError
        With every problem that was found, each with its line and column and what would be accepted.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import chebclear as cc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "crank.json")
    ...     count = path.write_text(cc.mechanisms.slider_crank().to_json())
    ...     scene = cc.load(path)()
    >>> scene == cc.mechanisms.slider_crank()
    True
    """
    path = FilePath(path)
    with path.open("rb") as file:
        content = file.read(4 * MOST_CHARACTERS + 1)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError([(path.name, f"is not UTF-8 text: {error.reason} at byte {error.start}")]) from None
    return loads(text, path.name)


def loads(text: str, name: str = "scene") -> Template:
    """Read the text of a scene file.

    Parameters
    ----------
    text : str
        TOML, or JSON that `Scene.to_json` wrote.
    name : str
        What problems call the file.

    Returns
    -------
    Template

    Raises
    ------
    SceneError
        As `load`.

    Examples
    --------
    >>> from chebclear import loads
    >>> text = '''
    ... format = 1
    ... bodies = [{ name = "bob", mass = "2 kg", inertia = 0.01, points.A = [0, "10 cm"] }]
    ... joints = [{ type = "revolute", name = "pin", a = "ground", b = "bob.A" }]
    ... '''
    >>> loads(text)().bodies[0].points["A"]
    (0.0, 0.1)
    """
    places: Mapping[Path, Place] = {}
    try:
        if text.lstrip()[:1] == "{":
            values = _read_json(text)
        else:
            values, places = read_toml(text)
        return _Reader(values).template()
    except SceneError as error:
        raise SceneError(_located(error.problems, places, text, name)) from None


def _read_json(text: str) -> dict[str, Any]:
    if len(text) > MOST_CHARACTERS:
        raise SceneError([("file", f"has {len(text)} characters; at most {MOST_CHARACTERS} are accepted")])
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError([("file", f"is not valid JSON: {error}")]) from None
    assert isinstance(values, dict)
    return values


def _located(
    problems: Iterable[Problem], places: Mapping[Path, Place], text: str, name: str
) -> list[Problem]:
    """Problems in the order of the file, each with line, column and the line itself."""
    lines = text.replace("\r\n", "\n").split("\n")
    by_text = {path_text(path): place for path, place in places.items()}
    found: list[tuple[tuple[int, int], Problem]] = []
    for problem in problems:
        path, place = problem.path, by_text.get(problem.path)
        while place is None and path:
            # A missing field stands where its table begins.
            path = path[: max(path.rfind("."), path.rfind("["), 0)]
            place = by_text.get(path)
        if place is None:
            found.append(((0, 0), Problem(f"{name}: {problem.path}", problem.message)))
            continue
        column = (
            place.key_column if problem.message.startswith(("unknown key", "unknown field")) else place.column
        )
        where = f"{name}:{place.line}:{column}: {problem.path}"
        shown = f"{problem.message}\n    | {lines[place.line - 1]}\n    | {' ' * (column - 1)}^"
        found.append(((place.line, column), Problem(where, shown)))
    return [problem for _, problem in sorted(found, key=lambda one: one[0])]


class _Reader:
    """Goes once over the plain values of a file and notes every problem."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values
        self.problems: list[Problem] = []
        self.expressions: list[tuple[Path, Expression]] = []
        self.constants: dict[str, float] = {}

    def template(self) -> Template:
        self._check_head()
        parameters = self._parameters()
        run = self._run()
        names = [item.name for item in fields(Scene)]
        for key in self.values:
            if key not in (*names, *_HEAD):
                self._note((key,), f"unknown key{did_you_mean(key, (*names, *_HEAD))}")
        scene = self._part({key: value for key, value in self.values.items() if key in names}, (Scene,), ())
        if not isinstance(scene, dict):
            raise SceneError(self.problems)
        template = Template(
            title=self.values.get("title", ""),
            parameters=parameters,
            run=run,
            source=self.values,
            _scene=scene,
            _expressions=tuple(self.expressions),
        )
        self._check_scene(template)
        if self.problems:
            raise SceneError(self.problems)
        return template

    def _check_head(self) -> None:
        form = self.values.get("format", FORMAT)
        if form != FORMAT or isinstance(form, bool):
            self._note(("format",), f"must be {FORMAT}, the format of this version, got {form!r}")
        if not isinstance(self.values.get("title", ""), str):
            self._note(("title",), f"must be a text, got {self.values['title']!r}")
            self.values = {**self.values, "title": ""}

    def _check_scene(self, template: Template) -> None:
        """What only the whole scene shows, at the nominal values."""
        broken = bool(self.problems)
        try:
            template.scene().check()
        except SceneError as error:
            seen = {problem.path for problem in self.problems}
            # After a problem of its own the scene holds stand-ins: what the core says of those is no news.
            self.problems += [
                problem
                for problem in error.problems
                if not broken
                or not any(
                    at_or_below(problem.path, path) or at_or_below(path, problem.path) for path in seen
                )
            ]

    # --- parameters

    def _parameters(self) -> dict[str, Parameter]:
        given = self.values.get("parameters", {})
        if not isinstance(given, Mapping):
            self._note(("parameters",), f"must be a table, got {given!r}")
            return {}
        if len(given) > MOST_PARAMETERS:
            self._note(("parameters",), f"has {len(given)} entries; at most {MOST_PARAMETERS} are accepted")
            return {}
        nominal: dict[str, float | Expression] = {}
        before = len(self.problems)
        for name, value in given.items():
            path: Path = ("parameters", name)
            if not name.isascii() or not name.isidentifier():
                self._note(path, "a parameter is named by letters, digits and _, beginning with a letter")
            if isinstance(value, Mapping):
                self._check_keys(value, path)
                if "limits" in value and "nominal" not in value:
                    continue  # the middle of its limits
                if "nominal" not in value:
                    self._note(path, "misses nominal, or limits")
                    continue
                value = value["nominal"]
                path = (*path, "nominal")
            number = self._number(value, "unit", path)
            if number is not None:
                nominal[name] = number
        for name, value in given.items():
            # Limits first: their middle may be what others follow.
            if isinstance(value, Mapping) and "limits" in value and "nominal" not in value:
                side = self._limits(value["limits"], ("parameters", name, "limits"))
                if side is not None:
                    nominal[name] = side.midpoint
        if len(self.problems) == before:
            try:
                self.constants = evaluated({name: nominal[name] for name in given})
            except SceneError as error:
                self.problems += error.problems
        parameters = {}
        for name, value in given.items():
            facts = value if isinstance(value, Mapping) else {}
            if name in nominal:
                parameters[name] = Parameter(
                    name,
                    nominal[name],
                    self._interval(name, facts),
                    self._unit_of(name, value),
                    str(facts.get("note", "")),
                )
        return parameters

    def _check_keys(self, value: Mapping[str, Any], path: Path) -> None:
        for key in value:
            if key not in _PARAMETER_KEYS:
                hint = did_you_mean(key, _PARAMETER_KEYS)
                hint = hint or '; an interval is given by "rel", by "plus" and "minus", or by "limits"'
                self._note((*path, key), f"unknown key{hint}")
        ways = [way for way in (("rel",), ("plus", "minus"), ("limits",)) if any(key in value for key in way)]
        if len(ways) > 1:
            words = " and ".join("/".join(way) for way in ways)
            self._note(path, f"gives its interval in two ways, by {words}; give one")

    def _unit_of(self, name: str, value: Any) -> str:
        if isinstance(value, Mapping):
            if "unit" in value:
                try:
                    parse_unit(str(value["unit"]))
                except UnitError as error:
                    self._note(("parameters", name, "unit"), str(error))
                return str(value["unit"])
            value = value.get("nominal", (value.get("limits") or [""])[0] if "limits" in value else "")
        return value.split(maxsplit=1)[1] if isinstance(value, str) and is_quantity(value) else ""

    def _interval(self, name: str, facts: Mapping[str, Any]) -> Interval | None:
        path: Path = ("parameters", name)
        if "limits" in facts:
            return self._limits(facts["limits"], (*path, "limits"))
        middle = self.constants.get(name)
        if middle is None or not any(key in facts for key in ("rel", "plus", "minus")):
            return None
        if "rel" in facts:
            rel = self._constant(facts["rel"], (*path, "rel"), "-")
            if rel is None:
                return None
            if not 0.0 < rel < 1.0:
                self._note(
                    (*path, "rel"), f"must be above 0 and below 1, the half-width over the value, got {rel!r}"
                )
                return None
            plus = minus = rel * abs(middle)
            key = "rel"
        else:
            sides = [
                self._constant(facts[key], (*path, key)) if key in facts else 0.0 for key in ("plus", "minus")
            ]
            key = "plus" if "plus" in facts else "minus"
            if sides[0] is None or sides[1] is None:
                return None
            plus, minus = sides[0], sides[1]
            if plus < 0.0 or minus < 0.0:
                self._note((*path, key), "plus and minus are distances from nominal, at least 0")
                return None
        if not middle - minus < middle + plus:
            self._note((*path, key), "the interval has no width")
            return None
        return Interval(middle - minus, middle + plus)

    def _limits(self, value: Any, path: Path) -> Interval | None:
        if not isinstance(value, list) or len(value) != 2:
            self._note(path, f"must be a pair [lower, upper], got {value!r}")
            return None
        ends = [self._constant(end, (*path, index)) for index, end in enumerate(value)]
        if ends[0] is None or ends[1] is None:
            return None
        if not ends[0] < ends[1]:
            self._note(path, f"the lower limit must come first, got {value!r}")
            return None
        return Interval(ends[0], ends[1])

    def _constant(
        self, value: Any, path: Path, unit: str = "unit", known: Mapping[str, float] | None = None
    ) -> float | None:
        """A number that follows no parameters but the known ones."""
        number = self._number(value, unit, path)
        if not isinstance(number, Expression):
            return number
        try:
            return number.evaluate(known or {})
        except ExpressionError as error:
            more = "" if known else "; no parameters are known here"
            self._note(path, f'"{number.text}" {error}{more}')
            return None

    # --- run

    def _run(self) -> dict[str, Any]:
        given = self.values.get("run", {})
        known = (*RUN_UNITS, "method", "outputs")
        if not isinstance(given, Mapping):
            self._note(("run",), f"must be a table, got {given!r}")
            return {}
        run: dict[str, Any] = {}
        for key, value in given.items():
            path = ("run", key)
            if key in RUN_UNITS:
                number = self._constant(value, path, RUN_UNITS[key], self.constants)
                if number is not None:
                    run[key] = int(number) if key in _WHOLE and number == int(number) else number
            elif key == "method":
                if value not in METHODS:
                    self._note(
                        path,
                        f"must be one of {', '.join(METHODS)}, got {value!r}{did_you_mean(value, METHODS)}",
                    )
                run[key] = value
            elif key == "outputs":
                if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
                    self._note(path, f"must be a list of names of outputs, got {value!r}")
                run[key] = value
            else:
                self._note(path, f"unknown key{did_you_mean(key, known)}")
        return run

    # --- scene

    def _part(self, plain: Any, accepted: tuple[type[Part], ...], path: Path) -> Any:
        """Plain values of a record, with zeros where expressions stand; the scene itself reads the rest."""
        if not isinstance(plain, Mapping):
            return plain
        part = accepted[0]
        if part._tag is not None:
            words = {choice._tag[1]: choice for choice in accepted if choice._tag is not None}
            part = words.get(plain.get(part._tag[0], ""), part)
        known = {item.name: item for item in fields(part)}  # type: ignore[arg-type]
        return {
            name: self._field(value, known[name], part, (*path, name)) if name in known else value
            for name, value in plain.items()
        }

    def _field(self, value: Any, item: Field[Any], part: type[Part], path: Path) -> Any:
        annotation, unit = str(item.type), str(item.metadata.get("unit", "unit"))
        choices = part._choices.get(item.name)
        if choices is not None:
            if isinstance(value, list):
                return [self._part(one, choices, (*path, index)) for index, one in enumerate(value)]
            if isinstance(value, Mapping):
                return self._part(value, choices, path)
        if annotation.startswith("float"):
            return self._stand_in(value, unit, path)
        if annotation in ("Vector", "Numbers") and isinstance(value, list):
            return [self._stand_in(one, unit, (*path, index)) for index, one in enumerate(value)]
        if annotation.startswith("Mapping") and isinstance(value, Mapping):
            return {
                name: [self._stand_in(one, unit, (*path, name, index)) for index, one in enumerate(position)]
                if isinstance(position, list)
                else position
                for name, position in value.items()
            }
        return value

    def _stand_in(self, value: Any, unit: str, path: Path) -> Any:
        """A number in SI units; zero, and a note of what to put there, for an expression."""
        if not isinstance(value, str):
            return value
        number = self._number(value, unit, path)
        if not isinstance(number, Expression):
            return 0.0 if number is None else number
        unknown = [name for name in sorted(number.names) if name not in self.values.get("parameters", {})]
        if unknown:
            hint = did_you_mean(unknown[0], self.values.get("parameters", {}))
            self._note(path, f'"{number.text}": unknown name "{unknown[0]}"{hint}')
            return 0.0
        if number.names:
            self.expressions.append((path, number))
            return 0.0
        try:
            return number.evaluate({})
        except ExpressionError as error:
            self._note(path, f'"{number.text}" {error}')
            return 0.0

    def _number(self, value: Any, unit: str, path: Path) -> float | Expression | None:
        number = as_number(value)
        if number is not None:
            if math.isfinite(number):
                return number
            self._note(path, f"must be a finite number, got {value!r}")
            return None
        if not isinstance(value, str):
            self._note(path, f'must be a number, a quantity such as "20 mm" or an expression, got {value!r}')
            return None
        try:
            return convert(value, unit) if is_quantity(value) else parse(value)
        except UnitError as error:
            self._note(path, f'"{value}": {error}')
        except ExpressionError as error:
            self._note(path, f'"{value}" {error}')
        return None

    def _note(self, path: Path, message: str) -> None:
        self.problems.append(Problem(path_text(path), message))
