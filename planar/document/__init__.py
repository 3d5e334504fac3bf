"""Mechanism files: JSON value to Mechanism; `writer` is the way back, `schema` describes them."""

from planar.document.arguments import read_drive, read_effort, read_length, read_mass, read_time
from planar.document.reader import read_mechanism

__all__ = ["LINK_PREFIX", "read_drive", "read_effort", "read_length", "read_mass", "read_mechanism", "read_time"]

LINK_PREFIX = "planar:"
"""With which a link begins that holds a whole mechanism, and no file's name."""
