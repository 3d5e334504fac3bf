"""Files written whole or not at all, files of this user alone, and streams that the shell has closed."""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TextIO

from planar.foundation.errors import BadInput, WriteFailure

NO_SPACE_ERRORS = {
    getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG", "EIO", "EPIPE", "EBADF") if hasattr(errno, name)
}
"""What comes of writing, and not of where."""
NOT_REPLACEABLE_ERRORS = {errno.EACCES, errno.EPERM, errno.EROFS, errno.EBUSY, errno.EXDEV}
"""What comes of a folder that takes no other file, as where one file alone is mounted or may be written."""
NO_LOCK_ERRORS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}
"""What comes of a file system without locks."""
LOCK_WAIT, LOCK_PAUSE = 5.0, 0.01
"""s that a lock is waited for, and s between two attempts."""
PARTIAL_FILE_NAME = re.compile(r"\.[0-9a-f]{24}\.part")
"""Names of files that are not whole yet."""
MAX_SYMLINKS = 40
"""From link to link, as Linux has it."""


def save_file(path: Path, content: str | bytes) -> None:
    """Write a text, or bytes, to a file: all of it, or nothing, so that a file that is there stays whole till then.

    Raises BadInput where there can be no such file, NotWritten where its content finds no room.
    """
    try:
        write_atomically(path, content.encode() if isinstance(content, str) else content)
    except (OSError, ValueError) as problem:
        raise write_error(str(path), "the file", problem) from None


def is_existing(path: str | Path) -> bool:
    """Whether there is something at a path; of what can be no path, as a name that is too long, there is nothing."""
    try:
        return Path(path).exists()
    except OSError:
        return False


def make_folder(path: Path) -> None:
    """Make sure that a folder is there. Raises BadInput where there can be none."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise write_error(str(path), "the folder", problem, "made") from None


def write_error(place: str, what: str, problem: Exception, done: str = "written") -> BadInput:
    """That something cannot be written, as an error: NotWritten where its content found no room, else BadInput."""
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


def read_package_text(path: Path) -> str:
    """The text of a file that comes with the package."""
    return path.read_text(encoding="utf-8")


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

    Raises OSError, of `NOT_REPLACED` where the file has an owner, or other names, that the new one would not have.
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


@contextmanager
def file_lock(path: Path) -> Iterator[None]:
    """Keep other processes that take this lock from writing a file, so that it can be checked and then replaced.

    The lock is a file beside the one that `path` leads to, which the system unlocks if the process dies. Where the
    folder takes no file, or the file system has no locks, nothing is locked. Raises BadInput where another process
    holds the lock for longer than `LOCK_WAIT`.
    """
    try:
        target, _ = _resolve_target(path)
        name = sha256(os.fsencode(target.name)).hexdigest()[:24]
        lock = target.with_name(f".{name}.lock")
        number = _lock_file(lock, str(path))
    except OSError as problem:
        if problem.errno not in NOT_REPLACEABLE_ERRORS | NO_LOCK_ERRORS:
            raise write_error(str(path), "the file", problem) from None
        yield
        return
    try:
        yield
    finally:
        if sys.platform == "win32":  # an open file cannot be removed there
            os.close(number)
        with suppress(OSError):
            lock.unlink(missing_ok=True)
        if sys.platform != "win32":
            os.close(number)


def _lock_file(lock: Path, place: str) -> int:
    """The number of a lock file that this process has made, or taken over, and locked. Raises OSError, BadInput."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    end = time.monotonic() + LOCK_WAIT
    while True:
        number = os.open(lock, flags, 0o666)
        try:
            if _try_lock(number) and lock.exists() and os.path.samestat(os.fstat(number), lock.stat()):
                return number  # else its former owner has removed it
        except BaseException:
            os.close(number)
            raise
        os.close(number)
        if time.monotonic() > end:
            raise BadInput(place, "another program is writing this file; try again when it is done")
        time.sleep(LOCK_PAUSE)


def _try_lock(number: int) -> bool:
    """Lock an open file, if no other process has. Raises OSError where the file system has no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as problem:
        if problem.errno in (errno.EAGAIN, errno.EACCES, errno.EDEADLK):
            return False
        raise
    return True


def _is_private(known: os.stat_result) -> bool:
    """Whether a file or folder is this user's, and nobody else may write to it; where there are no users it is."""
    return not hasattr(os, "getuid") or (known.st_uid == os.getuid() and not known.st_mode & 0o022)


def file_sha256(path: Path) -> str:
    """The SHA-256 of a file's content, in hexadecimal digits. Raises OSError."""
    from hashlib import file_digest

    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
