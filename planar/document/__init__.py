"""Mechanism files: JSON value to Mechanism and back."""

from planar.document.reader import read
from planar.document.writer import write

__all__ = ["read", "write"]
