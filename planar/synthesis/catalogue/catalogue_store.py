"""Catalogues kept on disk, so that a structure is run through its motions but once."""

from __future__ import annotations

import io

import numpy as np

from planar.foundation.private_cache import PrivateCache
from planar.model.mechanism import Mechanism
from planar.synthesis.catalogue.catalogue import Catalogue, build_catalogue, catalogue_key
from planar.synthesis.fitting.wanted_equations import WantedEquations
from planar.synthesis.task.starts import FreeNumbers

CACHE = PrivateCache("catalogues", ".npz", b"planar catalogue 1\n", 2 * 2**30)


def kept_catalogue(
    start: Mechanism, equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int
) -> Catalogue:
    """The catalogue of so many draws, from disk where it is kept there, else made and kept.

    The `equations` may be of a mechanism similar to the `start`: a catalogue is without a size."""
    key = catalogue_key(start, equations, free, count, seed)
    content = CACHE.read(key)
    if content is not None:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            numbers, unknowns, is_whole = (file[name] for name in ("numbers", "unknowns", "is_whole"))
        values = tuple(each.values(numbers, unknowns) for each in equations)
        return Catalogue(numbers, unknowns, values, is_whole)
    found = build_catalogue(equations, free, count, seed)
    if CACHE.is_writable():
        told = io.BytesIO()
        np.savez(told, numbers=found.numbers, unknowns=found.unknowns, is_whole=found.is_whole)
        CACHE.write(key, told.getvalue())
    return found
