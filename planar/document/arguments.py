"""Positions and times written as texts, as on a command line."""

from __future__ import annotations

from typing import Any

from planar.document.cursor import Cursor, Whole
from planar.foundation.errors import listed
from planar.model.mechanism import Drive, Mechanism, motions


def read_drive(mechanism: Mechanism, pair: str, position: str) -> Drive:
    """An input moved to a position written as text: a number in the file's units, or a quantity. Raises BadInput."""
    known = {given.pair: motions(mechanism)[given.pair] for given in mechanism.inputs}
    if pair not in known:
        told = f"there is no input at {pair!r}; inputs are at {listed(known) if known else 'no pair'}"
        raise Cursor(pair, pair).refuse(None, told)
    try:
        value: Any = float(position)
    except ValueError:
        value = position
    return Drive(pair, Cursor(value, pair, Whole(mechanism.units)).as_quantity(known[pair].driven()[0]))


def read_time(text: str, place: str) -> float:
    """A time (s) written as text: a number of seconds, or a quantity. Raises BadInput."""
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return Cursor(value, place).as_quantity("time")
