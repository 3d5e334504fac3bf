"""The linkages that are timed: each its mechanism file, its closed form and its loop equations, for one crank turn."""

from benchmarks.linkages.base import Linkage
from benchmarks.linkages.four_bar import FourBar
from benchmarks.linkages.quick_return import QuickReturn
from benchmarks.linkages.slider_crank import SliderCrank

LINKAGES: tuple[Linkage, ...] = (FourBar(), SliderCrank(), QuickReturn())

__all__ = ["LINKAGES", "FourBar", "Linkage", "QuickReturn", "SliderCrank"]
