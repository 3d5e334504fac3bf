"""The server of the page on which a mechanism is drawn: on this machine alone, for that page alone, and no longer.

It listens at 127.0.0.1 and answers what comes with a token that nobody can guess, from its own page: the Host and the
Origin of what is asked are looked at, so that another site's page can neither ask by a name of its own (DNS rebinding)
nor by a form. It writes nothing but the file that the reader saves, and ends once its page is closed.
"""

from __future__ import annotations

import json
import os
import re
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from hashlib import sha256
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.connection import wait
from pathlib import Path
from secrets import token_urlsafe
from socket import MSG_PEEK
from typing import Any

from planar.document.files import MAX_FILE_BYTES, from_dict, parse_json, read_limited
from planar.document.texts.json_layout import format_json
from planar.foundation.errors import BadInput, PlanarError
from planar.foundation.safe_files import file_lock, file_sha256, save_file
from planar.pages.editor.answer import BACKDROP, conflict_answer, edit_answer
from planar.pages.editor.edit_page import edit_page, pending_page
from planar.pages.editor.search import BackgroundSearch
from planar.pages.editor.worker import ComputationStopped, Superseded, Worker

LOCAL = "127.0.0.1"
CLOSING_PAUSE = 5.0
"""s: a page that is loaded again is back by then, once it has been sent."""
SILENCE = 200.0
"""s: an open page is heard of more often; browsers wake pages that nobody sees once a minute."""
REQUEST_TIMEOUT = 30.0
"""s, after which a connection that says nothing is dropped."""
QUEUE_LIMIT, PAGE_LIMIT = 0.02, 10.0
"""s that a page waits for other computations, and s that it may take; else it is sent without positions."""
WORKER = Worker(partial(edit_answer, BACKDROP))
"""The process in which all servers of this process compute."""
MAX_LENGTH_DIGITS = 10
"""Of the number of bytes of a request, which may have leading zeros."""
MAX_NAME_BYTES = 255
"""Of a file's name, on most file systems."""
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


class BadRequest(BadInput):
    """A request that the page never makes, or a name that no file can have: answered by a status of 400."""


class EditServer(ThreadingHTTPServer):
    """Serves the page of a file's JSON value, saved to `path`, or to a name in `folder` that the reader gives.

    Drawings are computed by `WORKER`, a process beside this one, so that saving and loading the page never wait for
    them.
    """

    daemon_threads = True

    def __init__(self, value: Any, path: Path | None, folder: Path):
        super().__init__((LOCAL, 0), _Handler)
        self.value, self.path, self.folder = value, path, folder
        self.mark, self.note = file_mark(path), ""
        self.target = path and path.resolve()
        "the file that `path` leads to"
        self.token = token_urlsafe(24)
        self.is_closed = False
        self.file_state = threading.Lock()
        "of value, path, mark, note and target"
        self.page_state = threading.Lock()
        "of the open pages"
        self.work = threading.RLock()
        "one thread at a time reads a task or makes a page: a library below must not be entered by many"
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
        with self.page_state:
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
        with self.page_state:
            now = time.monotonic()
            self.open_pages = {page: heard for page, heard in self.open_pages.items() if now - heard < SILENCE}
            return self.was_open and not self.open_pages and now - self.last_heard > CLOSING_PAUSE

    def service_actions(self) -> None:
        """End once the page is closed."""
        if self.is_over():
            self.was_open = False
            threading.Thread(target=self.shutdown, daemon=True).start()

    def server_close(self) -> None:
        """End, with a search and a computation that still run."""
        self.is_closed = True
        super().server_close()
        if self.search is not None:
            self.search.end()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report an error of a request in one line; a client that is gone is none."""
        problem = sys.exception()
        if not isinstance(problem, ConnectionError | TimeoutError):
            print(f"planar: a request failed: {type(problem).__name__}: {problem}", file=sys.stderr)

    def page_text(self, has_client: Callable[[], bool]) -> str:
        """The page of the file as it is now; without positions where these take long, or the worker is busy."""
        with self.file_state:
            note = self._read_changes()
            drawn = self.value, _shown_name(self.path), self.mark, note
        try:
            text: str = WORKER.compute(
                edit_page, *drawn, limit=PAGE_LIMIT, queue_limit=QUEUE_LIMIT, has_client=has_client
            )
        except ComputationStopped:
            with self.work:
                text = pending_page(*drawn)
        return text

    def _read_changes(self) -> str:
        """Take over what another program has written to the file; a sentence that says so, until this one saves."""
        name = _shown_name(self.path)
        if self.path is None or (self.path.is_file() and file_mark(self.path) == self.mark):
            return self.note
        try:
            if not self.path.is_file():
                raise BadInput(str(name), "there is no such file any more")
            content = read_limited(self.path)
            value = parse_json(content, str(name))
            if not isinstance(value, dict):
                raise BadInput(str(name), "a mechanism's file is a JSON object")
        except BadInput as problem:
            return f"{problem}; the page shows the drawing as it was before."
        self.value, self.mark = value, sha256(content).hexdigest()
        self.note = f"{name} was written by another window or program; the page shows the file as it is now."
        return self.note

    def begin_search(self, task: Any) -> dict[str, Any]:
        """Search for what a task's JSON value wants, in place of what was searched for before. Raises BadInput."""
        with self.work:
            begun = BackgroundSearch(task)
            if self.search is not None:
                self.search.end()
            self.search = begun
            return begun.tell()

    def tell_search(self, number: Any, stops: bool) -> dict[str, Any]:
        """How far a search is, by its number; stopped, if that is wanted."""
        with self.work:
            if self.search is None or self.search.number != number:
                return {"is_over": True, "problem": "Another search has taken the place of this one."}
            if stops:
                self.search.stop()
            return self.search.tell()

    def save(self, value: Any, name: str | None, mark: Any = "", replaces: bool = False) -> dict[str, Any]:
        """Write a file's JSON value: {file, mark}.

        {taken, own} where nothing is written: another file has that name, or the own one has changed since the page
        knew it by its `mark`, saved by another window or program. Of several servers that save to one file at once
        the first writes it, and the others return {taken, own}. Raises BadInput.
        """
        from_dict(value)
        with self.file_state:
            path = self.path if name is None else self.folder / _file_name(name)
            if path is None:
                raise BadInput("name", "the mechanism has no file yet; give a name")
            target = self._checked_target(path)
            own = path == self.path
            with file_lock(target):
                if target.exists() and not replaces and not (own and file_mark(target) == mark):
                    return {"taken": _shown_name(path), "own": own}
                save_file(target, format_json(value) + "\n")
                self.mark = file_mark(target)
            self.path, self.target, self.value, self.note = path, target, value, ""
            return {"file": _shown_name(path), "mark": self.mark}

    def _checked_target(self, path: Path) -> Path:
        """The file that a path leads to: in the folder, or the one that the server was started with.

        Raises BadRequest where that is elsewhere, or is no regular file.
        """
        try:
            target = path.resolve()
            is_special = target.exists() and not target.is_file()
        except (OSError, RuntimeError) as problem:  # RuntimeError: links that lead in a circle
            raise BadRequest("name", f"no file can have this name: {problem}") from None
        if target.parent != self.folder.resolve() and target != self.target:
            raise BadRequest("name", f"{_shown_name(path)} is a link to a file out of the folder; give another name")
        if is_special or target.is_symlink():
            raise BadRequest("name", f"{_shown_name(path)} is a folder, a pipe or a device; give another name")
        return target


