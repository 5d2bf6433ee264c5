"""Where in a file a wrong expression is: the line and the column inside its text."""

import copy
import json
import pickle

import chebclear as cc
import pytest
from chebclear.templates.expressions import MOST_CHARACTERS, MOST_DEPTH, MOST_NODES
from refusals import refuses

# « stands before the letter that an error must point at.
WRONG = [
    "length * «lenth",
    "1 / (0 * 2) + «nowhere",
    "length + «1 / (length - length)",
    "2 * «sqrt(-length)",
    "length + «9**9**9",
    "length + «sine(1)",
    "2 + «max(1)",
    "length«^2",
    "2 * «__import__(1)",
    "2 + «length.real",
    "1 + length«[0]",
    "length «2",
    "2 +« ",
    f"1 + {'-' * MOST_DEPTH}«-1",
    "«" + "+".join(["1"] * (MOST_NODES // 2 + 1)),
    "«" + "1" * (MOST_CHARACTERS + 1),
    "2 * «é",
    "  length *  «lenth",
]
QUOTES = ['"{}"', "'{}'"]
FILE = """format = 1
parameters.length = "40 cm"
parameters.width = 1
[[joints]]
type = "revolute"
name = "pin"
a = "ground"
b = "bob.A"
[[bodies]]
name = "bob"
inertia = 1
points = {{ A = [1, {value}] }} # where
mass = 1
"""


def shown(error: cc.errors.SceneError) -> tuple[str, str]:
    """The place that the first problem names, and the letter under which its caret stands."""
    where, line, caret = str(error).split("\n")[:3]
    return where, line[caret.index("^")] if len(line) > caret.index("^") else ""


@pytest.mark.parametrize("marked", WRONG, ids=range(len(WRONG)))
@pytest.mark.parametrize("quotes", QUOTES)
def test_the_column_inside_an_expression_is_told(marked, quotes):
    text = FILE.format(value=quotes.format(marked))
    before, after = text.split("«")
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(before + after, "rod.toml")
    where, letter = shown(caught.value)
    assert where.startswith(f"rod.toml:{line}:{column}: bodies[0].points.A[1]: "), where
    assert letter == after[0]


@pytest.mark.parametrize(
    "marked", ["length * «(width - 3)**0.5", "width«^2", "2 * «lenth", "length / «sqrt(width - 3)"]
)
def test_so_is_that_of_a_parameter(marked):
    before, after = (
        FILE.format(value=0).replace("width = 1", f'width = 1\nparameters.x = "{marked}"').split("«")
    )
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(before + after)
    assert shown(caught.value)[0].startswith(f"scene:4:{len(before) - before.rfind(chr(10))}: parameters.x: ")


def test_every_one_of_many_wrong_expressions_is_told():
    marked = ["length / «0 * lenth", "«sine(1)", "1 +« "]
    rows = "\n".join(f'points.P{index} = [0, "{text}"]' for index, text in enumerate(marked))
    text = FILE.format(value=0).replace("points = { A = [1, 0] }", f"points.A = [0, 0]\n{rows}")
    columns = [row.replace("0 * «lenth", "").index("«") + 1 for row in rows.split("\n")]
    columns[0] = rows.split("\n")[0].index("lenth")  # the name is wrong whatever the numbers are
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text.replace("«", ""))
    places = [problem.path.split(":")[1:3] for problem in caught.value.problems]
    assert places == [[str(13 + index), str(column)] for index, column in enumerate(columns)]


@pytest.mark.parametrize("quotes", ['"""{}"""', "'''{}'''", '"""\n{}"""', r'"\u0020{}"'])
def test_a_text_of_several_lines_or_with_escapes_is_told_where_it_begins(quotes):
    text = FILE.format(value=quotes.format("length * lenth"))
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text, "rod.toml")
    where, letter = shown(caught.value)
    assert where.startswith("rod.toml:12:20: bodies[0].points.A[1]: ") and letter == "\"'"[quotes[0] == "'"]


def test_a_value_that_stands_in_no_file_has_no_column():
    text = FILE.format(value=0)
    with pytest.raises(cc.errors.SceneError):
        cc.loads(text, changes={"width": "2 * lenth"})
    as_json = json.loads(cc.loads(text)().to_json())
    as_json["bodies"][0]["mass"] = "2 * lenth"
    with pytest.raises(cc.errors.SceneError):
        cc.loads(json.dumps(as_json))


def test_an_expression_in_the_table_of_a_parameter_has_the_place_of_the_table(tmp_path):
    file = tmp_path / "scene.toml"
    text = FILE.format(value=0) + '\n[parameters.depth]\nnominal = "NOMINAL"\nrel = 0.1\n'
    for written, changes in (("nowhere", None), ("1 mm", {"depth": "nowhere"})):
        file.write_text(text.replace("NOMINAL", written))
        with refuses("scene.toml:15:1: parameters.depth", error=cc.errors.SceneError):
            cc.load(file, changes=changes)


def test_the_error_of_a_value_survives_copies():
    template = cc.loads(FILE.format(value='"1 / (length - 1)"'))
    with pytest.raises(cc.errors.SceneError) as caught:
        template(length=1.0)
    [problem] = caught.value.problems
    for again in (pickle.loads(pickle.dumps(caught.value)), copy.deepcopy(caught.value)):
        assert again.problems == [problem]
        assert str(again) == str(caught.value)
        assert again.problems[0].offset == problem.offset == 0


def test_what_is_wrong_elsewhere_is_told_beside_a_parameter_without_a_value():
    text = FILE.format(value='"width"').replace("width = 1", 'width = "1 / (length - length)"')
    text = text.replace('type = "revolute"', 'type = "pin"').replace("inertia = 1", "inertias = 1")
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text)
    paths = [problem.path.rpartition(": ")[2] for problem in caught.value.problems]
    assert paths == ["parameters.width", "joints[0].type", "bodies[0].inertia", "bodies[0].inertias"]


def test_nothing_is_told_of_what_depends_on_a_parameter_without_a_value():
    text = FILE.format(value='"1 / (width - 1)"').replace("width = 1", 'width = "1 mmm"')
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text)
    assert [problem.path for problem in caught.value.problems] == ["scene:3:20: parameters.width"]
