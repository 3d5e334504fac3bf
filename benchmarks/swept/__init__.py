"""The linkages whose dimensions are swept."""

from benchmarks.swept.base import RATES, Swept, angles
from benchmarks.swept.four_bar import SweptFourBar
from benchmarks.swept.quick_return import SweptQuickReturn
from benchmarks.swept.six_bars import Stephenson, Watt

SWEPT: tuple[Swept, ...] = (SweptFourBar(), SweptQuickReturn(), Watt(), Stephenson())

__all__ = ["RATES", "SWEPT", "Stephenson", "Swept", "SweptFourBar", "SweptQuickReturn", "Watt", "angles"]
