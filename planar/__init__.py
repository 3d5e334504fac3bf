"""planar: how any planar linkage moves."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planar import plot
    from planar.analysis.advantage import Advantage, advantage
    from planar.analysis.advantage_over import AdvantageOver, advantage_over
    from planar.analysis.answers import Answers, answers
    from planar.analysis.area import Area, area
    from planar.analysis.by_centres import velocity_by_centres
    from planar.analysis.centres import Centre, Centres, centres
    from planar.analysis.centrodes import Centrodes, centrodes
    from planar.analysis.curvature import Curvature, curvature
    from planar.analysis.dwells import Dwell, dwells
    from planar.analysis.extremes import Extremes, Stroke, Swing, extremes, greatest, stroke, swing
    from planar.analysis.harmonics import harmonics
    from planar.analysis.inspection import Inspection, inspect
    from planar.analysis.mobility import Mobility, mobility
    from planar.analysis.output import Extreme
    from planar.analysis.time_ratio import TimeRatio, time_ratio
    from planar.analysis.transmission import Transmission, transmission
    from planar.analysis.two_directions import centre_of
    from planar.assemblies.conflict import Conflict, conflict
    from planar.assemblies.modes import Mode, Modes, modes
    from planar.branches.circuits import Branch, Circuit, Circuits, circuits
    from planar.document.schema import schema
    from planar.dynamics.flywheel import Flywheel, flywheel
    from planar.dynamics.forces import Forces, forces
    from planar.dynamics.simulated import Simulation, simulate
    from planar.dynamics.told import Reaction
    from planar.errors import BadInput, NoAnswer, Outcome, PlanarError
    from planar.files import dumps, from_dict, load, loads, to_dict
    from planar.grouped.each import sweep_each
    from planar.grouped.result import Each, Swept
    from planar.mechanism import (
        Along,
        At,
        Course,
        Distances,
        Drive,
        Input,
        Link,
        Load,
        Mass,
        Mechanism,
        Point,
        Spring,
    )
    from planar.motion import Motion, State
    from planar.pages.shown import view
    from planar.pins import pinned
    from planar.solving.cycle import cycle
    from planar.solving.position import solve
    from planar.sweeping.prepared import prepared
    from planar.sweeping.result import Sweep
    from planar.sweeping.sweep import sweep
    from planar.views.dataset import dataset

__version__ = "0.8.1"

_ROOMS = {
    "Advantage": "analysis.advantage",
    "AdvantageOver": "analysis.advantage_over",
    "Along": "mechanism",
    "Answers": "analysis.answers",
    "Area": "analysis.area",
    "At": "mechanism",
    "BadInput": "errors",
    "Branch": "branches.circuits",
    "Centre": "analysis.centres",
    "Centres": "analysis.centres",
    "Centrodes": "analysis.centrodes",
    "Circuit": "branches.circuits",
    "Circuits": "branches.circuits",
    "Conflict": "assemblies.conflict",
    "Course": "mechanism",
    "Curvature": "analysis.curvature",
    "Distances": "mechanism",
    "Drive": "mechanism",
    "Dwell": "analysis.dwells",
    "Each": "grouped.result",
    "Extreme": "analysis.output",
    "Extremes": "analysis.extremes",
    "Flywheel": "dynamics.flywheel",
    "Forces": "dynamics.forces",
    "Input": "mechanism",
    "Inspection": "analysis.inspection",
    "Link": "mechanism",
    "Load": "mechanism",
    "Mass": "mechanism",
    "Mechanism": "mechanism",
    "Mobility": "analysis.mobility",
    "Mode": "assemblies.modes",
    "Modes": "assemblies.modes",
    "Motion": "motion",
    "NoAnswer": "errors",
    "Outcome": "errors",
    "PlanarError": "errors",
    "Point": "mechanism",
    "Reaction": "dynamics.told",
    "Simulation": "dynamics.simulated",
    "Spring": "mechanism",
    "State": "motion",
    "Stroke": "analysis.extremes",
    "Sweep": "sweeping.result",
    "Swept": "grouped.result",
    "Swing": "analysis.extremes",
    "TimeRatio": "analysis.time_ratio",
    "Transmission": "analysis.transmission",
    "advantage": "analysis.advantage",
    "advantage_over": "analysis.advantage_over",
    "answers": "analysis.answers",
    "area": "analysis.area",
    "centre_of": "analysis.two_directions",
    "centres": "analysis.centres",
    "centrodes": "analysis.centrodes",
    "circuits": "branches.circuits",
    "conflict": "assemblies.conflict",
    "curvature": "analysis.curvature",
    "cycle": "solving.cycle",
    "dataset": "views.dataset",
    "dumps": "files",
    "dwells": "analysis.dwells",
    "extremes": "analysis.extremes",
    "flywheel": "dynamics.flywheel",
    "forces": "dynamics.forces",
    "from_dict": "files",
    "greatest": "analysis.extremes",
    "harmonics": "analysis.harmonics",
    "inspect": "analysis.inspection",
    "load": "files",
    "loads": "files",
    "mobility": "analysis.mobility",
    "modes": "assemblies.modes",
    "pinned": "pins",
    "plot": "plot",
    "prepared": "sweeping.prepared",
    "schema": "document.schema",
    "simulate": "dynamics.simulated",
    "solve": "solving.position",
    "stroke": "analysis.extremes",
    "sweep": "sweeping.sweep",
    "sweep_each": "grouped.each",
    "swing": "analysis.extremes",
    "time_ratio": "analysis.time_ratio",
    "to_dict": "files",
    "transmission": "analysis.transmission",
    "velocity_by_centres": "analysis.by_centres",
    "view": "pages.shown",
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
    "Branch",
    "Centre",
    "Centres",
    "Centrodes",
    "Circuit",
    "Circuits",
    "Conflict",
    "Course",
    "Curvature",
    "Distances",
    "Drive",
    "Dwell",
    "Each",
    "Extreme",
    "Extremes",
    "Flywheel",
    "Forces",
    "Input",
    "Inspection",
    "Link",
    "Load",
    "Mass",
    "Mechanism",
    "Mobility",
    "Mode",
    "Modes",
    "Motion",
    "NoAnswer",
    "Outcome",
    "PlanarError",
    "Point",
    "Reaction",
    "Simulation",
    "Spring",
    "State",
    "Stroke",
    "Sweep",
    "Swept",
    "Swing",
    "TimeRatio",
    "Transmission",
    "advantage",
    "advantage_over",
    "answers",
    "area",
    "centre_of",
    "centres",
    "centrodes",
    "circuits",
    "conflict",
    "curvature",
    "cycle",
    "dataset",
    "dumps",
    "dwells",
    "extremes",
    "flywheel",
    "forces",
    "from_dict",
    "greatest",
    "harmonics",
    "inspect",
    "load",
    "loads",
    "mobility",
    "modes",
    "pinned",
    "plot",
    "prepared",
    "schema",
    "simulate",
    "solve",
    "stroke",
    "sweep",
    "sweep_each",
    "swing",
    "time_ratio",
    "to_dict",
    "transmission",
    "velocity_by_centres",
    "view",
]


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module 'planar' has no attribute {name!r}")
    room = import_module(f"planar.{_ROOMS[name]}")
    return room if _ROOMS[name] == name else getattr(room, name)


def __dir__() -> list[str]:
    return sorted(__all__)
