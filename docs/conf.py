"""How the documentation is built: ``sphinx-build -W docs build/docs``."""

import os
import sys
from pathlib import Path

import chebclear

sys.path.insert(0, str(Path(__file__).parent))
import generate

project = "chebclear"
author = "The chebclear developers"
copyright = f"2026, {author}"
version = release = chebclear.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
extensions += ["sphinx.ext.intersphinx", "sphinx_copybutton", "sphinxcontrib.bibtex", "mathml", "answers"]
bibtex_bibfiles = ["_generated/references.bib"]
bibtex_reference_style = "author_year"
# Lines that are typed, without prompts and without what they print.
copybutton_prompt_text = ">>> |\\.\\.\\. "
copybutton_prompt_is_regexp = True
copybutton_exclude = ".linenos, .gp, .go"
# Names of other projects become links where their lists can be fetched: a build needs no network otherwise.
_OTHERS = {
    "python": "https://docs.python.org/3",
    "numpy": "https://numpy.org/doc/stable",
    "matplotlib": "https://matplotlib.org/stable",
    "pandas": "https://pandas.pydata.org/docs",
    "xarray": "https://docs.xarray.dev/en/stable",
}
intersphinx_mapping = {name: (url, None) for name, url in _OTHERS.items() if "DOCS_LINKS" in os.environ}
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
# Included in other pages.
exclude_patterns = ["_generated/outputs.md", "_generated/features.md"]
default_role = "py:obj"

autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": False}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = True

html_theme = "furo"
html_title = f"chebclear {release}"
html_static_path: list[str] = []
html_math_renderer = "mathml"
# Files of the repository that pages point to are not pages; short names of fields may mean several classes.
suppress_warnings = ["myst.xref_missing", "ref.python"]


def setup(app):
    """Pages, figures and references that are made from others are made before anything is read."""
    app.connect(
        "builder-inited", lambda app: generate.everything(Path(app.srcdir) / "_generated"), priority=100
    )
