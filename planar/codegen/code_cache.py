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

from planar.foundation.safe_files import PARTIAL_FILE_NAME, read_private, write_private

MAX_CACHE_BYTES = 256 * 2**20
"""Bytes of all that is kept; those that have not been read for longest go first."""
CHECKSUM_LENGTH = 32
"""Bytes of a digest, which stands before the code."""
CODE_SUFFIX = ".code"
CODE_FOLDER = "code"
"""The folder in that of all that is kept."""
CODE_HEADER = b"planar machine code\n"
"""How every file of code begins."""
CODE_FILE_NAME = re.compile(rf"[0-9a-f]{{64}}{re.escape(CODE_SUFFIX)}")
CACHE_TAG_NAME = "CACHEDIR.TAG"
CACHE_TAG_TEXT = (
    b"Signature: 8a477f597d28d172789f06886806bc55\n# Machine code kept by planar; may be removed at any time.\n"
)
"""By the Cache Directory Tagging Specification, so that backups leave the folder out."""
_is_disabled: ContextVar[bool] = ContextVar("nowhere", default=False)


@contextmanager
def disable_cache() -> Iterator[None]:
    """Nothing is read or kept."""
    before = _is_disabled.set(True)
    try:
        yield
    finally:
        _is_disabled.reset(before)


def code_folder() -> Path | None:
    """Where code is kept; None where it is not to be, or where the system tells no place."""
    place = _cache_folder()
    return place and place / CODE_FOLDER


def _cache_folder() -> Path | None:
    told = os.environ.get("PLANAR_CACHE", "")
    if _is_disabled.get() or told.strip().lower() == "off":
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


def read_code(key: str) -> bytes | None:
    """The code of a fingerprint, if it is kept and nothing is amiss."""
    place = code_folder()
    if place is None:
        return None
    path = place / f"{key}{CODE_SUFFIX}"
    whole = read_private(path)
    if whole is None or not whole.startswith(CODE_HEADER):
        return None
    digest, code = whole[len(CODE_HEADER) :][:CHECKSUM_LENGTH], whole[len(CODE_HEADER) + CHECKSUM_LENGTH :]
    if digest != _checksum(key, code):
        return None
    with suppress(OSError):
        os.utime(path)
    return code


def write_code(key: str, code: bytes) -> bool:
    """Keep the code of a fingerprint; whether that was possible."""
    place = code_folder()
    if place is None:
        return False
    if not (place / CACHE_TAG_NAME).exists():
        write_private(place / CACHE_TAG_NAME, CACHE_TAG_TEXT)
    if not write_private(place / f"{key}{CODE_SUFFIX}", CODE_HEADER + _checksum(key, code) + code):
        return False
    _remove_oldest(place)
    return True


def _checksum(key: str, code: bytes) -> bytes:
    """Of code under its fingerprint: no file stands for another."""
    return sha256(key.encode() + code).digest()


def _remove_oldest(place: Path) -> None:
    """Remove what was not read for longest, until no more than MOST is kept."""
    # another process may remove the same files meanwhile
    with suppress(OSError):
        found = []
        for path in place.iterdir():
            if CODE_FILE_NAME.fullmatch(path.name) or PARTIAL_FILE_NAME.fullmatch(path.name):
                known = path.stat()
                found.append((known.st_mtime_ns, known.st_size, path))
        whole = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if whole <= MAX_CACHE_BYTES:
                return
            if PARTIAL_FILE_NAME.fullmatch(path.name) or (read_private(path) or b"").startswith(CODE_HEADER):
                path.unlink(missing_ok=True)
            whole -= size
