"""planar: how any planar linkage moves."""

from planar.files import dumps, from_dict, load, loads, to_dict
from planar.solve import solve

__all__ = ["dumps", "from_dict", "load", "loads", "solve", "to_dict"]
