"""Strokes on paper, in millimetres."""
