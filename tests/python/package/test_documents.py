"""The README's code and the examples run."""

import re
import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def test_there_are_blocks_and_examples() -> None:
    assert len(BLOCKS) >= 2
    assert EXAMPLES


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_readme_block_runs(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(BLOCKS[number], f"README.md, block {number}", "exec"), {"__name__": "readme"})


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example_runs(example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [str(example), str(tmp_path)])
    runpy.run_path(str(example), run_name="__main__")
    assert list(tmp_path.glob("*.png"))


def test_the_map_of_the_code_names_files_that_exist() -> None:
    text = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:rust/src|python/chebclear|tests|docs|benchmarks)/[\w/.]+)`", text)
    assert len(named) > 20
    assert not [path for path in named if not (ROOT / path).exists()]
    rooms = {"rust/src": "Rust room", "python/chebclear": "Python room"}
    for root, title in rooms.items():
        table = text[text.index(f"| {title}") :].split("\n\n")[0]
        rows = re.findall(r"^\| `(\w+)/` \|.*\| (.*) \|$", table, re.MULTILINE)
        folders = {
            path.name for path in (ROOT / root).iterdir() if path.is_dir() and path.name[0] not in "_."
        }
        assert {room for room, _ in rows} == folders
        for room, files in rows:
            for file in re.findall(r"`([\w.]+)`", files):
                assert (ROOT / root / room / file).exists(), f"{root}/{room}/{file}"
