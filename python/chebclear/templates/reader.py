"""Reading scene files, TOML or JSON that `Scene.to_json` wrote: every problem at once, with its line."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, fields
from typing import Any

from ..base.files import on_disk
from ..base.shown import did_you_mean, meant_or_known
from ..base.units import misfit, unit_of_quantity
from ..errors import ArgumentTypeError, Problem, SceneError, UnknownKey, is_plain
from ..scene.functions import Expression as FormulaOfMotion, names_of_motion
from ..scene.scene import Scene
from ..scene.schema import Part, at_or_below
from .changes import SECTIONS, changed
from .expressions import CausedProblem, Expression, ExpressionError, ExpressionProblem, by_cause, parse
from .parameters import KEYS, read_parameters
from .run_table import check_names, read_costs, read_features, read_requirements, read_run
from .template import Template, path_text
from .toml_text import MOST_CHARACTERS, Path, Place, pointed_at, read_toml
from .values import Values

_PLAIN_TEXT = re.compile(r"""(["'])(?!\1\1)[^\\]*?\1""")
FORMAT = 1
"""Number of the scene file format."""


def load(
    path: str | os.PathLike[str],
    *,
    changes: Mapping[str, Any] | None = None,
    workbook: str | os.PathLike[str] | None = None,
) -> Template:
    """Read a scene file.

    Parameters
    ----------
    path : path
        A TOML file, see the documentation of scene files; or JSON that `Scene.to_json` wrote.
    changes : mapping of str to object, optional
        Values that replace those of the file, by the name of a parameter or the way to the value, such as
        ``{"rod_length": "130 mm", "joints.wrist.clearance": 2e-4, "run.samples": 101}``; texts are
        quantities and expressions.
    workbook : path, optional
        An Excel workbook whose sheets ``parameters`` and ``requirements`` replace values of the file, see the
        documentation of workbooks; `changes` come after it. `Template.to_workbook` writes one.

    Returns
    -------
    Template
        Called with values of its parameters it gives the `Scene`; ``template.study()`` is the study of its
        intervals.

    Raises
    ------
    SceneError
        With every problem that was found, each with its line and column, or the cell of the workbook as in
        ``parameters!C4``, and what would be accepted.
    OSError
        If a file cannot be read.
    ImportError
        If there is a workbook and openpyxl is not installed.

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
    path = on_disk(path)
    with path.open("rb") as file:
        content = file.read(4 * MOST_CHARACTERS + 1)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError([(path.name, f"is not UTF-8 text: {error.reason} at byte {error.start}")]) from None
    return loads(text, path.name, changes=changes, workbook=workbook)


def loads(
    text: str,
    name: str = "scene",
    *,
    changes: Mapping[str, Any] | None = None,
    workbook: str | os.PathLike[str] | None = None,
) -> Template:
    """Read the text of a scene file.

    Parameters
    ----------
    text : str
        TOML, or JSON that `Scene.to_json` wrote.
    name : str
        What problems call the file.
    changes : mapping of str to object, optional
        As of `load`.
    workbook : path, optional
        As of `load`.

    Raises
    ------
    SceneError, OSError, ImportError
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
    if not isinstance(text, str) or not isinstance(name, str):
        raise ArgumentTypeError(f"text and name must be texts, got {text!r:.80} and {name!r:.80}")
    if changes is not None and not (
        isinstance(changes, Mapping) and all(isinstance(key, str) for key in changes)
    ):
        raise ArgumentTypeError(f"changes must map names to values, got {changes!r:.80}")
    places: Mapping[Path, Place] = {}
    replaced: list[str] = []
    cells: Mapping[str, str] = {}
    wrong: list[Problem] = []
    try:
        if text.lstrip()[:1] == "{" or name.endswith(".json"):
            values = _read_json(text)
        else:
            values, places = read_toml(text)
        if workbook is not None:
            # Here, as it takes the results of studies.
            from .workbook import with_workbook

            values, cells, wrong = with_workbook(values, workbook, KEYS)
        if changes:
            values, paths = changed(values, changes)
            replaced = [path_text(path) for path in paths]
        template = _Reader(values).template()
    except SceneError as error:
        kept = {path: cell for path, cell in cells.items() if not _is_below(path, replaced)}
        # One cell has one problem: what the file makes of it after that is no news.
        of_cells = [
            one for one in _of_cells(error.problems, kept) if one.path not in {bad.path for bad in wrong}
        ]
        rest = [one for one in error.problems if _cell_of(one.path, kept) is None]
        raise SceneError([*wrong, *of_cells, *_located(rest, places, text, name, replaced)]) from None
    if wrong:
        raise SceneError(wrong)
    return template


def _is_below(path: str, others: Iterable[str]) -> bool:
    return any(at_or_below(path, other) for other in others)


def _of_cells(problems: Iterable[Problem], cells: Mapping[str, str]) -> list[Problem]:
    """The problems of what stands in cells of a workbook, each with its cell."""
    return [
        Problem(cell, f"{problem.path}: {problem.message}")
        for problem in problems
        if (cell := _cell_of(problem.path, cells)) is not None
    ]


def _cell_of(path: str, cells: Mapping[str, str]) -> str | None:
    """The cell of a value, or of what it is a part of; None if it stands in none."""
    while path and path not in cells:
        path = path[: max(path.rfind("."), path.rfind("["), 0)]
    return cells.get(path)


def _read_json(text: str) -> dict[str, Any]:
    if len(text) > MOST_CHARACTERS:
        raise SceneError([("file", f"has {len(text)} characters; at most {MOST_CHARACTERS} are accepted")])
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError([("file", f"is not valid JSON: {error}")]) from None
    if not isinstance(values, dict):
        raise SceneError(
            [("file", f"holds no scene: must be an object in braces, got a {type(values).__name__}")]
        )
    return values


def _located(
    problems: Iterable[Problem], places: Mapping[Path, Place], text: str, name: str, replaced: Sequence[str]
) -> list[Problem]:
    """Problems in the order of the file, each with line, column and the line itself.

    What was replaced stands nowhere in the file, nor does what is below it.
    """
    text = text.replace("\r\n", "\n")
    lines = text.split("\n")
    by_text = {path_text(path): place for path, place in places.items()}
    by_text = {path: place for path, place in by_text.items() if not _is_below(path, replaced)}
    found: list[tuple[tuple[int, int], Problem]] = []
    for problem in problems:
        path, place = problem.path, by_text.get(problem.path)
        while place is None and path and path not in replaced:
            # A missing field stands where its table begins.
            path = path[: max(path.rfind("."), path.rfind("["), 0)]
            place = by_text.get(path)
        if place is None:
            found.append(((0, 0), Problem(f"{name}: {problem.path}", problem.message)))
            continue
        # Inside a text of one line without escapes; the value may be a table with a text that was replaced.
        written = lines[place.line - 1][place.column - 1 :]
        if isinstance(problem, ExpressionProblem) and path == problem.path and _PLAIN_TEXT.match(written):
            place = place._replace(column=place.column + 1 + problem.offset)
        column = place.key_column if isinstance(problem, UnknownKey) else place.column
        where = f"{name}:{place.line}:{column}: {problem.path}"
        shown = f"{problem.message}{pointed_at(lines[place.line - 1], column)}"
        found.append(((place.line, column), Problem(where, shown)))
    return [problem for _, problem in sorted(found, key=lambda one: one[0])]


class _Reader:
    """Goes once over the plain values of a file and notes every problem."""

    def __init__(self, file: dict[str, Any]) -> None:
        self.file = file
        misspelt = (
            key for key in file if key not in SECTIONS and '"parameters"' in did_you_mean(key, SECTIONS)
        )
        given = file.get("parameters", file.get(next(misspelt, ""), {}))
        self.given: Mapping[str, Any] = given if isinstance(given, Mapping) else {}
        self.units: dict[str, str] = {}
        self.values = Values()
        self.expressions: list[tuple[Path, Expression]] = []

    def template(self) -> Template:
        self._check_head()
        parameters = read_parameters(self.file.get("parameters", self.given), self.values)
        self.units = {name: one.unit for name, one in parameters.items()}
        run = read_run(self.file.get("run", {}), self.values)
        features = read_features(self.file.get("features", {}), self.values)
        requirements = read_requirements(self.file.get("requirements", {}), self.values)
        costs = read_costs(self.file.get("costs", {}), parameters, self.values)
        names = [item.name for item in fields(Scene)]
        for key in self.file:
            if key not in SECTIONS:
                self.values.unknown((key,), meant_or_known(key, SECTIONS, most=20))
        scene = self._part({key: value for key, value in self.file.items() if key in names}, (Scene,), ())
        if not isinstance(scene, dict):
            raise SceneError(by_cause(self.values.problems))
        template = Template(
            title=self.file.get("title", ""),
            parameters=parameters,
            run=run,
            features=features,
            requirements=requirements,
            costs=costs,
            source=self.file,
            _scene=scene,
            _expressions=tuple(self.expressions),
        )
        self._check_scene(template)
        if self.values.problems:
            raise SceneError(by_cause(self.values.problems))
        return template

    def _check_head(self) -> None:
        form = self.file.get("format", FORMAT)
        if form != FORMAT or isinstance(form, bool):
            self.values.note(("format",), f"must be {FORMAT}, the format of this version, got {form!r}")
        title = self.file.get("title", "")
        if not isinstance(title, str) or not is_plain(title):
            self.values.note(("title",), f"must be a text without control characters, got {title!r}")
            self.file = {**self.file, "title": ""}

    def _check_scene(self, template: Template) -> None:
        """What only the whole scene shows, at the nominal values."""
        known = list(self.values.problems)
        lost = bool(self.values.lost) or not isinstance(self.file.get("parameters", {}), Mapping)
        try:
            if lost:
                # Any number will do to see whether the tables are right; what it leads to is no news.
                template.scene_at(dict.fromkeys(self.given, 1.0) | self.values.constants)
                return
            facts = template.scene().check()
        except SceneError as error:
            seen = {problem.path for problem in known}
            # After a problem of its own the scene holds stand-ins: what the core says of those is no news.
            self.values.problems += [
                problem
                for problem in error.problems
                if not (lost and isinstance(problem, ExpressionProblem))
                and not any(
                    at_or_below(problem.path, path) or at_or_below(path, problem.path) for path in seen
                )
            ]
        else:
            if not any(problem.path.startswith("run") for problem in known):
                check_names(facts, template.run, template.features, template.requirements, self.values)

    def _part(self, plain: Any, accepted: tuple[type[Part], ...], path: Path) -> Any:
        """Plain values of a record, with zeros where expressions stand; the scene itself reads the rest."""
        if not isinstance(plain, Mapping):
            return plain
        part = accepted[0]
        if part._tag is not None:
            words = {choice._tag[1]: choice for choice in accepted if choice._tag is not None}
            word = plain.get(part._tag[0], "")
            part = words.get(word, part) if isinstance(word, str) else part
        known = {item.name: item for item in fields(part)}  # type: ignore[arg-type]
        beside = {name: item.default for name, item in known.items()} | dict(plain)
        return {
            name: self._field(value, known[name], part, (*path, name), part._unit_of(known[name], beside))
            if name in known
            else value
            for name, value in plain.items()
        }

    def _field(self, value: Any, item: Field[Any], part: type[Part], path: Path, unit: str) -> Any:
        annotation = str(item.type)
        choices = part._choices.get(item.name)
        if choices is not None:
            if isinstance(value, list):
                return [self._part(one, choices, (*path, index)) for index, one in enumerate(value)]
            if isinstance(value, Mapping):
                return self._part(value, choices, path)
            if isinstance(value, str) and FormulaOfMotion in choices:
                quantities = item.metadata.get("quantities", ())
                names = names_of_motion(value, quantities)
                if names is not None:
                    return self._formula(value, names, path, quantities)
                return self._stand_in(value, unit, path, ("time",))
        if annotation.startswith("float"):
            return self._stand_in(value, unit, path)
        if annotation in ("Vector", "Numbers") and isinstance(value, list):
            before = len(self.values.problems)
            found = [self._stand_in(one, unit, (*path, index)) for index, one in enumerate(value)]
            if item.name == "points" and len(self.values.problems) > before:
                self._suggest_over(value, unit, before)
            return found
        if annotation == "Mapping[str, float]" and isinstance(value, Mapping):
            return {name: self._stand_in(one, unit, (*path, name)) for name, one in value.items()}
        if annotation.startswith("Mapping") and isinstance(value, Mapping):
            return {
                name: [self._stand_in(one, unit, (*path, name, index)) for index, one in enumerate(position)]
                if isinstance(position, list)
                else position
                for name, position in value.items()
            }
        return value

    def _suggest_over(self, points: Sequence[Any], unit: str, first: int) -> None:
        """Say of a table whose points are no times, but angles, over which quantity it may be meant."""
        own = {unit_of_quantity(one) for one in points if isinstance(one, str)}
        if unit != "s" or not any(one and not misfit(one, "rad") for one in own):
            return
        lists = (self.file.get(name, []) for name in ("drives", "joints", "bodies"))
        entries = [
            one for many in lists if isinstance(many, list) for one in many if isinstance(one, Mapping)
        ]
        turning = [
            one.get("joint", one.get("name"))
            for one in entries
            if one.get("type", "revolute") in ("speed", "motion", "revolute")
        ]
        name = next((one for one in turning if isinstance(one, str)), "crank")
        problem = self.values.problems[first]
        assert isinstance(problem, CausedProblem)
        hint = f'; a table over an angle says so: over = "{name}.angle"'
        self.values.problems[first] = problem.with_more(hint)

    def _formula(
        self, text: str, names: Iterable[str], path: Path, quantities: Sequence[str]
    ) -> dict[str, Any]:
        """A formula of the motion whose constants are the parameters in it."""
        parameters = self.given
        used = [name for name in dict.fromkeys(names) if name in parameters]
        for name in dict.fromkeys(names):
            if name not in (*parameters, *quantities, "time") and "." not in name:
                meant = meant_or_known(name, (*parameters, *quantities, "time"))
                self.values.note(path, f'unknown name "{name}"{meant}')
        self.expressions += [((*path, "constants", name), parse(name)) for name in used]
        return {"function": "expression", "text": text, "constants": dict.fromkeys(used, 0.0)}

    def _stand_in(self, value: Any, unit: str, path: Path, meant: Sequence[str] = ()) -> Any:
        """A number in SI units; zero, and a note of what to put there, for an expression.

        `meant` are names of a formula in the same place.
        """
        if not isinstance(value, str):
            return value
        number = self.values.number(value, unit, path)
        if not isinstance(number, Expression):
            return 0.0 if number is None else number
        parameters = self.given
        if number.names and number.names <= set(parameters):
            self.expressions.append((path, number))
            if number.name and (wrong := misfit(self.units.get(number.name, ""), unit)):
                self.values.note(path, f'"{number.name}" {wrong}')
            return 0.0
        try:
            number.require(parameters, meant)
            return number.evaluate({})
        except ExpressionError as error:
            self.values.refuse(path, number.text, error)
            return 0.0
