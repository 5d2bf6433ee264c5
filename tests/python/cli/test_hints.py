"""Texts of the library serve Python and the command line: they name what to do, not how it is called."""

import ast
import re
from pathlib import Path

import chebclear
import pytest
from chebclear import cli

ROOT = Path(chebclear.__file__).parent
CRANK = str(Path(__file__).parents[3] / "examples" / "slider_crank.toml")
# A method of a result, a study or a run, or a keyword.
CALL = re.compile(r"\b(?:Study|StudyResult|result|Scene|run)\.[a-z_]+\b(?!\.)|\b[a-z_]{3,}=|\bcheck\(\)")
# Texts that no command shows: of functions that no command calls, or of files that are no text to be read.
ELSEWHERE = (
    *("features must map", "] must be a feature", "ask for a duration of N periods", "from_runs", "study's"),
    *("can be extended, this is", "a result of Study.band", " start="),
    *("Use chebyshev() for", "Study(outputs=...)", 'error="estimate" needs', "settings=Settings", "; skip="),
    *("finer scans", "band() and sample()", "must be a StudyResult", "rel=", " and end="),
    *(
        'give version="1" to the study',
        "Interval(lower=",
        ", upper=",
        ", nominal=",
        "study.extended(result",
        "study.worst_cases(result",
        "is a feature, not",
    ),
)


def texts():
    """The texts of the library that are told to users."""
    for room in ("base", "run", "scene", "study", "execution", "templates"):
        for file in (ROOT / room).rglob("*.py"):
            if file.parent.name == "report" or file.name in ("report.py", "json_schema.py"):
                continue
            tree = ast.parse(file.read_text(encoding="utf-8"))
            plain = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in plain:
                    yield node.value


def test_texts_that_commands_show_name_no_call_of_python():
    named = [text for text in texts() if CALL.search(text)]
    assert [text for text in named if not any(words in text for words in ELSEWHERE)] == []


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("kind", ["band", "sample", "chebyshev"])
def test_a_study_tells_what_to_do_next_by_its_options(kind, capsys):
    words = ["--kind", kind, "--samples", "41", *(["--runs", "9"] if kind != "chebyshev" else [])]
    assert cli.main(["study", CRANK, *words]) == 0
    printed = capsys.readouterr()
    told = printed.out + printed.err
    assert "next: " in told and not CALL.search(told)
    assert "a check simulates" in told or kind == "sample"


def test_predicted_worst_cases_are_simulated_on_request(capsys):
    words = ["study", CRANK, "--runs", "21", "--samples", "41", "--outputs", "slider.x"]
    assert cli.main([*words, "--check", "--quiet"]) == 0
    assert "(there)" in capsys.readouterr().out
    assert cli.main([*words, "--revolutions", "2", "--discard", "1", "--json"]) == 0
    assert cli.main(["study", CRANK, "--kind", "sample", "--runs", "5", "--samples", "5", "--check"]) == 0
    assert "--check finds no worst case" in capsys.readouterr().err
