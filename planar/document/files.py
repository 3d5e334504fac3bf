"""The only room that opens files: mechanism files, models that come along, what is kept for other processes."""

from __future__ import annotations

import errno
import json
import os
import re
import stat
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TextIO

from planar.document import read_mechanism
from planar.foundation.errors import BadInput, WriteFailure
from planar.model.mechanism import Mechanism

PIPED = "-"
"""What stands for the input of the process in place of a file's name."""
MAX_FILES_SEARCHED = 10_000
"""Files of a folder that are looked at for one that may be meant."""
MAX_FILE_BYTES = 8 * 1024 * 1024
"""Bytes; a mechanism of ten thousand links takes about two million."""
NO_SPACE_ERRORS = {
    getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG", "EIO", "EPIPE", "EBADF") if hasattr(errno, name)
}
"""What comes of writing, and not of where."""
NOT_REPLACEABLE_ERRORS = {errno.EACCES, errno.EPERM, errno.EROFS, errno.EBUSY, errno.EXDEV}
"""What comes of a folder that takes no other file, as where one file alone is mounted or may be written."""
PARTIAL_FILE_NAME = re.compile(r"\.[0-9a-f]{24}\.part")
"""Names of files that are not whole yet."""
MAX_SYMLINKS = 40
"""From link to link, as Linux has it."""


def loads(text: str | bytes, place: str = "$") -> Mechanism:
    """The mechanism in a JSON text. Raises BadInput."""
    return read_mechanism(_parse_json(text, place))


def from_dict(value: Any) -> Mechanism:
    """The mechanism in a JSON value (dicts, lists, texts, numbers). Raises BadInput."""
    return read_mechanism(value)


def to_dict(mechanism: Mechanism) -> dict[str, Any]:
    """The JSON value of a mechanism; `from_dict` gives the same mechanism back, to the last bit."""
    from planar.document.writer import write_mechanism

    return write_mechanism(mechanism)


def dumps(mechanism: Mechanism) -> str:
    """The JSON text of a mechanism."""
    return json.dumps(to_dict(mechanism), indent=2, ensure_ascii=False) + "\n"


def load(model: str | Path) -> Mechanism:
    """The mechanism in a file, or the model of that name or id that comes along; "-" is what is piped in.

    Raises BadInput.

    >>> import planar
    >>> [link.name for link in planar.load("four-bar").links]
    ['AD', 'AB', 'BC', 'DC']
    """
    if str(model) == PIPED:
        return loads(_piped(), "standard input")
    path = find_model_file(model)
    content = read_limited(path)
    if path.suffix.lower() not in ("", ".json") and not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[")):
        told = "name a JSON file that describes a mechanism, or a model that comes along by its name"
        raise BadInput(str(path), f"this is a {path.suffix} file and no mechanism; {told}")
    return loads(content, str(path))


def save_file(path: Path, content: str | bytes) -> None:
    """Write a text, or bytes, to a file: all of it, or nothing, so that a file that is there stays whole till then.

    Raises BadInput where there can be no such file, WriteFailure where its content finds no room.
    """
    try:
        write_atomically(path, content.encode() if isinstance(content, str) else content)
    except (OSError, ValueError) as problem:
        raise write_error(str(path), "the file", problem) from None


def write_error(place: str, what: str, problem: Exception, done: str = "written") -> BadInput:
    """That something cannot be written, as an error: WriteFailure where its content found no room, else BadInput."""
    kind = WriteFailure if getattr(problem, "errno", None) in NO_SPACE_ERRORS else BadInput
    return kind(place, f"{what} cannot be {done}: {getattr(problem, 'strerror', None) or problem}")


def closed_output() -> TextIO:
    """A stream in place of the output that the shell has closed: to print there is an error, not passed over."""
    return os.fdopen(os.open(os.devnull, os.O_RDONLY), "w", encoding="utf-8", closefd=False)


def discard_stream(stream: Any) -> None:
    """Let what is left of a stream go nowhere, or the interpreter would try to write it once more at its end."""
    with suppress(OSError, ValueError):  # a stream within this process has no number
        number, nowhere = stream.fileno(), os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)
        os.close(nowhere)


def read_asset(name: str) -> str:
    """A text that comes along for pages."""
    return (Path(__file__).parents[1] / "pages" / "assets" / name).read_text(encoding="utf-8")


