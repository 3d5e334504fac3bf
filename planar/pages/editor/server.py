"""The server of the page on which a mechanism is drawn: on this machine alone, for that page alone, and no longer.

It listens at 127.0.0.1 and answers what comes with a token that nobody can guess, from its own page: the Host and the
Origin of what is asked are looked at, so that another site's page can neither ask by a name of its own (DNS rebinding)
nor by a form. It writes nothing but the file that the reader saves, and ends once its page is closed.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

from planar.document.files import MAX_FILE_BYTES, from_dict, parse_json
from planar.document.texts.json_layout import format_json
from planar.foundation.errors import BadInput, PlanarError
from planar.foundation.safe_files import file_sha256, save_file
from planar.pages.editor.answer import conflict_answer, edit_answer
from planar.pages.editor.edit_page import edit_page
from planar.pages.editor.search import BackgroundSearch

LOCAL = "127.0.0.1"
CLOSING_PAUSE = 5.0
"""s: a page that is loaded again is back by then, once it has been sent."""
SILENCE = 200.0
"""s: an open page is heard of more often; browsers wake pages that nobody sees once a minute."""
REQUEST_TIMEOUT = 30.0
"""s, after which a connection that says nothing is dropped."""
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


class EditServer(ThreadingHTTPServer):
    """Serves the page of a file's JSON value, saved to `path`, or to a name in `folder` that the reader gives."""

    daemon_threads = True

    def __init__(self, value: Any, path: Path | None, folder: Path):
        super().__init__((LOCAL, 0), _Handler)
        self.value, self.path, self.folder = value, path, folder
        self.mark = file_mark(path)
        self.token = token_urlsafe(24)
        self.work = threading.Lock()
        "one answer at a time: equations are built by a library that many threads must not enter"
        self.search: BackgroundSearch | None = None
        "the last one that a page has begun"
        self.open_pages: dict[str, float] = {}
        self.was_open = False
        self.last_heard = time.monotonic()

    @property
    def origin(self) -> str:
        """The origin of its page."""
        return f"http://{LOCAL}:{self.server_port}"

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"{self.origin}/{self.token}/"

    def hear(self, page: str, is_open: bool) -> None:
        """A page says that it is still there, or that it goes."""
        self.last_heard = time.monotonic()
        if is_open:
            self.was_open = True
            self.open_pages[page] = self.last_heard
        else:
            self.open_pages.pop(page, None)

    def hold(self) -> None:
        """A page is on its way: wait for what it says."""
        self.last_heard = time.monotonic()

    def is_over(self) -> bool:
        """Whether the page was open and is so no more."""
        now = time.monotonic()
        self.open_pages = {page: heard for page, heard in self.open_pages.items() if now - heard < SILENCE}
        return self.was_open and not self.open_pages and now - self.last_heard > CLOSING_PAUSE

    def service_actions(self) -> None:
        """End once the page is closed."""
        if self.is_over():
            self.was_open = False
            threading.Thread(target=self.shutdown, daemon=True).start()

    def server_close(self) -> None:
        """End, with a search that still runs."""
        super().server_close()
        if self.search is not None:
            self.search.end()

    def begin_search(self, task: Any) -> dict[str, Any]:
        """Search for what a task's JSON value wants, in place of what was searched for before. Raises BadInput."""
        begun = BackgroundSearch(task)
        if self.search is not None:
            self.search.end()
        self.search = begun
        return begun.tell()

    def tell_search(self, number: Any, stops: bool) -> dict[str, Any]:
        """How far a search is, by its number; stopped, if that is wanted."""
        if self.search is None or self.search.number != number:
            return {"is_over": True, "problem": "Another search has taken the place of this one."}
        if stops:
            self.search.stop()
        return self.search.tell()

    def save(self, value: Any, name: str | None, mark: Any = "", replaces: bool = False) -> dict[str, Any]:
        """Write a file's JSON value: {file, mark}.

        {taken, own} where nothing is written: another file has that name, or the own one has changed since the page
        knew it by its `mark`, saved by another window or program.
        """
        from_dict(value)
        path = self.path if name is None else self.folder / _file_name(name)
        if path is None:
            raise BadInput("name", "the mechanism has no file yet; give a name")
        own = path == self.path
        if path.exists() and not replaces and not (own and file_mark(path) == mark):
            return {"taken": path.name, "own": own}
        save_file(path, format_json(value) + "\n")
        self.path, self.value, self.mark = path, value, file_mark(path)
        return {"file": path.name, "mark": self.mark}


