"""A line for every file of the code: the first sentence of what the file says it is for."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
# The folder of each language, and the file that says what a room is for.
TREES = {"rust/src": ("*.rs", "mod.rs"), "python/chebclear": ("*.py", "__init__.py")}


def files_page(root: Path = ROOT) -> str:
    """All files by rooms, as a page of the documentation."""
    page = "# Every file\n\nSorted by name; [the map](../developing.md) has the rooms in the order of use.\n"
    for tree, (kind, opening) in TREES.items():
        page += f"\n## `{tree}`\n"
        rooms: dict[Path, list[Path]] = {}
        for file in sorted((root / tree).rglob(kind)):
            rooms.setdefault(file.parent, []).append(file)
        for room, files in sorted(rooms.items()):
            rows = [f"| `{file.name}` | {purpose(file)} |" for file in files if file.name != opening]
            name = room.relative_to(root / tree).as_posix()
            page += f"\n### `{name}/`\n\n" if name != "." else "\n"
            page += f"{purpose(room / opening)}\n\n" if (room / opening).exists() else ""
            page += "| file | what it is for |\n|---|---|\n" + "\n".join(rows) + "\n" if rows else ""
    return page


def purpose(file: Path) -> str:
    """The first sentence of the text at the head of a file."""
    source = file.read_text(encoding="utf-8")
    if file.suffix == ".py":
        text = ast.get_docstring(ast.parse(source)) or ""
    else:
        text = "\n".join(re.findall(r"^//! ?(.*)$", source, re.MULTILINE))
    paragraph = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=\.) (?=[A-Z])", paragraph)[0].replace("|", "\\|")


if __name__ == "__main__":
    print(files_page(), end="")