def file_mark(path: Path | None) -> str:
    """What tells the content of a file from any other; empty where there is none."""
    try:
        return file_sha256(path) if path and path.is_file() else ""  # to open a pipe waits for its other end
    except OSError:
        return ""


def _shown_name(path: Path | None) -> str | None:
    """The name of a file as text, though the file system may have bytes that are none."""
    return None if path is None else os.fsencode(path.name).decode(errors="replace")


def _file_name(name: Any) -> str:
    """The name of a file in the folder. Raises BadRequest."""
    text = name.strip() if isinstance(name, str) else ""
    if not text or text in (".", "..") or Path(text).name != text or "\\" in text or not text.isprintable():
        raise BadRequest("name", "give the name of a file as text, without folders, such as press.json")
    text = text if text.lower().endswith(".json") else f"{text}.json"
    length = len(os.fsencode(text))
    if length > MAX_NAME_BYTES:
        raise BadRequest("name", f"a file's name has {MAX_NAME_BYTES} bytes at most, and this has {length}")
    return text


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
        self.server.hold()
        self._send(HTTPStatus.OK, self.server.page_text(self._has_client), "text/html; charset=utf-8")
        self.server.hold()

    def do_POST(self) -> None:
        """What the page asks: an answer on a drawing, to save it; that it is there, or goes."""
        acts: dict[str, Callable[[Any], Any]] = {
            "answer": lambda asked: self._compute(edit_answer, asked),
            "conflict": lambda asked: self._compute(conflict_answer, asked),
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
        if re.fullmatch("[0-9]+", length) is None:
            self._refuse(HTTPStatus.BAD_REQUEST, "the header Content-Length must be a whole number of bytes")
            return
        if len(length) > MAX_LENGTH_DIGITS or int(length) > MAX_FILE_BYTES:
            sentence = f"a request has {MAX_FILE_BYTES} bytes at most, as a mechanism's file"
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, sentence)
            return
        status = HTTPStatus.OK
        try:
            answer = acts[name](self._read_object(int(length)))
        except BadRequest as problem:
            status, answer = HTTPStatus.BAD_REQUEST, {"problem": str(problem)}
        except PlanarError as problem:
            answer = {"problem": str(problem)}
            if isinstance(problem, Superseded):
                answer["is_superseded"] = True
        except KeyError as missing:
            status, answer = HTTPStatus.BAD_REQUEST, {"problem": f"the key {missing} is missing"}
        self._send(status, json.dumps(answer, allow_nan=False), "application/json")

    def _read_object(self, length: int) -> dict[str, Any]:
        """Return the JSON object of a request of `length` bytes. Raises BadRequest."""
        try:
            value = parse_json(self.rfile.read(length), "$")
        except BadInput as problem:
            raise BadRequest(problem.place, problem.sentence) from None
        if not isinstance(value, dict):
            raise BadRequest("$", "an object is wanted")
        return value

    def _compute(self, function: Callable[[Any], Any], asked: Any) -> Any:
        """Compute an answer on a drawing, in place of one on an older drawing of the same page."""
        page = str(asked.get("page", ""))
        return WORKER.compute(function, asked["document"], page=page, has_client=self._has_client)

    def _has_client(self) -> bool:
        """Whether the client still waits: one that is gone has closed its connection."""
        if self.server.is_closed:
            return False
        try:
            return not wait([self.connection], 0.0) or self.connection.recv(1, MSG_PEEK) != b""
        except OSError:
            return False

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
