"""Texts by name of one subject, kept on disk in one file: what processes before made, and what this one adds."""

from __future__ import annotations

import atexit
import json
from collections import deque
from collections.abc import Callable
from pathlib import Path

from planar.foundation.private_cache import PrivateCache

MAX_SUBJECTS = 32
"""Subjects of a process to which texts are added: of those that search through many, what is made first is kept."""
MAX_TEXT_LENGTH = 4 * 2**20
"""Characters of all texts of a subject; what would be more is not kept."""
MAX_IN_MEMORY = 8
"""Subjects whose texts are in memory at a time; those of others are read again where one is asked for."""

_in_memory: deque[KeptTexts] = deque()
_added: list[KeptTexts] = []
"""Subjects with texts that are to be written when the process ends."""


class KeptTexts:
    """The texts of the subject with a fingerprint. They are read when the first is asked for; those that are added are
    written as the process ends."""

    def __init__(self, cache: PrivateCache, key: str):
        self._cache, self._key, self._folder = cache, key, _absolute_folder(cache)
        self._found: dict[str, str] | None = None
        self._new: dict[str, Callable[[], str]] = {}

    def take(self, name: str) -> str | None:
        """The text of a name, if it is kept; it is given once, and not held any longer."""
        found = self._found
        if found is None:
            found = self._found = self._read_all()
            _in_memory.append(self)
            if len(_in_memory) > MAX_IN_MEMORY:
                _in_memory.popleft()._found = None
        return found.pop(name, None)

    def add(self, name: str, make: Callable[[], str]) -> None:
        """Keep what `make` returns, which is called as the process ends."""
        if not self._new:
            if len(_added) >= MAX_SUBJECTS or self._folder is None:
                return
            _added.append(self)
        self._new[name] = make

    def write(self) -> None:
        """Write what was added, beside what another process has written meanwhile; not where the folder is another."""
        made, self._new = self._new, {}
        if _absolute_folder(self._cache) != self._folder or not self._cache.is_writable():
            return
        texts = self._read_all()
        length = sum(map(len, texts.values()))
        for name, make in made.items():
            text = make()
            length += len(text)
            if length <= MAX_TEXT_LENGTH:
                texts[name] = text
        self._cache.write(self._key, json.dumps(texts).encode())

    def _read_all(self) -> dict[str, str]:
        whole = self._cache.read(self._key)
        found: dict[str, str] = {} if whole is None else json.loads(whole)
        return found


def _absolute_folder(cache: PrivateCache) -> Path | None:
    place = cache.folder()
    return place and place.absolute()


@atexit.register
def write_added_texts() -> None:
    """Write what was added to any subject."""
    while _added:
        _added.pop().write()
