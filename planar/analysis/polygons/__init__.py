"""Velocity and acceleration polygons as data, and how they are constructed."""
