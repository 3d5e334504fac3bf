"""planar: how any planar linkage moves."""

from planar.errors import BadInput, NoAnswer, Outcome, PlanarError
from planar.files import dumps, from_dict, load, loads, to_dict
from planar.solve import solve

__all__ = [
    "BadInput",
    "NoAnswer",
    "Outcome",
    "PlanarError",
    "dumps",
    "from_dict",
    "load",
    "loads",
    "solve",
    "to_dict",
]
