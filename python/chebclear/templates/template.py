"""Templates: mechanisms whose numbers are expressions of named parameters."""

from __future__ import annotations

import copy
import inspect
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.quantities import Interval
from ..base.rows import Array
from ..base.shown import did_you_mean
from ..base.units import si_unit, units_in, written
from ..base.writing import named, replaced
from ..errors import ArgumentError, ArgumentTypeError, Problem, SceneError, UnknownNameError
from ..report import html
from ..report.document import Cell, Table
from ..run.features import Feature
from ..run.simulation import simulate
from ..run.trajectory import Trajectory
from ..scene.distributions import Distribution
from ..scene.scene import Scene
from ..scene.schema import read
from ..scene.structure import Structure
from ..study.requirements.specification import Specification
from .expressions import Expression, ExpressionError, ExpressionProblem, UnknownNameInExpression
from .toml_text import Path, write_toml

if TYPE_CHECKING:
    from ..study.requirements.conformance import Conformance
    from ..study.results import StudyResult
    from ..study.study import Study


@dataclass(frozen=True)
class Parameter:
    """A named number of a template.

    Attributes
    ----------
    name : str
        Name, as expressions use it.
    nominal : float | Expression
        Default value [SI unit]; an expression follows other parameters.
    interval : Interval | None
        Interval it is known to lie in [SI unit]; None for a constant.
    unit : str
        Unit of the quantity, for tables and pictures; the value is in SI units all the same.
    note : str
        What it is, or where its value comes from.
    distribution : Distribution | None
        How often the values in the interval occur; None if it is not known.
    """

    name: str
    nominal: float | Expression
    interval: Interval | None = None
    unit: str = ""
    note: str = ""
    distribution: Distribution | None = None


