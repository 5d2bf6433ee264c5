"""A page for every example: its picture, its code and the file; and the pages that run, as notebooks.

The pictures are small files of the repository, since all examples take two minutes. Each says of which script
it is: one that is missing or of another script is drawn, here or by ``python docs/gallery.py``.
"""

import ast
import hashlib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo

ROOT = Path(__file__).parents[1]
PICTURES = Path(__file__).parent / "examples"
WIDTH = 640


def picture(example: Path) -> str:
    """Name of the picture of an example, which is its largest one."""
    stored = PICTURES / f"{example.stem}.png"
    script = hashlib.sha256(example.read_bytes()).hexdigest()
    if not stored.exists() or Image.open(stored).info.get("script") != script:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-W", "ignore", str(example), folder]
            own = os.environ | {"MPLBACKEND": "Agg"}
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=own)
            drawn = max(Path(folder).glob("*.png"), key=lambda path: path.stat().st_size)
            image = Image.open(drawn).convert("RGB")
        image.thumbnail((WIDTH, 2 * WIDTH), Image.Resampling.LANCZOS)
        facts = PngInfo()
        facts.add_text("script", script)
        image.quantize(48, dither=Image.Dither.NONE).save(stored, optimize=True, pnginfo=facts)
    return stored.name


def example_pages(folder: Path) -> None:
    """Write a page for every example and the index with all pictures."""
    (folder / "examples").mkdir(exist_ok=True)
    cells = []
    for example in sorted((ROOT / "examples").glob("*.py")):
        text = example.read_text(encoding="utf-8")
        words = " ".join((ast.get_docstring(ast.parse(text)) or "").split()).replace("``", "`")
        title, _, told = re.sub(r" *Run it with .*", "", words).partition(": ")
        image = f"/examples/{picture(example)}"
        files = [example.name, *sorted(set(re.findall(r"\w+\.toml", text)))]
        lines = [f"# {title}", "", told[:1].upper() + told[1:], ""]
        lines += [f"```{{image}} {image}", f":alt: {told or title}", "```", ""]
        lines += [" · ".join(f"{{download}}`{file} <../../../examples/{file}>`" for file in files), ""]
        lines += [f"Run it with `python {example.name} [DIRECTORY]`.", ""]
        lines += ["```python", text[text.index('"""', 3) + 3 :].strip(), "```", ""]
        (folder / "examples" / f"{example.stem}.md").write_text("\n".join(lines), encoding="utf-8")
        cells.append(f"[![{title}]({image})<br>{title}](examples/{example.stem}.md)")
    lines = [
        "# Examples",
        "",
        "What can be done, and with which lines? Every picture is a script to change.",
        "",
    ]
    lines += ["| | |", "|---|---|"]
    lines += [f"| {' | '.join([*cells, ''][start : start + 2])} |" for start in range(0, len(cells), 2)]
    lines += ["", "```{toctree}", ":hidden:", ":glob:", "", "examples/*", "```", ""]
    (folder / "examples.md").write_text("\n".join(lines), encoding="utf-8")


def notebook(page: str, text: str, folder: Path) -> str:
    """The text of a page with a link to itself as a notebook, which is written into the folder."""
    import jupytext

    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{page.replace('/', '_')}.ipynb"
    jupytext.write(jupytext.reads(text, "md"), file)
    return f"{text}\n{{download}}`This page as a notebook </_generated/notebooks/{file.name}>`\n"


if __name__ == "__main__":
    for path in sorted((ROOT / "examples").glob("*.py")):
        print(picture(path))
