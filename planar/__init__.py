"""planar: how any planar linkage moves."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from planar.foundation.notebook_display import Displayable
from planar.foundation.revision import Revisable

if TYPE_CHECKING:
    from planar import plot
    from planar.analysis.centres.centres import Centre, Centres, centres
    from planar.analysis.centres.centrodes import Centrodes, centrodes
    from planar.analysis.centres.curvature import Curvature, curvature
    from planar.analysis.centres.two_directions import centre_of
    from planar.analysis.centres.velocities import velocity_by_centres
    from planar.analysis.classroom.marking import MarkedValue, Marks, StudentMarks, mark_answers
    from planar.analysis.classroom.variants import Variant, problem_variants
    from planar.analysis.identity.inspection import Inspection, inspect
    from planar.analysis.identity.mobility import Mobility, mobility
    from planar.analysis.motion.answers import Answers, answers
    from planar.analysis.motion.coupler_area import Area, area
    from planar.analysis.motion.dwells import Dwell, dwells
    from planar.analysis.motion.extremes import Extremes, Stroke, Swing, extremes, greatest, stroke, swing
    from planar.analysis.motion.harmonics import Harmonics, harmonics
    from planar.analysis.motion.mechanical_advantage import Advantage, advantage
    from planar.analysis.motion.mechanical_advantage_over_motion import AdvantageOver, advantage_over
    from planar.analysis.motion.motor_duty import MotorDuty, motor_duty
    from planar.analysis.motion.output import Extreme
    from planar.analysis.motion.self_locking import LockedInterval, jamming, self_locking
    from planar.analysis.motion.time_ratio import TimeRatio, time_ratio
    from planar.analysis.motion.transmission_angle import Transmission, transmission
    from planar.analysis.motion.unknown_load import UnknownLoad, unknown_load
    from planar.assemblies.circuits.circuits import Circuit, Circuits, circuits
    from planar.assemblies.circuits.traced_circuit import Branch
    from planar.assemblies.conflict import Conflict, conflict
    from planar.assemblies.modes import Mode, Modes, modes
    from planar.batch.mechanisms.results import Each, Swept
    from planar.batch.prepared import PreparedRun, PreparedSweep, prepared
    from planar.batch.reductions.reduced_sweep import ReducedSweep
    from planar.batch.results import Sweep
    from planar.batch.sweep import sweep
    from planar.batch.sweep_mechanisms import sweep_each
    from planar.document.builder import build
    from planar.document.dimensions import dimensions
    from planar.document.files import dumps, from_dict, load, loads, to_dict
    from planar.document.schema import schema
    from planar.dynamics.flywheel import Flywheel, flywheel
    from planar.dynamics.forces import Forces, PairFriction, forces
    from planar.dynamics.friction.holding import Holding, holding
    from planar.dynamics.in_time.friction_record import FrictionEvent, RubbingPair
    from planar.dynamics.in_time.stop_contacts import Impact
    from planar.dynamics.reactions import Reaction
    from planar.dynamics.simulation import Simulation, simulate
    from planar.foundation.errors import BadInput, NoAnswer, Outcome, PlanarError, Unknown
    from planar.model.file_units import FileUnits
    from planar.model.input_laws.cam_rises import (
        CycloidalRise,
        HarmonicRise,
        ModifiedTrapezoidalRise,
        Polynomial345Rise,
        Polynomial4567Rise,
        TrapezoidalRise,
    )
    from planar.model.input_laws.constant_rates import ConstantAccelerationSegment, ConstantSpeedSegment, DwellSegment
    from planar.model.input_laws.input_law import InputLaw
    from planar.model.input_laws.spline_table import TableSegment
    from planar.model.link_shapes import Along, At, Distances, Link, Point
    from planar.model.loads import Course, Load, Mass, Spring
    from planar.model.mechanism import Drive, Input, Mechanism
    from planar.model.motors import Motor
    from planar.model.pairs.base import Pair
    from planar.model.pairs.belt import BeltPair, ChainPair
    from planar.model.pairs.gear import GearPair
    from planar.model.pairs.guide_line import LinkLine
    from planar.model.pairs.rack import RackPair
    from planar.model.pairs.rubbing import Friction
    from planar.model.pairs.sliding import SlidingPair
    from planar.model.pairs.slot import SlotPair
    from planar.model.pairs.turning import TurningPair
    from planar.model.pin_linkage import pinned
    from planar.model.pin_linkages import PinnedLinkages, pinned_linkages
    from planar.model.stops import Stops
    from planar.pages.view import view
    from planar.reports.files.xarray_dataset import dataset
    from planar.results.motion import Motion, State
    from planar.results.records import Limit, LinkMotion, LinkState, PointMotion, PointState, RelativeState
    from planar.solving.cycle import cycle
    from planar.solving.position import solve

__version__ = "0.11.0"

_ROOMS = {
    "Advantage": "analysis.motion.mechanical_advantage",
    "AdvantageOver": "analysis.motion.mechanical_advantage_over_motion",
    "Along": "model.mechanism",
    "Answers": "analysis.motion.answers",
    "Area": "analysis.motion.coupler_area",
    "At": "model.mechanism",
    "BadInput": "foundation.errors",
    "BeltPair": "model.pairs.belt",
    "Branch": "assemblies.circuits.circuits",
    "Centre": "analysis.centres.centres",
    "Centres": "analysis.centres.centres",
    "Centrodes": "analysis.centres.centrodes",
    "ChainPair": "model.pairs.belt",
    "Circuit": "assemblies.circuits.circuits",
    "Circuits": "assemblies.circuits.circuits",
    "Conflict": "assemblies.conflict",
    "ConstantAccelerationSegment": "model.input_laws.constant_rates",
    "ConstantSpeedSegment": "model.input_laws.constant_rates",
    "Course": "model.mechanism",
    "Curvature": "analysis.centres.curvature",
    "CycloidalRise": "model.input_laws.cam_rises",
    "Distances": "model.mechanism",
    "Drive": "model.mechanism",
    "Dwell": "analysis.motion.dwells",
    "DwellSegment": "model.input_laws.constant_rates",
    "Each": "batch.mechanisms.results",
    "Extreme": "analysis.motion.output",
    "Extremes": "analysis.motion.extremes",
    "FileUnits": "model.file_units",
    "Flywheel": "dynamics.flywheel",
    "Forces": "dynamics.forces",
    "Friction": "model.pairs.rubbing",
    "FrictionEvent": "dynamics.in_time.friction_record",
    "GearPair": "model.pairs.gear",
    "HarmonicRise": "model.input_laws.cam_rises",
    "Harmonics": "analysis.motion.harmonics",
    "Impact": "dynamics.in_time.stop_contacts",
    "Holding": "dynamics.friction.holding",
    "Input": "model.mechanism",
    "InputLaw": "model.input_laws.input_law",
    "Inspection": "analysis.identity.inspection",
    "Limit": "results.records",
    "Link": "model.mechanism",
    "LinkLine": "model.pairs.guide_line",
    "LinkMotion": "results.records",
    "LinkState": "results.records",
    "Load": "model.mechanism",
    "MarkedValue": "analysis.classroom.marking",
    "Marks": "analysis.classroom.marking",
    "LockedInterval": "analysis.motion.self_locking",
    "Mass": "model.mechanism",
    "Mechanism": "model.mechanism",
    "Mobility": "analysis.identity.mobility",
    "Mode": "assemblies.modes",
    "Modes": "assemblies.modes",
    "ModifiedTrapezoidalRise": "model.input_laws.cam_rises",
    "Motion": "results.motion",
    "Motor": "model.motors",
    "MotorDuty": "analysis.motion.motor_duty",
    "NoAnswer": "foundation.errors",
    "Outcome": "foundation.errors",
    "Pair": "model.pairs.base",
    "PairFriction": "dynamics.forces",
    "PinnedLinkages": "model.pin_linkages",
    "PlanarError": "foundation.errors",
    "Point": "model.mechanism",
    "PointMotion": "results.records",
    "PointState": "results.records",
    "Polynomial345Rise": "model.input_laws.cam_rises",
    "Polynomial4567Rise": "model.input_laws.cam_rises",
    "PreparedRun": "batch.prepared",
    "PreparedSweep": "batch.prepared",
    "RackPair": "model.pairs.rack",
    "Reaction": "dynamics.reactions",
    "ReducedSweep": "batch.reductions.reduced_sweep",
    "RelativeState": "results.records",
    "RubbingPair": "dynamics.in_time.friction_record",
    "Simulation": "dynamics.simulation",
    "SlidingPair": "model.pairs.sliding",
    "SlotPair": "model.pairs.slot",
    "Spring": "model.mechanism",
    "State": "results.motion",
    "Stops": "model.stops",
    "Stroke": "analysis.motion.extremes",
    "StudentMarks": "analysis.classroom.marking",
    "Sweep": "batch.results",
    "Swept": "batch.mechanisms.results",
    "Swing": "analysis.motion.extremes",
    "TableSegment": "model.input_laws.spline_table",
    "TimeRatio": "analysis.motion.time_ratio",
    "Transmission": "analysis.motion.transmission_angle",
    "TrapezoidalRise": "model.input_laws.cam_rises",
    "TurningPair": "model.pairs.turning",
    "Unknown": "foundation.errors",
    "UnknownLoad": "analysis.motion.unknown_load",
    "Variant": "analysis.classroom.variants",
    "advantage": "analysis.motion.mechanical_advantage",
    "advantage_over": "analysis.motion.mechanical_advantage_over_motion",
    "answers": "analysis.motion.answers",
    "area": "analysis.motion.coupler_area",
    "build": "document.builder",
    "centre_of": "analysis.centres.two_directions",
    "centres": "analysis.centres.centres",
    "centrodes": "analysis.centres.centrodes",
    "circuits": "assemblies.circuits.circuits",
    "conflict": "assemblies.conflict",
    "curvature": "analysis.centres.curvature",
    "cycle": "solving.cycle",
    "dataset": "reports.files.xarray_dataset",
    "dimensions": "document.dimensions",
    "dumps": "document.files",
    "dwells": "analysis.motion.dwells",
    "extremes": "analysis.motion.extremes",
    "flywheel": "dynamics.flywheel",
    "forces": "dynamics.forces",
    "from_dict": "document.files",
    "greatest": "analysis.motion.extremes",
    "harmonics": "analysis.motion.harmonics",
    "holding": "dynamics.friction.holding",
    "inspect": "analysis.identity.inspection",
    "jamming": "analysis.motion.self_locking",
    "load": "document.files",
    "loads": "document.files",
    "mark_answers": "analysis.classroom.marking",
    "mobility": "analysis.identity.mobility",
    "modes": "assemblies.modes",
    "motor_duty": "analysis.motion.motor_duty",
    "problem_variants": "analysis.classroom.variants",
    "pinned": "model.pin_linkage",
    "pinned_linkages": "model.pin_linkages",
    "plot": "plot",
    "prepared": "batch.prepared",
    "schema": "document.schema",
    "self_locking": "analysis.motion.self_locking",
    "simulate": "dynamics.simulation",
    "solve": "solving.position",
    "stroke": "analysis.motion.extremes",
    "sweep": "batch.sweep",
    "sweep_each": "batch.sweep_mechanisms",
    "swing": "analysis.motion.extremes",
    "time_ratio": "analysis.motion.time_ratio",
    "to_dict": "document.files",
    "transmission": "analysis.motion.transmission_angle",
    "velocity_by_centres": "analysis.centres.velocities",
    "view": "pages.view",
    "unknown_load": "analysis.motion.unknown_load",
}
"""Where each public name lives: it is loaded when it is first used."""

__all__ = [
    "Advantage",
    "AdvantageOver",
    "Along",
    "Answers",
    "Area",
    "At",
    "BadInput",
    "BeltPair",
    "Branch",
    "Centre",
    "Centres",
    "Centrodes",
    "ChainPair",
    "Circuit",
    "Circuits",
    "Conflict",
    "ConstantAccelerationSegment",
    "ConstantSpeedSegment",
    "Course",
    "Curvature",
    "CycloidalRise",
    "Distances",
    "Drive",
    "Dwell",
    "DwellSegment",
    "Each",
    "Extreme",
    "Extremes",
    "FileUnits",
    "Flywheel",
    "Forces",
    "Friction",
    "FrictionEvent",
    "GearPair",
    "HarmonicRise",
    "Harmonics",
    "Holding",
    "Impact",
    "Input",
    "InputLaw",
    "Inspection",
    "Limit",
    "Link",
    "LinkLine",
    "LinkMotion",
    "LinkState",
    "Load",
    "LockedInterval",
    "MarkedValue",
    "Marks",
    "Mass",
    "Mechanism",
    "Mobility",
    "Mode",
    "Modes",
    "ModifiedTrapezoidalRise",
    "Motion",
    "Motor",
    "MotorDuty",
    "NoAnswer",
    "Outcome",
    "Pair",
    "PairFriction",
    "PinnedLinkages",
    "PlanarError",
    "Point",
    "PointMotion",
    "PointState",
    "Polynomial345Rise",
    "Polynomial4567Rise",
    "PreparedRun",
    "PreparedSweep",
    "RackPair",
    "Reaction",
    "ReducedSweep",
    "RelativeState",
    "RubbingPair",
    "Simulation",
    "SlidingPair",
    "SlotPair",
    "Spring",
    "State",
    "Stops",
    "Stroke",
    "StudentMarks",
    "Sweep",
    "Swept",
    "Swing",
    "TableSegment",
    "TimeRatio",
    "Transmission",
    "TrapezoidalRise",
    "TurningPair",
    "Unknown",
    "UnknownLoad",
    "Variant",
    "advantage",
    "advantage_over",
    "answers",
    "area",
    "build",
    "centre_of",
    "centres",
    "centrodes",
    "circuits",
    "conflict",
    "curvature",
    "cycle",
    "dataset",
    "dimensions",
    "dumps",
    "dwells",
    "extremes",
    "flywheel",
    "forces",
    "from_dict",
    "greatest",
    "harmonics",
    "holding",
    "inspect",
    "jamming",
    "load",
    "loads",
    "mark_answers",
    "mobility",
    "modes",
    "motor_duty",
    "pinned",
    "pinned_linkages",
    "plot",
    "prepared",
    "problem_variants",
    "schema",
    "self_locking",
    "simulate",
    "solve",
    "stroke",
    "sweep",
    "sweep_each",
    "swing",
    "time_ratio",
    "to_dict",
    "transmission",
    "unknown_load",
    "velocity_by_centres",
    "view",
]


def _present(result: Any) -> str | None:
    """The page of a result, for notebooks; loaded only where something is shown."""
    page: str | None = import_module("planar.pages.view").notebook_html(result)
    return page


def _revise(mechanism: Any, values: Any) -> Any:
    """A mechanism with some numbers changed; the reader of files is loaded only where one is."""
    return import_module("planar.document.dimensions").with_values(mechanism, values)


Displayable.presenter, Revisable.reviser = _present, _revise


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module 'planar' has no attribute {name!r}")
    room = import_module(f"planar.{_ROOMS[name]}")
    return room if _ROOMS[name] == name else getattr(room, name)


def __dir__() -> list[str]:
    return sorted(__all__)
