"""The page of `chebclear show` and what it asks for, served to this computer while the page is open."""

from __future__ import annotations

import json
import math
import secrets
import sys
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from ...base.units import written
from ...errors import ChebclearError, InputError
from ...report.film import plain
from ...report.html import page_with_player
from ...scene.parts import joints_with_play
from ...templates.template import Template
from .film import film_of

# Times [s]: between two looks at the file; without any page until the program ends, enough to load one again.
_LOOK, _GRACE = 0.25, 2.0
MOST_EXAGGERATED = 1000.0
"""Largest factor of clearances in the page [-]."""


class Shown:
    """A scene file and its mechanism at some values of its parameters."""

    def __init__(self, path: Path, read: Callable[[], Template]) -> None:
        self.path, self._read = path, read
        self._kept: tuple[int, Template] | None = None
        self._one_at_a_time = threading.Lock()

    def stamp(self) -> int:
        """When the file was saved; 0 if it is not there, as while an editor replaces it."""
        try:
            return self.path.stat().st_mtime_ns
        except OSError:
            return 0

    def state(self, asked: dict[str, str]) -> dict[str, Any]:
        """What the page shows: parameters, the film, notes; or the problems of the file or of the values.

        Asked for are ``"exaggerate"``, and values by ``"value."`` and the name of a parameter [SI units]; one
        outside its interval counts as not given.
        """
        with self._one_at_a_time:
            state: dict[str, Any] = {"file": self.path.name, "problems": [], "notes": [], "parameters": []}
            try:
                template = self._template()
                given = {
                    name: value
                    for name, side in template.intervals.items()
                    if side.lower <= (value := _number(asked.get(f"value.{name}"))) <= side.upper
                }
                state |= {"title": template.title, "parameters": _parameters(template, given)}
                scene = template.scene(**given)
                state["play"] = bool(joints_with_play(scene.joints))
                wanted = _number(asked.get("exaggerate"))
                exaggerate = wanted if 1.0 <= wanted <= MOST_EXAGGERATED else 1.0
                film, notes = film_of(scene, exaggerate, template.run.get("duration", 1.0))
                state |= {"film": plain(film), "notes": notes}
            except InputError as error:
                state["problems"] = [str(problem) for problem in error.problems]
            except (ChebclearError, OSError) as error:
                state["problems"] = [str(error)]
            return state

    def _template(self) -> Template:
        stamp = self.stamp()
        if self._kept is None or self._kept[0] != stamp:
            self._kept = None
            self._kept = stamp, self._read()
        return self._kept[1]


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return math.nan


def _parameters(template: Template, given: dict[str, float]) -> list[dict[str, Any]]:
    values = template.values(**given)
    found = []
    for name, side in template.intervals.items():
        one = template.parameters[name]
        words = [written(value, one.unit) for value in (values[name], side.lower, side.upper)]
        facts = {"name": name, "note": one.note, "value": values[name], "nominal": side.nominal}
        found.append(facts | {"lower": side.lower, "upper": side.upper, "words": words})
    return found


class PageServer(ThreadingHTTPServer):
    """Serves the page at a random port of this computer, under an address that nobody can guess."""

    daemon_threads = True
    timeout = _LOOK

    def __init__(self, shown: Shown) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.shown, self.key = shown, secrets.token_urlsafe(12)
        self._lock, self._pages, self._left = threading.Lock(), 0, math.inf

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self.server_address[1]}/{self.key}/"

    def serve(self) -> None:
        """Serve until the last page is closed."""
        while time.monotonic() - self._left < _GRACE:
            self.handle_request()

    def handle_error(self, *given: Any) -> None:
        """A page that is closed in the middle of an answer is no error."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(*given)

    def watched(self, pages: int) -> None:
        """Count a page that opened, 1, or closed, -1."""
        with self._lock:
            self._pages += pages
            self._left = math.inf if self._pages else time.monotonic()


class _Handler(BaseHTTPRequestHandler):
    server: PageServer

    def do_GET(self) -> None:
        address = urlsplit(self.path)
        before, key, wanted = address.path.rpartition(f"/{self.server.key}/")
        if before or not key:
            self.send_error(HTTPStatus.NOT_FOUND)
        elif wanted == "":
            page = page_with_player("chebclear.cli.show", "show.html.j2", "show.js")
            self._answer("text/html; charset=utf-8", page)
        elif wanted == "state":
            state = self.server.shown.state(dict(parse_qsl(address.query)))
            self._answer("application/json", json.dumps(state, allow_nan=False))
        elif wanted == "saved":
            self._watch()
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _answer(self, kind: str, text: str) -> None:
        content = text.encode()
        self._head(kind)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _head(self, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        for name, value in (("Cache-Control", "no-store"), ("Referrer-Policy", "no-referrer")):
            self.send_header(name, value)

    def _watch(self) -> None:
        """Tell the page of every change of the file, until it closes the connection."""
        self.server.watched(1)
        try:
            self._head("text/event-stream")
            self.end_headers()
            seen = -1
            while True:
                stamp = self.server.shown.stamp()
                # A comment when nothing changed: only by writing one learns that the page is closed.
                self.wfile.write(b": open\n\n" if stamp in (seen, 0) else f"data: {stamp}\n\n".encode())
                seen = stamp or seen
                time.sleep(_LOOK)
        except OSError:
            pass
        finally:
            self.server.watched(-1)

    def log_message(self, *_: Any) -> None:
        """Nothing: the terminal is the user's."""
