"""``chebclear fields``: what may stand in a scene file."""

from __future__ import annotations

import argparse
import dataclasses

from ...base.shown import did_you_mean
from ...templates.reference.fields import field_tables, first_word, matching, overview, plain
from ..options import Command, Kind, Option
from ..output import print_json


def fields(options: argparse.Namespace) -> None:
    """Run the command."""
    tables = field_tables()
    words: list[str] = options.words
    found = tables if "all" in words else matching(tables, words)
    for word in words:
        if word != "all" and not matching(tables, [word]):
            known = [name for table in tables for name in (table.kind, first_word(table.section)) if name]
            options.usage_error(f'unknown table or type "{word}"{did_you_mean(word, known)}')
    if options.json:
        print_json({"tables": [dataclasses.asdict(table) for table in (found or tables)]})
        return
    print(plain(found) if found else overview(tables))
    if not found and not options.quiet:
        print("next     chebclear fields WORD ...    such as joints, spring or all")


COMMANDS = {
    "fields": Command(
        fields,
        "List the fields of the tables of a scene file, with their units, what holds if they are left out, "
        "and what they mean. Without a word: which tables and types there are.",
        "chebclear fields bodies clearance_revolute run",
        [Option("words", Kind("WORD"), "a table or a type, such as joints, spring or all", nargs="*")],
    )
}