@dataclass(frozen=True, eq=False)
class Template:
    """A mechanism with named parameters, as a scene file describes it.

    `load` and `loads` read one. It is called like the ready-made mechanisms: ``template(rod_length=0.13)`` is
    the scene with that rod, every other parameter at its nominal value.

    Examples
    --------
    >>> from chebclear import loads
    >>> template = loads('''
    ... format = 1
    ... parameters.length = { nominal = "400 mm", rel = 0.02 }
    ... bodies = [{ name = "bob", mass = 1, inertia = "length**2 / 12", points.A = ["-length / 2", 0] }]
    ... joints = [{ type = "revolute", name = "pin", a = "ground", b = "bob.A" }]
    ... ''')
    >>> template.intervals
    {'length': Interval(lower=0.392, upper=0.40800000000000003)}
    >>> template(length=0.6).bodies[0].inertia
    0.03

    Attributes
    ----------
    title : str
        What the file calls the mechanism; empty if it does not.
    parameters : Mapping[str, Parameter]
        The parameters by name, in the order of the file.
    run : Mapping[str, Any]
        Settings of runs, as keywords of `simulate` and `Study` [SI units].
    features : Mapping[str, Feature]
        Numbers that are to be found in every run, by name.
    requirements : Mapping[str, Specification]
        Limits that outputs and features must keep to, by name; see `Template.conformance`.
    costs : Mapping[str, callable or mapping]
        What tolerances of parameters cost, by name; see `chebclear.allocate`.
    source : Mapping[str, Any]
        The plain values of the file, as they were written.
    _scene : Mapping[str, Any]
        The scene as JSON has it, with zeros where an expression stands.
    _expressions : Sequence[tuple[Path, Expression]]
        Where in the scene which expression stands.
    """

    title: str
    parameters: Mapping[str, Parameter]
    run: Mapping[str, Any]
    features: Mapping[str, Feature]
    requirements: Mapping[str, Specification]
    costs: Mapping[str, Callable[[float], float] | Mapping[str, float]]
    source: Mapping[str, Any]
    _scene: Mapping[str, Any] = field(repr=False)
    _expressions: Sequence[tuple[Path, Expression]] = field(repr=False)

    def __repr__(self) -> str:
        title = f' "{self.title}"' if self.title else ""
        sides = ", ".join(
            f"{name} in [{side.lower:g}, {side.upper:g}]" for name, side in self.intervals.items()
        )
        return f"<Template{title}: {len(self.parameters)} parameters{'; ' if sides else ''}{sides}>"

    def _repr_html_(self) -> str:
        from ..plots.drawing.scene import mechanism_picture

        rows: list[list[Cell]] = []
        for name, one in self.parameters.items():
            values = [
                self.values()[name],
                *([one.interval.lower, one.interval.upper] if one.interval else []),
            ]
            rows.append([name, *([written(value, one.unit) for value in values] + ["", ""])[:3], one.note])
        table = Table("The parameters", ["parameter", "nominal", "from", "to", "note"], rows)
        return html.fragment(repr(self)[1:-1], [mechanism_picture(self.scene()), table])

    def __eq__(self, other: object) -> bool:
        return self.source == other.source if isinstance(other, Template) else NotImplemented

    def __hash__(self) -> int:
        return hash(json.dumps(self.source, sort_keys=True))

    def __call__(self, **values: float) -> Scene:
        """The scene with these values of parameters; see `scene`."""
        return self.scene(**values)

    @property
    def __signature__(self) -> inspect.Signature:
        # `Study` takes the names of the parameters from this signature.
        return inspect.Signature(
            [
                inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None)
                for name in self.parameters
            ],
            return_annotation=Scene,
        )

    @property
    def __name__(self) -> str:
        return self.title or "template"

    @property
    def intervals(self) -> dict[str, Interval]:
        """The parameters that are known as intervals [SI units]."""
        return {name: one.interval for name, one in self.parameters.items() if one.interval is not None}

    @cached_property
    def written(self) -> tuple[str, ...]:
        """Units that stand in the file, in which results are shown."""
        return tuple(dict.fromkeys(units_in(self.source)))

    def unit_of(self, name: str) -> str:
        """SI unit of the values of a parameter; empty if the file gives it none."""
        if not isinstance(name, str) or name not in self.parameters:
            raise UnknownNameError(f'unknown parameter "{name}"{did_you_mean(name, self.parameters)}')
        return si_unit(self.parameters[name].unit)

    def values(self, **given: float) -> dict[str, float]:
        """Value of every parameter [SI units]: as given, which may be a text with its unit, else its nominal
        one.

        Raises
        ------
        SceneError
            If an expression has no value; names the parameter.
        TypeError
            If a name is unknown.
        """
        for name in given:
            if name not in self.parameters:
                raise ArgumentTypeError(f'unknown parameter "{name}"{did_you_mean(name, self.parameters)}')
        texts = [name for name, value in given.items() if isinstance(value, str)]
        if texts:
            checks = Checks()
            for name in texts:
                given[name] = checks.number(name, given[name], self.unit_of(name) or "SI unit")
            checks.finish()
        return evaluated({name: one.nominal for name, one in self.parameters.items()} | given)

    def scene(self, **given: float) -> Scene:
        """The scene with these values of parameters [SI units], every other at its nominal value.

        Raises
        ------
        SceneError
            If a number of the scene has no value, with its path.
        TypeError
            If a name is unknown.
        """
        return self.scene_at(self.values(**given))

    def scene_at(self, values: Mapping[str, float]) -> Scene:
        """The scene with these values of all parameters [SI units].

        Raises
        ------
        SceneError
            If a number of the scene has no value, or a table is wrong.
        """
        plain = copy.deepcopy(dict(self._scene))
        problems: list[Problem] = []
        for path, expression in self._expressions:
            holder: Any = plain
            for name in path[:-1]:
                holder = holder[name]
            try:
                holder[path[-1]] = expression.evaluate(values)
            except ExpressionError as error:
                words = f'"{expression.text}" {error}'
                problems.append(ExpressionProblem(path_text(path), words, error.column))
        # A number without a value stays zero, so that all other problems are reported too.
        scene = read(plain, (Scene,), "", problems)
        if problems:
            raise SceneError(problems)
        assert isinstance(scene, Scene)
        return scene

    def scene_numbers(
        self,
        structure: Structure,
        like: Sequence[float],
        values: Mapping[str, Array],
        fixed: Mapping[str, float],
    ) -> tuple[Array, NDArray[np.bool_]]:
        """The numbers of many scenes, to the same bits as those of `scene`, and which of these it refuses.

        See `ManyScenes`: those that do not change are as in `like`; values have the shape (runs,).
        """
        runs = len(next(iter(values.values())))
        known: dict[str, float | Array] = dict(values)

        def value(name: str) -> float | Array:
            if name not in known:
                known[name] = found(fixed.get(name, self.parameters[name].nominal))
            return known[name]

        def found(one: float | Expression) -> float | Array:
            if not isinstance(one, Expression):
                return float(one)
            given = {name: value(name) for name in one.names}
            if any(isinstance(column, np.ndarray) for column in given.values()):
                return one.column(given, runs)
            return one.evaluate({name: float(each) for name, each in given.items()})

        refused = np.zeros(runs, dtype=bool)
        for name in self.parameters:
            refused |= np.isnan(value(name))
        numbers = np.tile(like, (runs, 1))
        for path, expression in self._expressions:
            if any(isinstance(known[name], np.ndarray) for name in expression.names):
                column = numbers[:, structure.index(path)] = found(expression)
                refused |= np.isnan(column)
        return numbers, refused

    def simulate(self, **options: Any) -> Trajectory:
        """One run of the scene at the nominal values, with the settings of the file.

        Parameters
        ----------
        **options
            Keywords of `chebclear.simulate` that replace those of the file.
        """
        features = list(self.features.values()) or None
        run = simulate(self.scene(), **({"features": features} | dict(self.run) | options))
        return replace(run, written=self.written)

    def study(self, **options: Any) -> Study:
        """The study of the parameters that have intervals, with the settings of the file.

        Parameters
        ----------
        **options
            Keywords of `Study` that replace those of the file.

        Raises
        ------
        ValueError
            If no parameter has an interval.
        """
        # Here, as scene files are read where nothing is studied.
        from ..study.study import Study

        if not self.intervals:
            raise ArgumentError(
                "no parameter of the template has an interval: give one rel, plus and minus, or limits"
            )
        features = dict(self.features) or None
        drawn: dict[str, Interval | Distribution] = dict(self.intervals)
        drawn |= {name: one.distribution for name, one in self.parameters.items() if one.distribution}
        # Without distributions there are no shares.
        random = any(one.distribution for one in self.parameters.values())
        required = self.requirements if random and self.requirements else None
        given: dict[str, Any] = {"features": features, "requirements": required} | dict(self.run) | options
        if required and isinstance(given["features"], Mapping):
            # Other features do not replace those that are required.
            kept = {one.quantity for one in required.values()}
            own = {name: one for name, one in self.features.items() if name in kept}
            given["features"] = own | dict(given["features"])
        return Study(self, drawn, **given)

    def conformance(
        self,
        runs: int = 1000,
        *,
        failures: int | None = None,
        width: float | None = None,
        inner: int = 0,
        confidence: float = 0.95,
        rng: int | Generator | None = 0,
        **options: Any,
    ) -> Conformance:
        """The share of mechanisms that keep to the requirements of the file; see `chebclear.conformance`.

        Further keywords are those of `Study`, and replace those of the file.

        Raises
        ------
        ValueError
            If the file has no requirements, or no parameter has a distribution.
        """
        from ..study.conforming import conformance

        if not self.requirements:
            raise ArgumentError("the template has no requirements: give it a table [requirements]")
        return conformance(
            self.study(**options),
            self.requirements,
            runs,
            failures=failures,
            width=width,
            inner=inner,
            confidence=confidence,
            rng=rng,
        )

    def to_toml(self) -> str:
        """The template as TOML; `loads` reads the same template back, to the last bit."""
        return write_toml(self.source)

    def save(self, path: str | os.PathLike[str]) -> FilePath:
        """Write the template as TOML, to a file with ``.toml``; `load` reads it back, to the last bit."""
        path = named(path)
        if path.suffix != ".toml":
            path = path.with_name(path.name + ".toml")
        with replaced(path) as beside:
            beside.write_text(self.to_toml(), encoding="utf-8")
        return path

    def to_workbook(
        self, path: str | os.PathLike[str], result: StudyResult | Conformance | None = None
    ) -> FilePath:
        """Write parameters and requirements as sheets of an Excel workbook, and a result as a third one.

        ``load(file, workbook=path)`` reads the same template back, to the last bit. An existing workbook is
        replaced, unless it holds formulas or sheets of somebody's own.

        Parameters
        ----------
        path : path
            Where to; ``.xlsx`` is appended if there is no suffix.
        result : StudyResult or Conformance, optional
            What was found: its quantities, smallest, largest, how sure; in the units of the file.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ValueError, TypeError
            If the result is of another kind, or a workbook of somebody's own is there.
        ImportError
            If openpyxl is not installed.
        """
        # Here, as few templates are written as workbooks.
        from .workbook import write_workbook

        return write_workbook(self.source, path, result)


