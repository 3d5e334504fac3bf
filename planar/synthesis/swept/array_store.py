"""Catalogues on disk: arrays one behind the other, after a line that says their names, types and shapes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np

from planar.foundation.private_cache import PrivateCache

KEPT_SWEEPS = PrivateCache("swept", ".designs", b"planar swept designs\n", 4 * 2**30)
"""Swept designs of structures; those of a four-bar take some 60 MB."""
ALIGNMENT = 64


def catalogue_key(*told: Any) -> str:
    """The fingerprint of what a catalogue follows from: of data as JSON has it, arrays among them."""

    def digest(array: np.ndarray) -> list[Any]:
        return [array.dtype.str, array.shape, sha256(np.ascontiguousarray(array).tobytes()).hexdigest()]

    return sha256(json.dumps(told, sort_keys=True, default=digest).encode()).hexdigest()


def keep_arrays(key: str, arrays: Mapping[str, np.ndarray]) -> bool:
    """Keep arrays by name under a fingerprint; whether that was possible."""
    about = [[name, each.dtype.str, each.shape] for name, each in arrays.items()]
    head = json.dumps(about).encode()
    parts = [head + b" " * (-(len(head) + 1) % ALIGNMENT) + b"\n"]
    for each in arrays.values():
        data = np.ascontiguousarray(each).tobytes()
        parts += [data, bytes(-len(data) % ALIGNMENT)]
    return KEPT_SWEEPS.write(key, b"".join(parts))


def kept_arrays(key: str) -> dict[str, np.ndarray] | None:
    """The arrays of a fingerprint, to be read alone; None where none are kept, or where what is kept is not whole."""
    content = KEPT_SWEEPS.read(key)
    if content is None:
        return None
    head, _, _ = content.partition(b"\n")
    at, found = len(head) + 1, {}
    for name, dtype, shape in json.loads(head):
        count = int(np.prod(shape))
        found[name] = np.frombuffer(content, dtype, count, at).reshape(shape)
        size = found[name].nbytes
        at += size + -size % ALIGNMENT
    return found