def read_private(path: Path) -> bytes | None:
    """A file's content if it and its folder are this user's and nobody else may write there; else None."""
    try:
        if not _is_private(path.parent.stat()):
            return None
        with path.open("rb") as file:
            return file.read() if _is_private(os.fstat(file.fileno())) else None
    except OSError:
        return None


def write_private(path: Path, content: bytes) -> bool:
    """Write a file that only this user can read, all at once, into a folder of his own; whether that was possible.

    A folder that is not there is made.
    """
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_private(path.parent.stat()):
            return False
        _replace_file(path, content, 0o600)
    except OSError:
        return False
    return True


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file all at once: a process that is killed leaves the old file or the new one, never a part.

    A link stays one, and the file that it leads to is written, which keeps its owner and permissions. A pipe or a
    device takes the bytes as they come. Raises OSError.
    """
    target, number = _resolve_target(path)
    if number is not None:
        if sys.stdout is not None:
            sys.stdout.flush()
        _write_all(number, content)
        return
    try:
        known = target.stat()
    except FileNotFoundError:
        _replace_file(target, content)
        return
    if not stat.S_ISREG(known.st_mode):
        with target.open("wb", buffering=0) as device:
            _write_all(device.fileno(), content)
        return
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    try:
        _replace_file(target, content, stat.S_IMODE(known.st_mode), known)
    except OSError as problem:
        if problem.errno not in NOT_REPLACEABLE_ERRORS:
            raise
        _overwrite(target, content)


def _resolve_target(path: Path) -> tuple[Path, int | None]:
    """The file to which links lead; of one that stands for what this process has open, as /dev/stdout, its number."""
    for _ in range(MAX_SYMLINKS):
        folder = os.path.realpath(path.parent)
        path = Path(folder, path.name)
        if folder in ("/dev/fd", f"/proc/{os.getpid()}/fd") and path.name.isdecimal():
            return path, int(path.name)
        if not path.is_symlink():
            return path, None
        path = Path(folder, path.readlink())
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _write_all(number: int, content: bytes) -> None:
    """Write bytes to what is open."""
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(number, rest) :]


def _replace_file(
    path: Path, content: bytes, mode: int | None = None, expected_owner: os.stat_result | None = None
) -> None:
    """Write beside a file, then take its place; without a mode it is what new files have.

    Raises OSError, of `NOT_REPLACEABLE_ERRORS` where the file has an owner, or other names, that the new one would not
    have.
    """
    part = path.with_name(f".{os.urandom(12).hex()}.part")
    try:
        # nobody may look into it who may not look into the file itself
        least = 0o666 if mode is None else mode & 0o666
        number = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), least)
        with os.fdopen(number, "wb") as file:
            own = os.fstat(number)
            if expected_owner is not None and (
                expected_owner.st_nlink,
                expected_owner.st_uid,
                expected_owner.st_gid,
            ) != (1, own.st_uid, own.st_gid):
                raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))
            file.write(content)
        if mode is not None:
            part.chmod(mode)
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _overwrite(path: Path, content: bytes) -> None:
    """Write over a file that cannot be replaced: room is made for it first, so that without any it stays whole."""
    with path.open("r+b", buffering=0) as file:
        before = os.fstat(file.fileno()).st_size
        try:
            if content and hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, len(content))
        except OSError as problem:
            file.truncate(before)
            if problem.errno in NO_SPACE_ERRORS:
                raise
        _write_all(file.fileno(), content)
        file.truncate(len(content))


def _is_private(known: os.stat_result) -> bool:
    """Whether a file or folder is this user's, and nobody else may write to it; where there are no users it is."""
    return not hasattr(os, "getuid") or (known.st_uid == os.getuid() and not known.st_mode & 0o022)


def find_model_file(model: str | Path) -> Path:
    """The file that a MODEL argument means: a path, else the name or id of a model that comes along."""
    path = Path(model)
    try:
        if path.is_file():
            return path
        if path.is_dir():
            raise BadInput(str(model) or "''", "this is a folder; name a mechanism file in it")
        if path.exists():
            raise BadInput(str(model), "this is a pipe or a device; save the mechanism to a file and name that")
    except OSError as problem:
        told = f"{str(model)[:60]}…" if len(str(model)) > 100 else str(model)
        raise BadInput(told, f"this cannot be the name of a file: {problem.strerror}") from None
    known = {file.stem: file for file in model_files()}
    if str(model) in known:
        return known[str(model)]
    for file in known.values():
        if str(model) in _parse_json(read_limited(file), str(file)).get("ids", ()):
            return file
    raise BadInput(str(model), _explain_missing(path, known))


