"""What is said where friction is left out though pairs have it."""

from __future__ import annotations

from planar.model.mechanism import Mechanism
from planar.model.wording import quote_names


def frictionless_remarks(mechanism: Mechanism) -> tuple[str, ...]:
    """That a mechanism's friction is left out; nothing where it has none."""
    names = [pair.name for pair in mechanism.pairs if pair.has_friction]
    if not names:
        return ()
    return (f"the friction at {quote_names(names)} is left out here; `planar forces` takes it into account",)
