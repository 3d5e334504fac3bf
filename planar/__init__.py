"""planar: how any planar linkage moves."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from planar.foundation.notebook_display import Displayable
from planar.foundation.public_names import LAYERS, MODULES
from planar.model.revision import Revisable

if TYPE_CHECKING:
    from planar import plot
    from planar.analysis.calibration.calibration import Calibration, calibrate
    from planar.analysis.calibration.identifiability import Unidentified
    from planar.analysis.calibration.outliers import Outlier
    from planar.analysis.cams.base_circle import BaseCircle, least_base_circle
    from planar.analysis.cams.cam_profile import CamProfile, cam_profile
    from planar.analysis.cams.contact_force import ContactForce, contact_forces
    from planar.analysis.centres.centres import Centre, Centres, centres
    from planar.analysis.centres.centrodes import CentrePath, Centrodes, centre_path, centrodes
    from planar.analysis.centres.curvature import Curvature, curvature
    from planar.analysis.centres.two_directions import centre_of
    from planar.analysis.centres.velocities import velocity_by_centres
    from planar.analysis.classroom.marking import MarkedValue, Marks, StudentMarks, mark_answers
    from planar.analysis.classroom.variants import Variant, problem_variants
    from planar.analysis.efforts.motor_duty import MotorDuty, motor_duty
    from planar.analysis.efforts.self_locking import LockedInterval, jamming, self_locking
    from planar.analysis.efforts.unknown_load import UnknownLoad, unknown_load
    from planar.analysis.force_maps.force_map import ForceMap, force_map
    from planar.analysis.force_maps.worst_cases import WorstCase
    from planar.analysis.identity.inspection import Inspection, inspect
    from planar.analysis.identity.mobility import Mobility, mobility
    from planar.analysis.motion.answers import Answers, answers
    from planar.analysis.motion.coupler_area import Area, area
    from planar.analysis.motion.dwells import Dwell, dwells
    from planar.analysis.motion.extremes import Extremes, Stroke, Swing, extremes, greatest, stroke, swing
    from planar.analysis.motion.harmonics import Harmonics, harmonics
    from planar.analysis.motion.mechanical_advantage import Advantage, advantage
    from planar.analysis.motion.mechanical_advantage_over_motion import AdvantageOver, advantage_over
    from planar.analysis.motion.output import Extreme
    from planar.analysis.motion.time_ratio import TimeRatio, time_ratio
    from planar.analysis.motion.transmission_angle import Transmission, transmission
    from planar.analysis.sensitivity.gradient import gradient
    from planar.analysis.sensitivity.limit_slopes import LimitSlopes, TravelSlopes
    from planar.analysis.sensitivity.sensitivity import Influence, Sensitivity, sensitivity
    from planar.analysis.sensitivity.transmission_slopes import TransmissionSlopes
    from planar.analysis.tolerance.tolerance import ToleranceBand, tolerance
    from planar.assemblies.circuits.circuits import Circuit, Circuits, circuits
    from planar.assemblies.circuits.traced_circuit import Branch
    from planar.assemblies.conflict import Conflict, conflict
    from planar.assemblies.modes import Mode, Modes, modes
    from planar.batch.gradients.run_gradients import RunGradient
    from planar.batch.mechanisms.results import Each, Swept
    from planar.batch.prepared import PreparedRun, PreparedSweep, prepared
    from planar.batch.reductions import ReducedSweep
    from planar.batch.results import Sweep
    from planar.batch.sweep import sweep
    from planar.batch.sweep_mechanisms import sweep_each
    from planar.document.builder import build
    from planar.document.files import dumps, from_dict, load, loads, to_dict
    from planar.document.revised.changed_numbers import dimensions
    from planar.document.schema import schema
    from planar.dynamics.balancing.balance import Balance, BalanceTradeoff, Shaking, balance, balance_tradeoff
    from planar.dynamics.balancing.conditions import (
        BalanceCondition,
        BalancingConditions,
        ConditionSet,
        ConditionTerm,
        balancing_conditions,
    )
    from planar.dynamics.balancing.counterweights import Counterweight, CounterweightLimit
    from planar.dynamics.balancing.force_balance import ForceBalance, force_balance
    from planar.dynamics.balancing.positive_masses import MassBalance, mass_balance
    from planar.dynamics.flywheel import Flywheel, flywheel
    from planar.dynamics.forces import Forces, PairFriction, forces
    from planar.dynamics.friction.holding import Holding, holding
    from planar.dynamics.in_time.friction_record import FrictionEvent, RubbingPair
    from planar.dynamics.in_time.oscillations import Oscillation
    from planar.dynamics.in_time.stop_contacts import Impact
    from planar.dynamics.reactions import FixedWheel, Reaction
    from planar.dynamics.simulation import Simulation, simulate
    from planar.foundation.errors import BadInput, NoAnswer, Outcome, PlanarError, Unknown
    from planar.manufacture.parts import PartPin, Parts, PartSpacer, parts
    from planar.manufacture.plates import Plate
    from planar.model.file_units import FileUnits
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
    from planar.model.input_laws.input_law import InputLaw
    from planar.model.input_laws.spline_table import TableSegment
    from planar.model.link_shapes import Along, At, Distances, Link, Offset, Point
    from planar.model.loads import Course, Load, Mass, Spring
    from planar.model.mechanism import Drive, Input, Mechanism
    from planar.model.motors import Motor
    from planar.model.pairs.base import Pair
    from planar.model.pairs.belt import BeltPair, ChainPair
    from planar.model.pairs.cam import CamPair
    from planar.model.pairs.cams.lift_law import LiftLaw
    from planar.model.pairs.cams.profiled import CamShape
    from planar.model.pairs.gear import GearPair
    from planar.model.pairs.geneva import GenevaPair
    from planar.model.pairs.guide_line import LinkLine
    from planar.model.pairs.rack import RackPair
    from planar.model.pairs.rubbing import Friction
    from planar.model.pairs.sliding import SlidingPair
    from planar.model.pairs.slot import SlotPair
    from planar.model.pairs.turning import TurningPair
    from planar.model.pin_linkage import pinned
    from planar.model.pin_linkages import PinnedLinkages, pinned_linkages
    from planar.model.stops import Stops
    from planar.pages.design_gallery import write_designs
    from planar.pages.view import view
    from planar.reports.files.converted import Conversion, convert
    from planar.reports.files.xarray_dataset import dataset
    from planar.results.motion import Motion, State
    from planar.results.records import Limit, LinkMotion, LinkState, PointMotion, PointState, RelativeState
    from planar.solving.cycle import cycle
    from planar.solving.position import solve
    from planar.structures.chain import Chain, ChainMechanism
    from planar.structures.enumeration.chains import chains
    from planar.structures.enumeration.pin_chains import Chains
    from planar.structures.linkage_store import LinkageSet, generate
    from planar.structures.recognition import MechanismStructure, chain_of
    from planar.structures.symmetry import ChainSymmetry
    from planar.synthesis.cognates.cognates import Cognate, CognateInput, Cognates, cognates
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, DyadCurve, ExactDesign
    from planar.synthesis.synthesis import DesignMotion, FamilyCount, Synthesis, SynthesisedDesign
    from planar.synthesis.synthesise import SearchProgress, synthesise
    from planar.synthesis.task.synthesis_task import Demands, SynthesisTask, WantedFunction, WantedPath, WantedPoses
    from planar.synthesis.task.task_file import task_schema, write_task
    from planar.synthesis.task.task_reader import read_task

__version__ = "0.19.0"

__all__ = [
    "Advantage",
    "AdvantageOver",
    "Along",
    "Answers",
    "Area",
    "At",
    "BadInput",
    "Balance",
    "BalanceCondition",
    "BalanceTradeoff",
    "BalancingConditions",
    "BaseCircle",
    "BeltPair",
    "Branch",
    "Calibration",
    "CamPair",
    "CamProfile",
    "CamShape",
    "Centre",
    "CentrePath",
    "Centres",
    "Centrodes",
    "Chain",
    "ChainMechanism",
    "ChainPair",
    "ChainSymmetry",
    "Chains",
    "Circuit",
    "Circuits",
    "Cognate",
    "CognateInput",
    "Cognates",
    "CompleteSynthesis",
    "ConditionSet",
    "ConditionTerm",
    "Conflict",
    "ConstantAccelerationSegment",
    "ConstantSpeedSegment",
    "ContactForce",
    "Conversion",
    "Counterweight",
    "CounterweightLimit",
    "Course",
    "Curvature",
    "CycloidalRise",
    "Demands",
    "DesignMotion",
    "Distances",
    "Drive",
    "Dwell",
    "DwellSegment",
    "DyadCurve",
    "Each",
    "ExactDesign",
    "Extreme",
    "Extremes",
    "FamilyCount",
    "FileUnits",
    "FixedWheel",
    "Flywheel",
    "ForceBalance",
    "ForceMap",
    "Forces",
    "Friction",
    "FrictionEvent",
    "GearPair",
    "GenevaPair",
    "HarmonicRise",
    "Harmonics",
    "Holding",
    "Impact",
    "Influence",
    "Input",
    "InputLaw",
    "Inspection",
    "LiftLaw",
    "Limit",
    "LimitSlopes",
    "Link",
    "LinkLine",
    "LinkMotion",
    "LinkState",
    "LinkageSet",
    "Load",
    "LockedInterval",
    "MarkedValue",
    "Marks",
    "Mass",
    "MassBalance",
    "Mechanism",
    "MechanismStructure",
    "Mobility",
    "Mode",
    "Modes",
    "ModifiedTrapezoidalRise",
    "Motion",
    "Motor",
    "MotorDuty",
    "NoAnswer",
    "Offset",
    "Oscillation",
    "Outcome",
    "Outlier",
    "Pair",
    "PairFriction",
    "ParabolicRise",
    "PartPin",
    "PartSpacer",
    "Parts",
    "PinnedLinkages",
    "PlanarError",
    "Plate",
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
    "RunGradient",
    "SearchProgress",
    "Sensitivity",
    "Shaking",
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
    "Synthesis",
    "SynthesisTask",
    "SynthesisedDesign",
    "TableSegment",
    "TimeRatio",
    "ToleranceBand",
    "Transmission",
    "TransmissionSlopes",
    "TrapezoidalRise",
    "TravelSlopes",
    "TurningPair",
    "Unidentified",
    "Unknown",
    "UnknownLoad",
    "Variant",
    "WantedFunction",
    "WantedPath",
    "WantedPoses",
    "WorstCase",
    "advantage",
    "advantage_over",
    "answers",
    "area",
    "balance",
    "balance_tradeoff",
    "balancing_conditions",
    "build",
    "calibrate",
    "cam_profile",
    "centre_of",
    "centre_path",
    "centres",
    "centrodes",
    "chain_of",
    "chains",
    "circuits",
    "cognates",
    "conflict",
    "contact_forces",
    "convert",
    "curvature",
    "cycle",
    "dataset",
    "dimensions",
    "dumps",
    "dwells",
    "extremes",
    "flywheel",
    "force_balance",
    "force_map",
    "forces",
    "from_dict",
    "generate",
    "gradient",
    "greatest",
    "harmonics",
    "holding",
    "inspect",
    "jamming",
    "least_base_circle",
    "load",
    "loads",
    "mark_answers",
    "mass_balance",
    "mobility",
    "modes",
    "motor_duty",
    "parts",
    "pinned",
    "pinned_linkages",
    "plot",
    "prepared",
    "problem_variants",
    "read_task",
    "schema",
    "self_locking",
    "sensitivity",
    "simulate",
    "solve",
    "stroke",
    "sweep",
    "sweep_each",
    "swing",
    "synthesise",
    "task_schema",
    "time_ratio",
    "to_dict",
    "tolerance",
    "transmission",
    "unknown_load",
    "velocity_by_centres",
    "view",
    "write_designs",
    "write_task",
]


def _present(result: Any) -> str | None:
    """The page of a result, for notebooks; loaded only where something is shown."""
    page: str | None = import_module("planar.pages.view").notebook_html(result)
    return page


def _revise(mechanism: Any, values: Any) -> Any:
    """A mechanism with some numbers changed; the reader of files is loaded only where one is."""
    return import_module("planar.document.revised.changed_numbers").with_values(mechanism, values)


Displayable.presenter, Revisable.reviser = _present, _revise


def __getattr__(name: str) -> Any:
    if name in LAYERS:
        return import_module(f"planar.{name}")
    if name not in MODULES:
        raise AttributeError(f"module 'planar' has no attribute {name!r}")
    module = import_module(f"planar.{MODULES[name]}")
    globals()[name] = value = module if MODULES[name] == name else getattr(module, name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
