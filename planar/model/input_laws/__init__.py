"""Input laws in time: motions of a cam's timing diagram, one after the other."""

from planar.model.input_laws.cam_rises import (
    CycloidalRise,
    HarmonicRise,
    ModifiedTrapezoidalRise,
    ParabolicRise,
    Polynomial345Rise,
    Polynomial4567Rise,
    TrapezoidalRise,
)
from planar.model.input_laws.constant_rates import ConstantAccelerationSegment, ConstantSpeedSegment, DwellSegment
from planar.model.input_laws.input_law import InputLaw, SegmentJoint
from planar.model.input_laws.segment import LawSegment, SegmentKey
from planar.model.input_laws.spline_table import TableSegment

SEGMENT_TYPES: dict[str, type[LawSegment]] = {
    kind.motion: kind
    for kind in (
        DwellSegment,
        ConstantSpeedSegment,
        ConstantAccelerationSegment,
        Polynomial345Rise,
        Polynomial4567Rise,
        CycloidalRise,
        HarmonicRise,
        ParabolicRise,
        TrapezoidalRise,
        ModifiedTrapezoidalRise,
        TableSegment,
    )
}
"""Every motion of a piece, by its name in files."""

__all__ = [
    "SEGMENT_TYPES",
    "ConstantAccelerationSegment",
    "ConstantSpeedSegment",
    "CycloidalRise",
    "DwellSegment",
    "HarmonicRise",
    "InputLaw",
    "LawSegment",
    "ModifiedTrapezoidalRise",
    "ParabolicRise",
    "Polynomial345Rise",
    "Polynomial4567Rise",
    "SegmentJoint",
    "SegmentKey",
    "TableSegment",
    "TrapezoidalRise",
]
