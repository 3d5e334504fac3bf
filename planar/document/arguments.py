"""Positions and times written as texts, as on a command line."""

from __future__ import annotations

from typing import Any

from planar.document.cursor import Cursor, FileContext
from planar.document.loads import EFFORT_KINDS
from planar.foundation.errors import join_names
from planar.model.mechanism import Drive, Mechanism, relative_motions


def read_drive(mechanism: Mechanism, pair: str, position: str) -> Drive:
    """An input moved to a position written as text: a number in the file's units, or a quantity. Raises BadInput."""
    known = {given.pair: relative_motions(mechanism)[given.pair] for given in mechanism.inputs}
    if pair not in known:
        told = f"there is no input at {pair!r}; inputs are at {join_names(known) if known else 'no pair'}"
        raise Cursor(pair, pair).error_at(None, told)
    try:
        value: Any = float(position)
    except ValueError:
        value = position
    return Drive(
        pair, Cursor(value, pair, FileContext(mechanism.units)).as_quantity(known[pair].input_quantity_kinds()[0])
    )


def read_effort(mechanism: Mechanism, pair: str, text: str, place: str) -> float:
    """An effort at a pair written as text: a number of N or N m, or a quantity. Raises BadInput."""
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return Cursor(value, place).as_quantity(EFFORT_KINDS.get(relative_motions(mechanism)[pair].input_kind, "torque"))


def read_time(text: str, place: str) -> float:
    """A time (s) written as text: a number of seconds, or a quantity. Raises BadInput."""
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return Cursor(value, place).as_quantity("time")