def file_mark(path: Path | None) -> str:
    """What tells the content of a file from any other; empty where there is none."""
    try:
        return file_sha256(path) if path else ""
    except OSError:
        return ""


def _file_name(name: str) -> str:
    """The name of a file in the folder. Raises BadInput."""
    name = name.strip()
    if not name or name in (".", "..") or Path(name).name != name or "\\" in name or not name.isprintable():
        raise BadInput("name", "a file's name without folders is wanted, such as press.json")
    return name if name.lower().endswith(".json") else f"{name}.json"


class _Handler(BaseHTTPRequestHandler):
    """One request: looked at, then answered."""

    server: EditServer
    timeout = REQUEST_TIMEOUT
    server_version = "planar"
    sys_version = ""

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # as the library calls it
        """Nothing of what is asked stands in the terminal."""

    def do_GET(self) -> None:
        """The page."""
        if self._may("") is None:
            return
        with self.server.work:
            path = self.server.path
            self.server.hold()
            text = edit_page(self.server.value, path.name if path else None, self.server.mark)
        self._send(HTTPStatus.OK, text, "text/html; charset=utf-8")
        self.server.hold()

    def do_POST(self) -> None:
        """What the page asks: an answer on a drawing, to save it; that it is there, or goes."""
        acts: dict[str, Callable[[Any], Any]] = {
            "answer": lambda asked: edit_answer(asked["document"]),
            "conflict": lambda asked: conflict_answer(asked["document"]),
            "synthesise": lambda asked: self.server.begin_search(asked["task"]),
            "search": lambda asked: self.server.tell_search(asked["search"], bool(asked.get("stops"))),
            "save": lambda asked: self.server.save(
                asked["document"], asked.get("name"), asked.get("mark"), bool(asked.get("replaces"))
            ),
            "open": lambda asked: self.server.hear(str(asked["page"]), True),
            "gone": lambda asked: self.server.hear(str(asked["page"]), False),
        }
        name = self._may(*acts)
        if name is None:
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > MAX_FILE_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "a mechanism's file is wanted, and no more")
            return
        try:
            asked = parse_json(self.rfile.read(int(length)), "$")
            if not isinstance(asked, dict):
                raise BadInput("$", "an object is wanted")
            with self.server.work:
                answer = acts[name](asked)
        except PlanarError as problem:
            answer = {"problem": str(problem)}
        except KeyError as missing:
            answer = {"problem": f"the key {missing} is missing"}
        self._send(HTTPStatus.OK, json.dumps(answer, allow_nan=False), "application/json")

    def _may(self, *names: str) -> str | None:
        """What is asked for, if it comes from the server's own page with the token; else it is refused."""
        _, token, name, *more = [*self.path.split("?")[0].split("/"), "", ""]
        own = {self.server.origin, None} if self.command == "GET" else {self.server.origin}
        if self.headers.get("Host") != self.server.origin.removeprefix("http://"):
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers by its own address alone")
        elif not compare_digest(token.encode(), self.server.token.encode()) or name not in names or any(more[:-2]):
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here; open the address that the terminal shows")
        elif self.headers.get("Origin") not in own or self.headers.get("Sec-Fetch-Site") == "cross-site":
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers its own page alone")
        else:
            return name
        return None

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self.close_connection = True
        self._send(status, sentence + "\n", "text/plain; charset=utf-8")

    def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
        content = text.encode()
        self.send_response(status)
        for key, value in {**HEADERS, "Content-Type": kind, "Content-Length": str(len(content))}.items():
            self.send_header(key, value)
        self.end_headers()
        self.wfile.write(content)
