"""Tables of everything that may stand in a scene file: a page of the documentation, and plain text."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields
from typing import Any

from ...base.shown import capital
from ...run.features import JOINT_KINDS, KINDS
from ...run.settings import METHODS, Settings
from ...scene.functions import Expression
from ...scene.scene import Scene
from ...scene.schema import Part, descriptions
from ..expressions import CONSTANTS, FUNCTIONS
from ..reader import FORMAT
from ..run_table import UNITS
from .json_schema import (
    CATALOG,
    COST,
    PARAMETER,
    PARAMETER_WORDS,
    REQUIREMENT,
    REQUIREMENT_WORDS,
    accepted_words,
    summary,
)

WIDTH = 100
"""Columns of the tables in plain text [-]."""


@dataclass(frozen=True)
class FieldRow:
    """One field."""

    name: str
    value: str
    """What it may be, with its unit."""
    default: str
    """What holds if it is left out; ``"required"`` if it may not be."""
    meaning: str


@dataclass(frozen=True)
class FieldTable:
    """The fields of one kind of table of a scene file."""

    section: str
    """The head of the table, as it is written in a file."""
    kind: str
    """The word that selects it, such as ``"revolute"``; empty where there is only one kind."""
    summary: str
    rows: tuple[FieldRow, ...]

    @property
    def title(self) -> str:
        """How the table is written, with the word that selects its kind."""
        if "..." in self.section:
            return self.section.replace("...", f'"{self.kind}"')
        return f'{self.section} type = "{self.kind}"' if self.kind else self.section


def field_tables() -> list[FieldTable]:
    """All tables that a scene file may hold, in the order in which one writes them."""
    meanings = descriptions(Scene)
    head = (
        FieldRow("format", "number", str(FORMAT), "Number of the file format."),
        FieldRow("title", "text", "optional", "What the mechanism is, for people."),
    )
    numbers = (
        "A named number is a number, a quantity, an expression, or a table of these fields. Expressions of "
        f"parameters hold numbers, names, ``+ - * / **``, parentheses, {', '.join(CONSTANTS)} and the "
        f"functions {', '.join(FUNCTIONS)}; angles are in rad."
    )
    point = FieldRow("NAME", "[x, y] [m]", "-", "A point, as in `O = [0, 0]`; elsewhere it is `ground.O`.")
    words = "A bare number is in SI units; a text is a quantity or an expression."
    tables = [
        FieldTable("top of the file", "", words, head),
        _of_schema("[parameters]", numbers, PARAMETER, PARAMETER_WORDS),
        FieldTable("[ground]", "", meanings["ground"], (point,)),
    ]
    held: dict[str, tuple[type[Part], ...]] = {}
    for name, choices in Scene._choices.items():
        for part in choices:
            tables.append(_table(f"[[{name}]]", part))
            for field_name, inner in part._choices.items():
                key = _key_of(inner)
                section = key if key != "law" else f"{field_name} = {{ law = ... }}"
                held[section] = tuple(dict.fromkeys((*held.get(section, ()), *inner)))
    for key, choices in held.items():
        section = key if "law" in key else "torque = { function = ... }"
        tables += [_table(section, part) for part in choices]
    features = (
        "Numbers of the continuous motion by names of your choice: "
        f"{', '.join(kind for kind in KINDS if kind not in JOINT_KINDS)} of an output, "
        f"{', '.join(JOINT_KINDS)} of a clearance joint."
    )
    meaning = 'As in `"peak force" = "peak(wrist.normal_force)"`; with a window: '
    meaning += (
        '`"peak(wrist.normal_force, crank.angle = 80 deg .. 120 deg)"`, `"mean(slider.vx, time = 20 ms ..)"`.'
    )
    feature = FieldRow("NAME", "text", "-", meaning)
    limits = "Limits that outputs and features must keep to, by names of your choice."
    costs = (
        "What the tolerance of a parameter costs, half of its interval, for ``chebclear allocate``. A wider "
        "one may not cost more."
    )
    cost = (
        FieldRow("NAME", "text", "-", f"{capital(COST['description'])}."),
        FieldRow("NAME", "table of numbers", "-", f"{capital(CATALOG['description'])}."),
    )
    tables += [_run(), FieldTable("[features]", "", features, (feature,))]
    return [
        *tables,
        _of_schema("[requirements]", limits, REQUIREMENT, REQUIREMENT_WORDS),
        FieldTable("[costs]", "", costs, cost),
    ]


def page(tables: list[FieldTable]) -> str:
    """The tables as a page of the documentation."""
    text = [
        "# Fields of scene files",
        "",
        "What may stand in a {doc}`scene file <scene_files>`? Every table, type and field of it, as",
        "`chebclear fields` prints them.",
        'A number may also be a quantity in its unit or any other of the dimension (`"20 um"`), or an',
        "expression of parameters. This page is made by `.ci/schema` from the records that the reader uses.",
        "",
    ]
    for table in tables:
        head = f"`{table.title}`" if table.title[0] == "[" or "{" in table.title else capital(table.title)
        text.append(f"## {head}\n\n{_marked(table.summary)}\n")
        text.append("| field | value | if left out | meaning |\n|---|---|---|---|")
        for row in table.rows:
            default = row.default if row.default in _WORDS else f"`{row.default}`"
            cells = [f"`{row.name}`", row.value, default, _marked(row.meaning)]
            text.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
        text.append("")
    return "\n".join(text).rstrip() + "\n"


def plain(tables: list[FieldTable]) -> str:
    """The tables as text for a terminal."""
    lines: list[str] = []
    for table in tables:
        lines += [table.title, *textwrap.wrap(_unmarked(table.summary), WIDTH - 2, **_indent(2))]
        width = max(len(row.name) for row in table.rows)
        for row in table.rows:
            default = row.default if row.default in _WORDS else f"default {row.default}"
            text = f"{row.value}; {default}. {_unmarked(row.meaning)}"
            wrapped = textwrap.wrap(text, WIDTH - width - 6)
            lines.append(f"    {row.name.ljust(width)}  {wrapped[0]}")
            lines += [f"{' ' * (width + 6)}{line}" for line in wrapped[1:]]
        lines.append("")
    return "\n".join(lines).rstrip()


def overview(tables: list[FieldTable]) -> str:
    """The kinds of tables, each section in a line."""
    kinds: dict[str, list[str]] = {}
    for table in tables:
        kinds.setdefault(table.section, []).append(table.kind or _unmarked(table.summary))
    width = max(map(len, kinds))
    lines = []
    for section, names in kinds.items():
        wrapped = textwrap.wrap(", ".join(names), WIDTH - width - 2) or [""]
        lines.append(f"{section.ljust(width)}  {wrapped[0]}")
        lines += [f"{' ' * (width + 2)}{line}" for line in wrapped[1:]]
    return "\n".join(lines)


def matching(tables: list[FieldTable], words: list[str]) -> list[FieldTable]:
    """The tables whose section or kind one of the words names, such as ``"joints"`` or ``"spring"``."""
    asked = [word.strip("[]").lower() for word in words]
    return [
        table for table in tables if any(word in (table.kind, first_word(table.section)) for word in asked)
    ]


def first_word(section: str) -> str:
    """The word by which a section is asked for."""
    return "function" if "function" in section else section.strip("[]").split(" ")[0]


_WORDS = ("required", "optional", "-")
_SCHEMA_TYPES = {
    "array": "[lower, upper]",
    "string": "text",
    "integer": "whole number",
    "boolean": "true or false",
}
_FORMS = {
    "float": "number",
    "Vector": "[x, y]",
    "Numbers": "[number, ...]",
    "Mapping[str, float]": "table of NAME = number",
    "Mapping[str, Vector]": "table of NAME = [x, y]",
}


def _indent(columns: int) -> dict[str, Any]:
    return {"initial_indent": " " * columns, "subsequent_indent": " " * columns}


def _marked(text: str) -> str:
    return text.replace("``", "`")


def _unmarked(text: str) -> str:
    return text.replace("`", "")


def _key_of(choices: tuple[type[Part], ...]) -> str:
    tag = choices[0]._tag
    return tag[0] if tag is not None else ""


def _of_schema(section: str, about: str, schema: Mapping[str, Any], words: Mapping[str, str]) -> FieldTable:
    """A table of entries that are no records."""
    rows = []
    for name, own in schema["properties"].items():
        value = _SCHEMA_TYPES.get(str(own.get("type")), "number")
        value = "[number, ...]" if value.startswith("[") and "maxItems" not in own else value
        value = _quoted(own["enum"]) if "enum" in own else value
        default = "required" if name in schema.get("required", ()) else "optional"
        rows.append(FieldRow(f"NAME.{name}", value, default, f"{capital(words[name])}."))
    return FieldTable(section, "", about, tuple(rows))


def _run() -> FieldTable:
    meanings, rows = descriptions(Settings), []
    own = {item.name: item for item in fields(Settings)}
    for name in (*UNITS, "method", "outputs"):
        item = own[name]
        value = f"number [{UNITS[name]}]" if name in UNITS else _quoted(METHODS)
        if name == "outputs":
            value = "list of texts"
        default = {"duration": "required", "outputs": "optional"}.get(name, _default(item))
        rows.append(FieldRow(name, value, default, _without_unit(meanings[name], UNITS.get(name, ""))))
    words = "How to simulate; the command line replaces each by an option of the same name."
    return FieldTable("[run]", "", words, tuple(rows))


def _table(section: str, part: type[Part]) -> FieldTable:
    meanings, words = descriptions(part), accepted_words(part)
    rows = (
        []
        if part._tag is None
        else [FieldRow(part._tag[0], f'"{part._tag[1]}"', "required", "Selects this kind.")]
    )
    for item in fields(part):  # type: ignore[arg-type]
        unit = str(item.metadata.get("unit", ""))
        value = _value(part, item, unit, words)
        rows.append(
            FieldRow(item.name, value, _default(item), _without_unit(meanings.get(item.name, ""), unit))
        )
    return FieldTable(section, "" if part._tag is None else part._tag[1], summary(part), tuple(rows))


def _value(part: type[Part], item: Field[Any], unit: str, words: Mapping[str, tuple[str, ...]]) -> str:
    annotation, in_unit = str(item.type), f" [{unit}]" if unit else ""
    if item.name in part._choices:
        inner = part._choices[item.name]
        tables = (
            f"table with {_key_of(inner)} = {_quoted([choice._tag[1] for choice in inner if choice._tag])}"
        )
        text = ", text of a formula" if Expression in inner else ""
        if annotation.startswith("float"):
            return f"number{in_unit}{text} or {tables}"
        return f"{text[2:]}{in_unit} or {tables}" if text else tables
    if annotation == "bool":
        return "true or false"
    form = _FORMS.get(annotation.removesuffix(" | None"))
    if form is not None:
        return f"{form}{in_unit}"
    return _quoted(words[item.name]) if item.name in words else "text"


def _quoted(words: Any) -> str:
    return ", ".join(f'"{word}"' for word in words)


def _default(item: Field[Any]) -> str:
    if item.default is MISSING:
        return "required" if item.default_factory is MISSING else "optional"
    if item.default is None:
        return "optional"
    if isinstance(item.default, bool):
        return str(item.default).lower()
    if isinstance(item.default, tuple):
        return f"[{', '.join(f'{number:g}' for number in item.default)}]"
    return f'"{item.default}"' if isinstance(item.default, str) else f"{item.default:g}"


def _without_unit(text: str, unit: str) -> str:
    """A description without the unit, which stands beside it."""
    return text.replace(f" [{unit}]", "", 1) if unit else text
