"""Mechanism files: JSON value to Mechanism; `writer` is the way back, `schema` describes them."""

from planar.document.reader import read
from planar.document.texts import read_drive, read_time

__all__ = ["read", "read_drive", "read_time"]
