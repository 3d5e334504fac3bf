"""The unit of length in which plates are drawn and listed, with the sizes that are usual in it."""

from __future__ import annotations

from typing import NamedTuple

from planar.model.file_units import FileUnits, is_customary

INCH = 25.4
"""mm"""


class CutUnit(NamedTuple):
    """Millimetres or inches: `millimetres` is the unit's length (mm).

    The defaults `thickness`, `play`, `gap` (m) and `sheet` (m, m); `pins` are diameters of rods that are sold (mm).
    """

    name: str
    millimetres: float
    thickness: float
    play: float
    gap: float
    sheet: tuple[float, float]
    pins: tuple[float, ...]

    def from_si(self, length: float) -> float:
        """A length (m) in this unit."""
        return 1e3 * length / self.millimetres

    def format(self, length: float) -> str:
        """A length (m) in this unit, without its name."""
        return f"{self.from_si(length):.5g}"


MILLIMETRES = CutUnit("mm", 1.0, 0.003, 1e-4, 0.004, (0.6, 0.4), (1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0))
INCHES = CutUnit(
    "in",
    INCH,
    1e-3 * INCH / 8.0,
    5e-6 * INCH,
    0.15e-3 * INCH,
    (24e-3 * INCH, 16e-3 * INCH),
    tuple(INCH * part / 32.0 for part in (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0)),
)


def cut_unit(units: FileUnits) -> CutUnit:
    """Inches for a file whose lengths are in inches, feet and the like, otherwise millimetres."""
    return INCHES if is_customary(units.length) else MILLIMETRES
