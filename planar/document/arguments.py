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
    context = FileContext(mechanism.units)
    return Drive(pair, _cursor(position, pair, context).as_quantity(known[pair].input_quantity_kinds()[0]))


def read_length(mechanism: Mechanism, text: str, place: str) -> float:
    """A length (m) written as text: a number in the file's unit, or a quantity. Raises BadInput."""
    return _cursor(text, place, FileContext(mechanism.units)).as_positive("length")


def read_mass(mechanism: Mechanism, text: str, place: str) -> float:
    """A mass (kg) written as text: a number in the file's unit, or a quantity. Raises BadInput."""
    return _cursor(text, place, FileContext(mechanism.units)).as_positive("mass")


def read_effort(mechanism: Mechanism, pair: str, text: str, place: str) -> float:
    """An effort at a pair (N or N m) written as text: a number in the file's unit, or a quantity. Raises BadInput."""
    kind = EFFORT_KINDS.get(relative_motions(mechanism)[pair].input_kind, "torque")
    return _cursor(text, place, FileContext(mechanism.units)).as_quantity(kind)


def read_time(text: str, place: str) -> float:
    """A time (s) written as text: a number of seconds, or a quantity. Raises BadInput."""
    return _cursor(text, place).as_quantity("time")


def _cursor(text: str, place: str, context: FileContext | None = None) -> Cursor:
    """What is written as text, as the value of a file."""
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return Cursor(value, place) if context is None else Cursor(value, place, context)