def evaluated(nominal: Mapping[str, float | Expression]) -> dict[str, float]:
    """Values of parameters; a SceneError for a cycle or one without a value."""
    values, problems = evaluation(nominal)
    if problems:
        raise SceneError(problems)
    return values


def evaluation(
    nominal: Mapping[str, float | Expression], lost: Iterable[str] = ()
) -> tuple[dict[str, float], list[Problem]]:
    """Values of parameters, those first that others need, and the problems of those that have none.

    What needs one that is `lost`, or has a problem, has no value either, which is no problem of its own.
    """
    values: dict[str, float] = {}
    failed = set(lost)
    problems: list[Problem] = []

    known = nominal.keys() | failed

    def settle(name: str, above: tuple[str, ...]) -> bool:
        if name in values or name in failed:
            return name in values
        if name in above:
            circle = " -> ".join((*above[above.index(name) :], name))
            problems.append(Problem(f"parameters.{name}", f"needs itself: {circle}"))
            return False
        one = nominal[name]
        if isinstance(one, Expression):
            # All parameters, so that every cycle is found; the evaluation reports unknown names.
            if not all([settle(other, (*above, name)) for other in sorted(one.names) if other in known]):
                failed.add(name)
                return False
            try:
                values[name] = one.evaluate(values)
            except ExpressionError as error:
                words = f'"{one.text}" {error}'
                cause = str(error) if isinstance(error, UnknownNameInExpression) else ""
                problems.append(ExpressionProblem(f"parameters.{name}", words, error.column, cause))
                failed.add(name)
                return False
        else:
            values[name] = one
        return True

    for name in nominal:
        settle(name, ())
    return {name: values[name] for name in nominal if name in values}, problems


def path_text(path: Path) -> str:
    """A path as problems write it, such as ``bodies[0].mass``."""
    text = ""
    for name in path:
        text += f"[{name}]" if isinstance(name, int) else f".{name}" if text else name
    return text
