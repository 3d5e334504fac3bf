"""Input laws in time: motions of a cam's timing diagram, one after the other."""

from planar.model.input_laws.cam_rises import (
    Cycloidal,
    Harmonic,
    ModifiedTrapezoidal,
    Polynomial345,
    Polynomial4567,
    Trapezoidal,
)
from planar.model.input_laws.constant_rates import ConstantAcceleration, ConstantSpeed, Dwell
from planar.model.input_laws.input_law import Joint, Law
from planar.model.input_laws.segment import MOST, Key, Piece
from planar.model.input_laws.spline_table import Table

MOTIONS: dict[str, type[Piece]] = {
    kind.motion: kind
    for kind in (
        Dwell,
        ConstantSpeed,
        ConstantAcceleration,
        Polynomial345,
        Polynomial4567,
        Cycloidal,
        Harmonic,
        Trapezoidal,
        ModifiedTrapezoidal,
        Table,
    )
}
"""Every motion of a piece, by its name in files."""

__all__ = [
    "MOST",
    "MOTIONS",
    "ConstantAcceleration",
    "ConstantSpeed",
    "Cycloidal",
    "Dwell",
    "Harmonic",
    "Joint",
    "Key",
    "Law",
    "ModifiedTrapezoidal",
    "Piece",
    "Polynomial345",
    "Polynomial4567",
    "Table",
    "Trapezoidal",
]
