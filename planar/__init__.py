"""planar: how any planar linkage moves."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planar import plot
    from planar.analysis.advantage import Advantage, advantage
    from planar.analysis.by_centres import velocity_by_centres
    from planar.analysis.centres import Centre, Centres, centres
    from planar.analysis.centrodes import Centrodes, centrodes
    from planar.analysis.curvature import Curvature, curvature
    from planar.analysis.extremes import stroke
    from planar.analysis.forces import Forces, forces
    from planar.analysis.harmonics import harmonics
    from planar.analysis.inspection import Inspection, inspect
    from planar.analysis.mobility import Mobility, mobility
    from planar.analysis.two_directions import centre_of
    from planar.document import schema
    from planar.errors import BadInput, NoAnswer, Outcome, PlanarError
    from planar.files import dumps, from_dict, load, loads, to_dict
    from planar.mechanism import Along, At, Distances, Drive, Input, Link, Load, Mechanism, Point
    from planar.motion import Motion, State
    from planar.solving.cycle import cycle
    from planar.solving.position import solve
    from planar.views.dataset import dataset

__version__ = "0.4.0"

_ROOMS = {
    "Advantage": "analysis.advantage",
    "Along": "mechanism",
    "At": "mechanism",
    "BadInput": "errors",
    "Centre": "analysis.centres",
    "Centres": "analysis.centres",
    "Centrodes": "analysis.centrodes",
    "Curvature": "analysis.curvature",
    "Distances": "mechanism",
    "Drive": "mechanism",
    "Forces": "analysis.forces",
    "Input": "mechanism",
    "Inspection": "analysis.inspection",
    "Link": "mechanism",
    "Load": "mechanism",
    "Mechanism": "mechanism",
    "Motion": "motion",
    "Mobility": "analysis.mobility",
    "NoAnswer": "errors",
    "Outcome": "errors",
    "PlanarError": "errors",
    "Point": "mechanism",
    "State": "motion",
    "advantage": "analysis.advantage",
    "centre_of": "analysis.two_directions",
    "centres": "analysis.centres",
    "centrodes": "analysis.centrodes",
    "curvature": "analysis.curvature",
    "cycle": "solving.cycle",
    "dataset": "views.dataset",
    "dumps": "files",
    "forces": "analysis.forces",
    "from_dict": "files",
    "harmonics": "analysis.harmonics",
    "inspect": "analysis.inspection",
    "load": "files",
    "loads": "files",
    "mobility": "analysis.mobility",
    "plot": "plot",
    "schema": "document",
    "solve": "solving.position",
    "stroke": "analysis.extremes",
    "to_dict": "files",
    "velocity_by_centres": "analysis.by_centres",
}
"""Where each public name lives: it is loaded when it is first used."""

__all__ = [
    "Advantage",
    "Along",
    "At",
    "BadInput",
    "Centre",
    "Centres",
    "Centrodes",
    "Curvature",
    "Distances",
    "Drive",
    "Forces",
    "Input",
    "Inspection",
    "Link",
    "Load",
    "Mechanism",
    "Mobility",
    "Motion",
    "NoAnswer",
    "Outcome",
    "PlanarError",
    "Point",
    "State",
    "advantage",
    "centre_of",
    "centres",
    "centrodes",
    "curvature",
    "cycle",
    "dataset",
    "dumps",
    "forces",
    "from_dict",
    "harmonics",
    "inspect",
    "load",
    "loads",
    "mobility",
    "plot",
    "schema",
    "solve",
    "stroke",
    "to_dict",
    "velocity_by_centres",
]


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module 'planar' has no attribute {name!r}")
    room = import_module(f"planar.{_ROOMS[name]}")
    return room if _ROOMS[name] == name else getattr(room, name)


def __dir__() -> list[str]:
    return sorted(__all__)
