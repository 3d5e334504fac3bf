"""Mechanism files: JSON value to Mechanism and back."""

from planar.document.reader import read, read_drive, read_time
from planar.document.schema import schema
from planar.document.writer import write

__all__ = ["read", "read_drive", "read_time", "schema", "write"]
