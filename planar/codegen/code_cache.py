"""Machine code kept on disk by its fingerprint, so that other processes need not compile it again.

Kept in `PLANAR_CACHE`, or where it is not set in the user's folder for such things; not at all where it says "off".
Code runs with the user's rights, so only what the user's own process has written there is read: the folder and the
file must be the user's, writable by nobody else, and the file must hold the digest of the rest of it. Whatever is
amiss, and where nothing can be written, the code is compiled again. It has a folder of its own there, tagged as a
cache, and of that only files that bear its names and its mark are ever removed.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from hashlib import sha256
from pathlib import Path

from planar.document.files import PART, own_bytes, put_private

MOST = 256 * 2**20
"""Bytes of all that is kept; those that have not been read for longest go first."""
DIGEST = 32
"""Bytes of a digest, which stands before the code."""
ENDING = ".code"
OWN = "code"
"""The folder in that of all that is kept."""
MARK = b"planar machine code\n"
"""How every file of code begins."""
NAME = re.compile(rf"[0-9a-f]{{64}}{re.escape(ENDING)}")
TAG = "CACHEDIR.TAG"
TAGGED = b"Signature: 8a477f597d28d172789f06886806bc55\n# Machine code kept by planar; may be removed at any time.\n"
"""By the Cache Directory Tagging Specification, so that backups leave the folder out."""
_nowhere: ContextVar[bool] = ContextVar("nowhere", default=False)


@contextmanager
def nowhere() -> Iterator[None]:
    """Nothing is read or kept."""
    before = _nowhere.set(True)
    try:
        yield
    finally:
        _nowhere.reset(before)


def folder() -> Path | None:
    """Where code is kept; None where it is not to be, or where the system tells no place."""
    place = _place()
    return place and place / OWN


def _place() -> Path | None:
    told = os.environ.get("PLANAR_CACHE", "")
    if _nowhere.get() or told.strip().lower() == "off":
        return None
    if told:
        return Path(told)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "planar" / "Cache"
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "planar"
    of_caches = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # a path that is not absolute is to be ignored, by the rule of the XDG base directories
    return (of_caches if of_caches.is_absolute() else home / ".cache") / "planar"


def read(key: str) -> bytes | None:
    """The code of a fingerprint, if it is kept and nothing is amiss."""
    place = folder()
    if place is None:
        return None
    path = place / f"{key}{ENDING}"
    whole = own_bytes(path)
    if whole is None or not whole.startswith(MARK):
        return None
    digest, code = whole[len(MARK) :][:DIGEST], whole[len(MARK) + DIGEST :]
    if digest != _digest(key, code):
        return None
    with suppress(OSError):
        os.utime(path)
    return code


def write(key: str, code: bytes) -> bool:
    """Keep the code of a fingerprint; whether that was possible."""
    place = folder()
    if place is None:
        return False
    if not (place / TAG).exists():
        put_private(place / TAG, TAGGED)
    if not put_private(place / f"{key}{ENDING}", MARK + _digest(key, code) + code):
        return False
    _bound(place)
    return True


def _digest(key: str, code: bytes) -> bytes:
    """Of code under its fingerprint: no file stands for another."""
    return sha256(key.encode() + code).digest()


def _bound(place: Path) -> None:
    """Remove what was not read for longest, until no more than MOST is kept."""
    # another process may remove the same files meanwhile
    with suppress(OSError):
        found = []
        for path in place.iterdir():
            if NAME.fullmatch(path.name) or PART.fullmatch(path.name):
                known = path.stat()
                found.append((known.st_mtime_ns, known.st_size, path))
        whole = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if whole <= MOST:
                return
            if PART.fullmatch(path.name) or (own_bytes(path) or b"").startswith(MARK):
                path.unlink(missing_ok=True)
            whole -= size
