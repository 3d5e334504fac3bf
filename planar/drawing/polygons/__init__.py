"""Velocity and acceleration polygons drawn."""
