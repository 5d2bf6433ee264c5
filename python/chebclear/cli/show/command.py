"""``chebclear show``: the mechanism in the browser, while its file is edited."""

from __future__ import annotations

import argparse
import threading
import webbrowser

from ...templates.reader import load
from ..options import SCENE, Command, Option
from ..output import tell
from ..scenes import changes_of
from .server import PageServer, Shown


def show(options: argparse.Namespace) -> None:
    """Run the command."""
    shown = Shown(options.scene, lambda: load(options.scene, changes=changes_of(options)))
    with PageServer(shown) as server:
        text = f"page     {server.address}\nends     when the page is closed, or by Ctrl-C"
        tell(options, {"address": server.address}, text)
        if not options.no_browser:
            # One in the terminal would wait here until it is closed.
            threading.Thread(target=webbrowser.open, args=[server.address], daemon=True).start()
        server.serve()


COMMANDS = {
    "show": Command(
        show,
        "Show a scene file in the browser: drag the crank, and parameters within their intervals, and see "
        "positions, transmission angle and lost motion at once. When the file is saved it is read again; its "
        "problems are shown with their lines. The page is served to this computer alone; the program ends "
        "when it is closed.",
        "chebclear show press.toml",
        [*SCENE, Option("--no-browser", None, "only print the address of the page")],
    )
}
