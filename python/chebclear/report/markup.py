"""The only places at which text becomes markup: templates that escape, and single elements.

Names of a scene come from files of strangers: whatever shows them on a page goes through here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


def templates_of(package: str) -> Environment:
    """The templates that stand in a package; all that they are given is escaped."""
    # Here, so that importing the package does not take its 40 ms.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    # Jinja escapes nothing unless told; a name that the template does not know is a mistake, not a blank.
    return Environment(
        loader=PackageLoader(package, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def element(tag: str, content: str | None = None, /, **attributes: object) -> Markup:
    """An element, its attributes, whose underscores are hyphens, and its content, all of them escaped.

    Examples
    --------
    >>> print(element("text", "5 < 6", font_size=9), element("img", alt='"x"'))
    <text font-size="9">5 &lt; 6</text> <img alt="&#34;x&#34;"/>
    """
    from markupsafe import Markup

    pairs = "".join(f' {name.replace("_", "-")}="{{}}"' for name in attributes)
    start = Markup(f"<{tag}{pairs}").format(*attributes.values())
    return start + (Markup("/>") if content is None else Markup(">{}</{}>").format(content, tag))
