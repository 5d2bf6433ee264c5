"""Imports go one way, in Python and in Rust; outside libraries stay where they belong."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "chebclear"
CRATE = ROOT / "rust" / "src"

# A Python module may import only those that stand before it; a surrogate knows nothing of simulations.
PYTHON_ORDER = [
    "checks",
    "errors",
    "quantities",
    "schema",
    "functions",
    "forces",
    "motions",
    "laws",
    "records",
    "progress",
    "scene",
    "description",
    "mechanisms",
    "accuracy",
    "surrogate",
    "settings",
    "trajectory",
    "continuation",
    "plausibility",
    "simulation",
    "results",
    "study_runs",
    "study",
    "plot",
    "plane",
    "pose",
    "symbols",
    "drawing",
    "plot_costs",
    "report",
    "recommend",
    "tradeoff_result",
    "tradeoff",
    "tradeoff_output",
    "study_tradeoff",
    "paper",
    "paper_figures",
    "paper_output",
    "cli",
    "__main__",
]
# Imports against the order that methods make when they are called, for the convenience of the user.
PYTHON_EXCEPTIONS = {
    ("scene", "_core"),
    ("scene", "description"),
    ("trajectory", "plot"),
    ("surrogate", "plot"),
    ("study", "study_tradeoff"),
}
USES_CORE = {"simulation", "surrogate", "continuation", "study_runs"}
USES_MATPLOTLIB = {"plot", "plot_costs", "drawing", "paper_figures", "tradeoff_output"}

# A Rust module may import only those that stand before it in its own chain; the chains meet in python.rs.
PHYSICS_ORDER = [
    "error",
    "dual",
    "linear",
    "turns",
    "instant",
    "time_function",
    "contact",
    "friction",
    "clearance",
    "scene",
    "scene_check",
    "json",
    "scene_reader",
    "kinematics",
    "constraints",
    "mechanism",
    "tree",
    "dynamics",
    "scales",
    "assembly",
    "contacts",
    "work",
    "outputs",
    "integrators",
    "settings",
    "restart",
    "tolerances",
    "recorder",
    "run_warnings",
    "kinematic_run",
    "trajectory",
    "sweep",
]
ARRAYS_ORDER = ["chebyshev", "bounds"]
TOP = "python"


def is_type_checking(node):
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def imports(node, inside_function=False, in_folder=False):
    """(package, module or None, inside a function) for every import below a node, but for types only."""
    for child in ast.iter_child_nodes(node):
        if is_type_checking(child):
            continue
        if isinstance(child, ast.Import):
            for alias in child.names:
                package, *rest = alias.name.split(".")
                yield package, rest[0] if rest else None, inside_function
        elif isinstance(child, ast.ImportFrom):
            package, *rest = (child.module or "").split(".")
            if child.level == 2 or (child.level == 1 and not in_folder):
                package, rest = "chebclear", [package] if package else []
            elif child.level:  # a sibling in the folder of a module
                continue
            names = rest[:1] if rest or package != "chebclear" else [alias.name for alias in child.names]
            for name in names or [None]:
                yield package, name, inside_function
        nested = inside_function or isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        yield from imports(child, nested, in_folder)


def python_modules():
    """Names of the modules; a folder counts as one."""
    files = [path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py")]
    return sorted({path.parts[0].removesuffix(".py") for path in files} - {"__init__"})


def python_imports(module):
    """Imports of a module; those of a folder, of all its files, but not of each other."""
    single = PACKAGE / f"{module}.py"
    files = [single] if single.exists() else sorted((PACKAGE / module).glob("*.py"))
    return [
        found
        for path in files
        for found in imports(ast.parse(path.read_text(encoding="utf-8")), in_folder=path != single)
    ]


@pytest.mark.parametrize("module", python_modules())
def test_python_imports_go_one_way(module):
    assert module in PYTHON_ORDER, f"{module}.py has no place in the order of the modules"
    before = PYTHON_ORDER[: PYTHON_ORDER.index(module)]
    for package, name, lazy in python_imports(module):
        if package != "chebclear" or (lazy and (module, name) in PYTHON_EXCEPTIONS):
            continue
        if name == "_core":
            assert module in USES_CORE, f"{module}.py imports _core"
        else:
            assert name in before, f"{module}.py imports {name}"


@pytest.mark.parametrize("module", python_modules())
def test_matplotlib_is_imported_only_by_functions_that_draw(module):
    for package, _, lazy in python_imports(module):
        if package in ("matplotlib", "mpl_toolkits"):
            assert lazy and module in USES_MATPLOTLIB, f"{module}.py imports {package}"


def rust_modules():
    return sorted(
        {path.relative_to(CRATE).parts[0].removesuffix(".rs") for path in CRATE.rglob("*.rs")} - {"lib"}
    )


def rust_code(module):
    """Source of a module without comments; that of a folder, all its files."""
    files = [CRATE / f"{module}.rs", *sorted((CRATE / module).glob("*.rs"))]
    return "\n".join(re.sub(r"//.*", "", path.read_text(encoding="utf-8")) for path in files if path.exists())


def rust_imports(module):
    code = rust_code(module)
    found = set(re.findall(r"\bcrate::(\w+)", code))
    for group in re.findall(r"\bcrate::\{([^;]*?)\};", code):
        # Only the first name of each path of the group; what stands in inner braces belongs to it.
        flat = re.sub(r"\{[^{}]*\}", "", group)
        found |= {path.split("::")[0].split()[0] for path in flat.split(",") if path.strip()}
    return found - {module}


@pytest.mark.parametrize("module", rust_modules())
def test_rust_imports_go_one_way(module):
    if module == TOP:
        return
    chain = next((order for order in (PHYSICS_ORDER, ARRAYS_ORDER) if module in order), None)
    assert chain is not None, f"{module}.rs has no place in the order of the modules"
    before = chain[: chain.index(module)]
    for name in rust_imports(module):
        assert name in before, f"{module}.rs imports {name}"


@pytest.mark.parametrize("module", rust_modules())
def test_each_outside_crate_has_one_user(module):
    for crate, user in (("pyo3", "python"), ("numpy", "python"), ("rayon", "sweep")):
        assert module == user or not re.search(rf"\b{crate}::", rust_code(module)), (
            f"{module}.rs uses {crate}"
        )


def test_the_reader_of_imports_sees_all_forms():
    code = """
import numpy as np
from . import _core, records
from .scene import Scene
import chebclear.plot
from chebclear.study import Study
from chebclear import report
if TYPE_CHECKING:
    from .cli import main
def draw():
    from matplotlib import pyplot
"""
    assert set(imports(ast.parse(code))) == {
        ("numpy", None, False),
        ("chebclear", "_core", False),
        ("chebclear", "records", False),
        ("chebclear", "scene", False),
        ("chebclear", "plot", False),
        ("chebclear", "study", False),
        ("chebclear", "report", False),
        ("matplotlib", None, True),
    }
    assert {"bounds", "sweep", "scene_reader"} <= rust_imports("python")
