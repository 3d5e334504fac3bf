"""Blocks as polynomial systems: all their roots, and whether these are all."""
