"""Which backends are there, and which are tried for a sweep."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

from planar.batch.march.backend import AssemblyCorrector, DesignRunner, LastGoodUnknowns
from planar.foundation.errors import BadInput

BACKENDS = {"native": "planar.batch.march.llvm_backend", "casadi": "planar.batch.march.numpy_backend"}
"""The modules of the backends, the faster first; each has a function `run_designs`. What users call "casadi"
is numpy, over functions of casadi."""


def find_assembly_corrector(backend: str) -> AssemblyCorrector | None:
    """What closes many designs at once, if the backend that is tried first does."""
    return getattr(import_module(BACKENDS[available_runners(backend)[0][0]]), "correct_assemblies", None)


def find_last_good_unknowns(name: str) -> LastGoodUnknowns | None:
    """What of a backend tells where designs came to, if it does."""
    return getattr(import_module(BACKENDS[name]), "last_good_unknowns", None)


def available_runners(backend: str) -> list[tuple[str, DesignRunner]]:
    """The backends to try, in this order, each with its name; one that raises UnsupportedStructure leaves it to the
    next.

    Raises BadInput.
    """
    if backend not in ("auto", *BACKENDS):
        raise BadInput("backend", f"there is no backend {backend!r:.40}; choose from auto, {', '.join(BACKENDS)}")
    wanted = [*BACKENDS] if backend == "auto" else [*dict.fromkeys((backend, "casadi"))]
    there = [name for name in wanted if find_spec(BACKENDS[name]) is not None]
    found = []
    for name in there:
        try:
            found.append((name, import_module(BACKENDS[name]).run_designs))
        except ImportError:
            continue
    if backend not in ("auto", *(name for name, _ in found)):
        raise BadInput("backend", f"the backend {backend!r} is not installed: pip install 'planar[{backend}]'")
    return found
