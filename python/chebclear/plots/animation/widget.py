"""Animations as widgets of notebooks, by the package anywidget."""

from __future__ import annotations

import importlib
from typing import Any

from ...errors import MissingProgramError
from ...report.film import Film, player, player_style

_RENDER = """
export default { render({ model, el }) {
  const film = JSON.parse(model.get("film"));
  const shown = playFilm(el, {...film, starts: false}, frame => {
    if (model.get("frame") !== frame) { model.set("frame", frame); model.save_changes(); }
  });
  shown.show(model.get("frame"));
  model.on("change:frame", () => shown.show(model.get("frame")));
  return shown.leave;
} };
"""


def widget_of(film: Film) -> Any:
    """A film as a widget, an `anywidget.AnyWidget`, with the traits ``film``, its JSON, and ``frame``."""
    try:
        anywidget, traitlets = map(importlib.import_module, ("anywidget", "traitlets"))
    except ImportError:
        raise MissingProgramError(
            "a widget needs the package anywidget: pip install 'chebclear[notebook]'"
        ) from None
    traits = {
        "_esm": player() + _RENDER,
        "_css": player_style(),
        "film": traitlets.Unicode().tag(sync=True),
        "frame": traitlets.Int().tag(sync=True),
    }
    # A class of its own, so that importing this module needs no package.
    return type("AnimationWidget", (anywidget.AnyWidget,), traits)(film=film.to_json())
