"""Files kept on disk by fingerprint, so that other processes need not make again what they hold.

Kept in `PLANAR_CACHE`, or where it is not set in the user's folder for such things; not at all where it says "off".
What is read is run with the user's rights, so only what the user's own process has written there is read: the folder
and the file must be the user's, writable by nobody else, and the file must hold the digest of the rest of it. Whatever
is amiss, and where nothing can be written, all is made again. Each kind of file has a folder of its own there, tagged
as a cache, and of that only files that bear its names and its mark are ever removed.
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

CHECKSUM_LENGTH = 32
"""Bytes of a digest, which stands before the content."""
CACHE_TAG_NAME = "CACHEDIR.TAG"
CACHE_TAG_TEXT = (
    b"Signature: 8a477f597d28d172789f06886806bc55\n# What planar need not make again; may be removed at any time.\n"
)
"""By the Cache Directory Tagging Specification, so that backups leave the folder out."""
SWEEPS_PER_FILLING = 16
"""How often at most it is looked whether too much is kept, while a process writes as much as may be."""
_is_disabled: ContextVar[bool] = ContextVar("nowhere", default=False)


@contextmanager
def disable_cache() -> Iterator[None]:
    """Nothing is read or kept."""
    before = _is_disabled.set(True)
    try:
        yield
    finally:
        _is_disabled.reset(before)


def cache_folder() -> Path | None:
    """The folder of all that is kept; None where nothing is to be, or where the system tells no place."""
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


class PrivateCache:
    """Files of one kind, which begin with `header` and have names that end with `suffix`, in a folder of their own.

    Of more than `max_bytes` those that have not been read for longest go first.
    """

    def __init__(self, folder: str, suffix: str, header: bytes, max_bytes: int):
        self.folder_name, self.suffix, self.header, self.max_bytes = folder, suffix, header, max_bytes
        self._unswept_bytes: int | None = None
        "written by this process since it was last looked whether too much is kept; None before the first time"

    def folder(self) -> Path | None:
        """Where they are kept; None where they are not to be, or where the system tells no place."""
        place = cache_folder()
        return place and place / self.folder_name

    def read(self, key: str) -> bytes | None:
        """The content of a fingerprint, if it is kept and nothing is amiss."""
        place = self.folder()
        if place is None:
            return None
        path = place / f"{key}{self.suffix}"
        whole = read_private(path)
        if whole is None or not whole.startswith(self.header):
            return None
        start = len(self.header) + CHECKSUM_LENGTH
        content = whole[start:]
        if whole[len(self.header) : start] != _checksum(key, content):
            return None
        with suppress(OSError):
            os.utime(path)
        return content

    def is_writable(self) -> bool:
        """Whether there is a folder in which something can be kept, which is made where there is none."""
        place = self.folder()
        if place is None:
            return False
        with suppress(OSError):
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
        return os.access(place, os.W_OK)

    def write(self, key: str, content: bytes) -> bool:
        """Keep the content of a fingerprint; whether that was possible."""
        place = self.folder()
        if place is None:
            return False
        if not (place / CACHE_TAG_NAME).exists():
            write_private(place / CACHE_TAG_NAME, CACHE_TAG_TEXT)
        whole = self.header + _checksum(key, content) + content
        if not write_private(place / f"{key}{self.suffix}", whole):
            return False
        if self._unswept_bytes is not None:
            self._unswept_bytes += len(whole)
        if self._unswept_bytes is None or self._unswept_bytes * SWEEPS_PER_FILLING >= self.max_bytes:
            self._remove_oldest(place)
            self._unswept_bytes = 0
        return True

    def _remove_oldest(self, place: Path) -> None:
        """Remove what was not read for longest, until no more is kept than may be."""
        name = re.compile(rf"[0-9a-f]{{64}}{re.escape(self.suffix)}")
        # another process may remove the same files meanwhile
        with suppress(OSError):
            found = []
            for path in place.iterdir():
                if name.fullmatch(path.name) or PARTIAL_FILE_NAME.fullmatch(path.name):
                    known = path.stat()
                    found.append((known.st_mtime_ns, known.st_size, path))
            whole = sum(size for _, size, _ in found)
            for _, size, path in sorted(found):
                if whole <= self.max_bytes:
                    return
                if PARTIAL_FILE_NAME.fullmatch(path.name) or (read_private(path) or b"").startswith(self.header):
                    path.unlink(missing_ok=True)
                whole -= size


def _checksum(key: str, content: bytes) -> bytes:
    """Of content under its fingerprint: no file stands for another."""
    return sha256(key.encode() + content).digest()
