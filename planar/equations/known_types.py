"""Elements and block types that are kept with the package: what casadi derived of them, as texts.

A line of the file has a fingerprint of what the text was derived from, and the text. It is made by
`python -m tests.known_types`.
"""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

from planar.foundation.safe_files import read_package_text

KNOWN_TYPES_FILE = Path(__file__).with_name("known_types.txt")
FINGERPRINT_LENGTH = 24


@cache
def _texts() -> dict[str, str]:
    """All texts by their fingerprints."""
    return dict(line.split("\t", 1) for line in read_package_text(KNOWN_TYPES_FILE).splitlines())


def fingerprint(*parts: object) -> str:
    """What tells a type that is derived from these parts from others, in every process."""
    return sha256(repr(parts).encode()).hexdigest()[:FINGERPRINT_LENGTH]


def known_text(type_fingerprint: str) -> str | None:
    """The text of an element or block type; None for one that is not known."""
    return _texts().get(type_fingerprint)