def _explain_missing(path: Path, models: Iterable[str]) -> str:
    """What to say of an argument that is no file and no model: what was meant, by its looks a path or a name."""
    from difflib import get_close_matches

    name = path.name.lower()
    stem = name.removesuffix(".json").replace("_", "-").replace(" ", "-")
    alone = len(path.parts) == 1
    if alone and (stem in models or not path.suffix):
        near = get_close_matches(stem, models, 1, 0.6)
        meant = f"did you mean the model {near[0]!r}?" if near else "`planar models` lists the models that come along"
        return f"there is no such file, and no model of that name; {meant}"
    if not path.parent.is_dir():
        return f"there is no such file: there is no folder {str(path.parent)!r}"
    there = {each.stem.lower(): each.name for each in islice(path.parent.glob("*.json"), MAX_FILES_SEARCHED)}
    near = get_close_matches(path.stem.lower(), there, 1, 0.6)  # an ending that all have makes none alike
    told = f"; did you mean {str(path.parent / there[near[0]])!r}?" if near else ""
    return f"there is no such file{told or '; name a mechanism file (JSON), or a model that comes along by its name'}"


def model_files() -> tuple[Path, ...]:
    """The files of the models that come along, in the order of their names."""
    package = Path(__file__).parents[1]
    folder = package / "models" if (package / "models").is_dir() else package.parent / "models"
    return tuple(sorted(folder.rglob("*.json"), key=lambda file: file.stem))


def load_models() -> Iterator[tuple[Path, Mechanism]]:
    """Every model that comes along, read."""
    for file in model_files():
        yield file, load(file)


def file_sha256(path: Path) -> str:
    """The SHA-256 of a file's content, in hexadecimal digits. Raises OSError."""
    from hashlib import file_digest

    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def read_limited(path: Path) -> bytes:
    """The content of a file that is no larger than a mechanism may be. Raises BadInput."""
    try:
        with path.open("rb") as file:
            return _limited(file, str(path))
    except OSError as problem:
        raise BadInput(str(path), f"the file cannot be read: {problem.strerror}") from None


def _piped() -> bytes:
    """What is piped into the process, no longer than a mechanism may be. Raises BadInput."""
    place = "standard input"
    try:
        content = b"" if sys.stdin is None else _limited(sys.stdin.buffer, place)
    except OSError as problem:
        raise BadInput(place, f"it cannot be read: {problem.strerror}") from None
    if not content:
        raise BadInput(place, "it is empty; pipe a mechanism (JSON) into the command, or name a file")
    return content


def _limited(file: BinaryIO, place: str) -> bytes:
    content = file.read(MAX_FILE_BYTES + 1)
    if len(content) > MAX_FILE_BYTES:
        raise BadInput(place, f"the file is larger than the {MAX_FILE_BYTES // 2**20} MiB that a mechanism may take")
    return content


def _parse_json(text: str | bytes, place: str) -> Any:
    def constant(word: str) -> Any:
        raise BadInput(place, f"{word} is not a number that a mechanism can have")

    def once(members: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(members)
        if len(value) < len(members):
            twice = Counter(name for name, _ in members).most_common(1)[0][0]
            raise BadInput(place, f"the key {twice!r} stands twice in one object, so one of the two would be lost")
        return value

    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8-sig")
        return json.loads(text, parse_constant=constant, object_pairs_hook=once)
    except UnicodeDecodeError as problem:
        raise BadInput(place, f"the file is not UTF-8 text (byte {problem.start})") from None
    except json.JSONDecodeError as problem:
        where = f"line {problem.lineno}, column {problem.colno}"
        raise BadInput(place, f"this is not JSON: {problem.msg} at {where}") from None
    except RecursionError:
        raise BadInput(place, "the file is nested too deeply to be a mechanism") from None
    except ValueError:
        raise BadInput(place, "a whole number has more digits than can be read") from None
