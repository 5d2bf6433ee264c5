"""Imports between rooms go one way, in Python and in Rust; outside libraries stay where they belong.

A room is a folder, or a single file beside the folders. Every import counts, inside functions too. Only those
for type checkers do not, so that pictures and reports can name what they show, nor those of `_repr_html_`, so
that a scene can be drawn in a notebook.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "python" / "chebclear"
CRATE = ROOT / "rust" / "src"

# A room uses only rooms that stand before it.
PYTHON_ROOMS = (
    "_core errors base notices version data report scene mechanisms plots run execution study"
    " templates linkages tradeoffs decisions laws distributions motions"
    " features results loading paper cli __main__"
).split()
RUST_ROOMS = (
    "error numerics expression contact scene tree dynamics mechanism integrators run study python".split()
)

# A chapter of a room uses only chapters that stand before it, and no file beside them.
CHAPTERS = {"study": ["polynomials", "sources", "band", "features", "requirements", "report"]}

USES_CORE = {"scene", "run", "execution", "study"}
USES_MATPLOTLIB = {"plots", "report", "paper", "tradeoffs", "cli"}
CRATES = {"pyo3": "python", "numpy": "python", "rayon": "study"}


def python_files():
    return sorted(PACKAGE.rglob("*.py"))


def python_room(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


class _Runs(ast.NodeTransformer):
    """Takes away what only type checkers read, and what only a notebook that shows a result asks for."""

    def visit_If(self, node):
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return None
        return self.generic_visit(node)

    def visit_FunctionDef(self, node):
        return None if node.name == "_repr_html_" else self.generic_visit(node)


def running(text):
    """The syntax tree of what runs of a file."""
    return _Runs().visit(ast.parse(text))


@cache
def parsed(path):
    return running(path.read_text(encoding="utf-8"))


def python_imports(path, tree):
    """Dotted names of everything that a file imports, relative ones from the package's root."""
    folder = ["chebclear", *path.relative_to(PACKAGE).parts[:-1]]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = folder[: len(folder) - node.level + 1] if node.level else []
            base = [*start, *(node.module.split(".") if node.module else [])]
            yield from (".".join([*base, alias.name]) for alias in node.names)


@cache
def python_arrows():
    """(file, room it is in, room it uses) for every import between rooms."""
    arrows = []
    for path in python_files():
        if path == PACKAGE / "__init__.py":
            continue
        for name in python_imports(path, parsed(path)):
            package, *rest = name.split(".")
            if package == "chebclear":
                room = rest[0] if rest else "__init__"
                if room != python_room(path):
                    arrows.append((path.name, python_room(path), room))
    return arrows


def test_python_imports_go_one_way():
    wrong = set()
    for file, user, used in python_arrows():
        known = user in PYTHON_ROOMS and used in PYTHON_ROOMS
        if not known or PYTHON_ROOMS.index(used) > PYTHON_ROOMS.index(user):
            wrong.add((user, used, file))
        if used == "_core":
            assert user in USES_CORE, f"{file} uses the core"
    assert not wrong, sorted(wrong)


@pytest.mark.parametrize("room", CHAPTERS)
def test_chapters_of_a_room_build_on_each_other(room):
    known, wrong = CHAPTERS[room], set()
    assert {folder.parent.name for folder in (PACKAGE / room).glob("*/__init__.py")} == set(known)
    for path in (PACKAGE / room).glob("*/*.py"):
        user = path.parent.name
        for name in python_imports(path, parsed(path)):
            used = name.split(".")[2:] if name.startswith(f"chebclear.{room}.") else [user]
            if used[0] not in known[: known.index(user) + 1]:
                wrong.add((user, used[0], path.name))
    assert not wrong, sorted(wrong)


def test_rooms_say_what_they_use():
    for folder in {path.parent for path in python_files()} - {PACKAGE}:
        text = ast.get_docstring(parsed(folder / "__init__.py"))
        assert re.search(r"^In: .*; out: .*\bUses ", text, re.MULTILINE | re.DOTALL), folder
        said = re.findall(r"`(?:\w+\.)?(\w+)`", text.partition("Uses ")[2])
        room = folder.relative_to(PACKAGE).parts[0]
        used = {arrow[2] for arrow in python_arrows() if arrow[1] == room} - {"errors", "notices", "_core"}
        if folder.parent == PACKAGE and "every room" not in text:
            assert used <= set(said), f"{room} uses {used - set(said)} and does not say so"


def test_tests_stand_in_folders_named_after_rooms():
    # Comparisons with other codes, and what is true of the package as a whole, belong to no room.
    for tests, rooms in (("python", [*PYTHON_ROOMS, "independent", "package"]), ("physics", RUST_ROOMS)):
        folders = {path.parent for path in (ROOT / "tests" / tests).glob("*/*") if path.is_file()}
        names = {folder.name for folder in folders if folder.name != "__pycache__"}
        assert names <= set(rooms), names - set(rooms)
    assert not list((ROOT / "tests" / "python").glob("test_*.py"))


