"""The code of the README and of the documentation, and the examples, run."""

import re
import runpy
import sys
from pathlib import Path

import pytest
from chebclear import mechanisms
from chebclear.cli import program
from public_names import public_names

ROOT = Path(__file__).parents[3]
CODE = re.compile(r"```python\n(.*?)```", re.DOTALL)
BLOCKS = CODE.findall((ROOT / "README.md").read_text(encoding="utf-8"))
PAGES = sorted(
    page
    for page in (ROOT / "docs").rglob("*.md")
    if "```python" in page.read_text(encoding="utf-8") and not page.parent.name.startswith("_")
)
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def test_there_are_blocks_and_examples() -> None:
    assert BLOCKS and len(PAGES) > 8
    assert EXAMPLES


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_readme_block_runs(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(BLOCKS[number], f"README.md, block {number}", "exec"), {"__name__": "readme"})


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_page_of_the_documentation_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page build on each other."""
    if page.stem == "data":  # the page of the formats of other libraries
        pytest.importorskip("pandas")
        pytest.importorskip("xarray")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": page.stem}
    for number, block in enumerate(CODE.findall(page.read_text(encoding="utf-8"))):
        exec(compile(block, f"{page.name}, block {number}", "exec"), names)


def test_every_status_has_a_section() -> None:
    source = (ROOT / "rust" / "src" / "integrators" / "mod.rs").read_text(encoding="utf-8")
    words = set(re.findall(r'Status::\w+ => "(\w+)"', source))
    page = (ROOT / "docs" / "questions" / "statuses.md").read_text(encoding="utf-8")
    assert len(words) >= 9 and set(re.findall(r"^## (\w+)$", page, re.MULTILINE)) == words


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example_runs(example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [str(example), str(tmp_path)])
    runpy.run_path(str(example), run_name="__main__")
    assert list(tmp_path.glob("*.png"))


def test_examples_are_numbered_short_and_name_themselves() -> None:
    assert [int(example.name[:2]) for example in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
    for example in EXAMPLES:
        text = example.read_text(encoding="utf-8")
        assert len(text.splitlines()) < 60, example.name
        assert f"python examples/{example.name}" in " ".join(text.split()), example.name


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


def test_every_file_says_what_it_is_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import files

    page = files.files_page()
    rows = dict(re.findall(r"^\| `([\w.]+)` \| (.*) \|$", page, re.MULTILINE))
    known = [*(ROOT / "rust" / "src").rglob("*.rs"), *(ROOT / "python" / "chebclear").rglob("*.py")]
    openings = ("mod.rs", "__init__.py")
    assert {path.name for path in known if path.name not in openings} == set(rows)
    assert not [name for name, text in rows.items() if not text.endswith(".") or len(text) < 15]
    assert rows["samples.rs"].startswith("The table of samples of a run")


def test_names_in_the_path_of_a_force_and_the_ways_to_add_something_exist() -> None:
    text = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
    told = text[text.index("## One contact force") : text.index("## Work\n")]
    folders = (("rust/src", "*.rs"), ("python/chebclear", "*.py"))
    files = [path for root, kind in folders for path in (ROOT / root).rglob(kind)]
    files += [*(ROOT / "tests").rglob("*.*"), *(ROOT / "docs").glob("*.*")]
    paths = ["/" + path.relative_to(ROOT).as_posix() for path in files]
    code = "\n".join(path.read_text(encoding="utf-8") for path in files if path.suffix in (".rs", ".py"))
    words = set(re.findall(r"`([\w./:]+)`", told))
    assert len(words) > 60
    wrong = []
    for word in words:
        if word.endswith((".rs", ".py", ".md")):
            wrong += [word] * (not any(path.endswith("/" + word) for path in paths))
        elif not word.startswith("."):
            names = re.findall(r"\w{3,}", word)
            wrong += [word] * (not all(re.search(rf"\b{name}\b", code) for name in names))
    assert not wrong


def test_the_changelog_names_what_users_call_and_catch() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    named = set(re.findall(r"[\w-]+", " ".join(re.findall(r"`([^`]*)`", text))))
    public = {name: one for name, one in public_names().items() if name not in mechanisms.__all__}
    wanted = {
        name
        for name, value in public.items()
        if (issubclass(value, Exception) if isinstance(value, type) else callable(value))
    }
    (commands,) = (action.choices for action in program.parser()._actions if action.dest == "command")
    options = {
        text for action in commands["study"]._actions for text in action.option_strings if text[:2] == "--"
    }
    usual = {
        "--help",
        *(f"--{name}" for name in ("duration", "skip", "samples", "outputs", "method", "rtol")),
    }
    missing = {*wanted, *commands, *(options - usual)} - named
    assert not missing
    for code in (0, 1, 2, 3, 70, 130):
        assert re.search(rf"\b{code} [a-z]", text[text.index("Exit codes") :])
