"""Mechanism files: JSON value to Mechanism; `writer` is the way back, `schema` describes them."""

from planar.document.arguments import read_drive, read_effort, read_length, read_mass, read_time
from planar.document.reader import read_mechanism

__all__ = ["read_drive", "read_effort", "read_length", "read_mass", "read_mechanism", "read_time"]