def module_of(name, modules):
    """The module that a dotted name is, or is a part of."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name


def test_no_python_modules_import_each_other():
    modules = {}
    for path in python_files():
        parts = ["chebclear", *path.relative_to(PACKAGE).with_suffix("").parts]
        modules[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    uses = {
        module: {
            module_of(name, modules)
            for name in python_imports(path, parsed(path))
            if name.startswith("chebclear.")
        }
        - {"", module, "chebclear"}
        for module, path in modules.items()
        if module != "chebclear"
    }
    # What imports only what is already taken away is taken away; what is left imports each other.
    while free := [module for module, used in uses.items() if not used & set(uses)]:
        for module in free:
            del uses[module]
    assert not uses, {module: sorted(used & set(uses)) for module, used in uses.items()}


def test_matplotlib_is_imported_only_by_functions_that_draw():
    for path in python_files():
        tree = parsed(path)
        uses = set(python_imports(path, tree))
        draws = any(name.split(".")[0] in ("matplotlib", "mpl_toolkits") for name in uses)
        assert not draws or python_room(path) in USES_MATPLOTLIB, f"{path.name} imports matplotlib"
        top = ast.Module([node for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))], [])
        eager = [name for name in python_imports(path, top) if name.split(".")[0] == "matplotlib"]
        assert not eager, f"{path.name} imports matplotlib when it is itself imported"


def rust_files():
    return sorted(path for path in CRATE.rglob("*.rs") if path.name != "lib.rs")


def rust_room(path):
    return path.relative_to(CRATE).parts[0].removesuffix(".rs")


def rust_code(text):
    return re.sub(r"//.*", "", text)


def rust_uses(code):
    """Rooms named by `crate::` paths."""
    found = set(re.findall(r"\bcrate::(\w+)", code))
    for group in re.findall(r"\bcrate::\{([^;]*?)\};", code):
        # Only the first name of each path of the group; what stands in inner braces belongs to it.
        flat = re.sub(r"\{[^{}]*\}", "", group)
        found |= {path.split("::")[0].split()[0] for path in flat.split(",") if path.strip()}
    return found


def rust_inherent(code):
    """Types that a file gives methods which no trait asks for."""
    headers = re.findall(r"^\s*impl\b([^{]*)\{", code, flags=re.MULTILINE)
    for header in headers:
        while (plain := re.sub(r"<[^<>]*>", "", header)) != header:
            header = plain
        if " for " not in header:
            yield re.findall(r"\w+", header.split(" where ")[0])[-1]


def test_rust_imports_go_one_way():
    wrong = set()
    for path in rust_files():
        user = rust_room(path)
        for used in rust_uses(rust_code(path.read_text(encoding="utf-8"))) - {user}:
            if RUST_ROOMS.index(used) > RUST_ROOMS.index(user):
                wrong.add((user, used, path.name))
    assert not wrong, sorted(wrong)


def test_rust_rooms_say_what_they_use():
    for path in CRATE.rglob("mod.rs"):
        text = " ".join(re.findall(r"^//! ?(.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
        assert re.search(r"\bIn: .*; out: .*\b(?:Uses|Knows) ", text), path


def test_rust_methods_stand_in_the_room_of_their_type():
    rooms, methods = {}, set()
    for path in rust_files():
        code = rust_code(path.read_text(encoding="utf-8"))
        for name in re.findall(r"^\s*(?:pub(?:\([^)]*\))? )?(?:struct|enum) (\w+)", code, flags=re.MULTILINE):
            rooms.setdefault(name, set()).add(rust_room(path))
        methods |= {(name, rust_room(path), path.name) for name in rust_inherent(code)}
    wrong = {(name, path) for name, room, path in methods if room not in rooms[name]}
    assert methods and not wrong, sorted(wrong)


@pytest.mark.parametrize("crate", CRATES)
def test_each_outside_crate_has_one_user(crate):
    for path in rust_files():
        if re.search(rf"\b{crate}::", rust_code(path.read_text(encoding="utf-8"))):
            assert rust_room(path) == CRATES[crate], f"{path} uses {crate}"


LONGEST_FUNCTION = 60  # lines, without the docstring and signature in Python
LONG = re.compile(r"^\s*(?://|#) Long because \S.*\w")


def long_python(text):
    """Functions that are too long without a reason: (line, name, length)."""
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            length = node.end_lineno - body[0].lineno + 1 if body else 0
            first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
            if length > LONGEST_FUNCTION and not reason_above(lines, first - 1):
                yield node.lineno, node.name, length


def long_rust(text):
    """The same for formatted Rust: a function ends at the brace below the start of its first line."""
    lines = text.splitlines()
    for first, line in enumerate(lines):
        if not (match := re.match(r"(\s*)(?:pub(?:\([^)]*\))? )?(?:const )?fn (\w+)", line)):
            continue
        ends = (
            n for n in range(first, len(lines)) if lines[n] == match[1] + "}" or lines[n].endswith(("}", ";"))
        )
        # A signature, or a body, on one line ends there.
        short = line.endswith((";", "}"))
        last = first if short else next(n for n in ends if re.match(match[1] + r"[})]", lines[n]))
        if last - first + 1 > LONGEST_FUNCTION and not reason_above(lines, first):
            yield first + 1, match[2], last - first + 1


def reason_above(lines, first):
    """Whether the comments, attributes and decorators above a line say why a function is long."""
    while first > 0 and re.match(r"\s*(//|#)", lines[first - 1]):
        first -= 1
        if LONG.match(lines[first]):
            return True
    return False


@pytest.mark.parametrize("root, ending, long", [(PACKAGE, "py", long_python), (CRATE, "rs", long_rust)])
def test_functions_are_short_or_say_why_not(root, ending, long):
    found = {path: list(long(path.read_text(encoding="utf-8"))) for path in sorted(root.rglob(f"*.{ending}"))}
    assert found
    assert not any(found.values()), {
        str(path.relative_to(root)): found[path] for path in found if found[path]
    }
