"""Importing the package is cheap: what draws, reports or shows progress is imported when it is asked for."""

import subprocess
import sys
from pathlib import Path

import chebclear as cc
import pytest
from public_names import public_names

SCENE = Path(cc.__file__).parent / "templates" / "starters" / "slider_crank.toml"
LOADED = "import sys, {module}; print(*sys.modules)"
# Each takes a good part of the time that the whole package does, or more.
LATE = {"matplotlib", "PIL", "jinja2", "tqdm", "scipy", "pandas", "xarray", "pressfit", "email", "xml"}


@pytest.mark.parametrize("module", ["chebclear.run.simulation", "chebclear.cli.commands.study"])
def test_an_import_loads_no_library_that_is_not_always_needed(module):
    command = [sys.executable, "-W", "error", "-c", LOADED.format(module=module)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "numpy" in loaded and "chebclear.run.simulation" in loaded
    assert not LATE & {name.partition(".")[0] for name in loaded}


def test_public_names_are_there_and_those_of_pictures_complete():
    # A name of its own for what answers a question; what is only made of numbers stands in a room.
    assert len(cc.__all__) <= 63
    assert {"animate", "print_style", "plot_band"} <= set(cc.plots.__all__)
    assert all(one is not None for one in public_names().values())
    with pytest.raises(AttributeError, match="nothing"):
        cc.nothing  # noqa: B018


def test_an_import_leaves_studies_and_scene_files_for_later():
    command = [sys.executable, "-c", LOADED.format(module="chebclear.run.simulation")]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    for room in ("study", "tradeoffs", "templates", "plots", "execution", "paper", "cli"):
        assert not any(name.startswith(f"chebclear.{room}") for name in loaded)


def test_the_program_can_be_interrupted_before_it_imports_anything():
    command = [sys.executable, "-c", LOADED.format(module="chebclear.cli")]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    own = {name for name in loaded if name.startswith("chebclear")}
    assert own == {"chebclear", "chebclear.cli", "chebclear.cli.entry", "chebclear.cli.ending"}
    assert not {"numpy", "typing", "dataclasses"} & set(loaded)


@pytest.mark.parametrize("words", [["--help"], ["fields", "run"], ["check", str(SCENE), "--no-picture"]])
def test_a_command_loads_only_what_it_needs(words):
    program = f"import sys; from chebclear.cli import run_process; sys.argv = ['chebclear', *{words!r}]\n"
    program += "try: run_process()\nfinally: print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout.split()
    assert "chebclear.cli.program" in loaded and ("numpy" not in loaded or words != ["--help"])
    assert not LATE & {name.partition(".")[0] for name in loaded}
    assert not [name for name in loaded if name.startswith(("chebclear.decisions", "chebclear.tradeoffs"))]
