"""Dimensions of a mechanism from measurements of it."""
