"""The solutions of a random member of every family that is known: with the package, on disk, or found now and kept."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import ComplexArray, IntArray
from planar.foundation.private_cache import PrivateCache
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.family_names import FamilyName, name_family
from planar.synthesis.exact.tracking.monodromy import GenericSearch, GenericSolutions, find_generic_solutions
from planar.synthesis.exact.tracking.symmetry import exchange_images
from planar.synthesis.exact.tracking.trace_test import trace_test

CACHE = PrivateCache("exact", ".npz", b"planar exact 1\n", 256 * 2**20)
MAX_RECENT = 16
_RECENT: dict[str, dict[str, Any]] = {}
"""What was found in this process, by the names of families: at most so many."""
TESTS = 3
"""Trace tests of a family at most, each with the solutions that were missing at the last."""
KNOWN = Path(__file__).parent / "known"
"""Where those stand that come with the package."""


class FamilyRecord(NamedTuple):
    """What is known of a family: a random member with all solutions `V` that were found of it; `classes` (classes,
    members) are rows of V that stand for the same motion; `is_traced`: whether the trace test says that these are all,
    and `is_tested` whether it was made; `source`: where their number is published, empty where it is not known."""

    name: FamilyName
    solutions: GenericSolutions
    classes: IntArray
    is_traced: bool
    source: str
    is_tested: bool = True

    @property
    def representatives(self) -> GenericSolutions:
        """One of every class."""
        return self.solutions._replace(V=self.solutions.V[self.classes[:, 0]])


def family_record(family: Family, progress: Callable[[int], None] | None = None) -> FamilyRecord:
    """What is known of a family, found now where nothing is, and kept."""
    name = name_family(family)
    content = _packaged(name.text) or _RECENT.get(name.text)
    if content is None:
        kept = CACHE.read(name.text)
        content = _read(kept) if kept is not None else None
    if content is None:
        found = find_generic_solutions(
            family, exchange_images(name.exchanges), progress=progress, store=_UnfinishedSearch(name)
        )
        content = _keep(name, found, False, False)
    return _unpack(name, content)


def tested_record(family: Family, record: FamilyRecord) -> FamilyRecord:
    """A record after the trace test; where this shows that solutions are missing, with those that more members lead to.

    What comes of it is kept.
    """
    name, known = record.name, record.solutions
    for seed in range(TESTS):
        is_traced = trace_test(family, known, name.exchanges)
        more = None if is_traced else GenericSearch(family, exchange_images(name.exchanges), TESTS + seed).extend(known)
        if more is None or len(more.V) == len(known.V):
            break
        known = more
    return _unpack(name, _keep(name, known, is_traced, True))


def _keep(name: FamilyName, found: GenericSolutions, is_traced: bool, is_tested: bool) -> dict[str, Any]:
    """A record as arrays, kept on disk where anything can be."""
    content = pack_record(name, found, np.arange(len(found.V))[:, None], is_traced, "")
    content["is_tested"] = np.array(is_tested)
    if len(_RECENT) >= MAX_RECENT:
        _RECENT.clear()
    _RECENT[name.text] = content
    if CACHE.is_writable():
        CACHE.write(name.text, write_record(content))
    return content


class _UnfinishedSearch:
    """Where the search for the solutions of a family is kept as long as it is not at its end."""

    def __init__(self, name: FamilyName):
        self.key = sha256(f"unfinished {name.text} {name.unknowns} {name.given}".encode()).hexdigest()

    def read(self) -> dict[str, Any] | None:
        """What was kept."""
        kept = CACHE.read(self.key)
        return None if kept is None else _read(kept)

    def write(self, content: dict[str, Any]) -> None:
        """Keep it, where anything can be kept."""
        if CACHE.is_writable():
            CACHE.write(self.key, write_record(content))


def pack_record(
    name: FamilyName, found: GenericSolutions, classes: IntArray, is_traced: bool, source: str
) -> dict[str, Any]:
    """A record as arrays, in the order of symbols that all families of one name share."""
    half = found.V.shape[1] // 2
    own = np.array(name.unknowns, dtype=int) + 1
    V = found.V[:, [0, *own.tolist(), half, *(own + half).tolist()]]
    parts = [found.member.parts[0][:, list(name.given)], *found.member.parts[1:]]
    named = {f"part{k}": part for k, part in enumerate(parts)}
    return {"V": V, "classes": classes, "is_traced": np.array(is_traced), "source": np.array(source), **named}


def write_record(content: dict[str, Any]) -> bytes:
    """A record as the bytes of a file."""
    told = io.BytesIO()
    np.savez_compressed(told, **content)
    return told.getvalue()


def _read(content: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


@lru_cache(maxsize=8)
def _packaged(text: str) -> dict[str, Any] | None:
    path = KNOWN / f"{text[:16]}.npz"
    if not path.is_file():
        return None
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _unpack(name: FamilyName, content: dict[str, Any]) -> FamilyRecord:
    V: ComplexArray = content["V"]
    half = V.shape[1] // 2
    own = np.array(name.unknowns, dtype=int) + 1
    back = np.empty_like(V)
    back[:, [0, *own.tolist(), half, *(own + half).tolist()]] = V
    first = np.empty_like(content["part0"])
    first[:, list(name.given)] = content["part0"]
    others = [content[f"part{k}"] for k in range(1, sum(key.startswith("part") for key in content))]
    member = Member((first, *others))
    return FamilyRecord(
        name,
        GenericSolutions(member, back),
        content["classes"],
        bool(content["is_traced"]),
        str(content["source"]),
        bool(content.get("is_tested", True)),
    )
