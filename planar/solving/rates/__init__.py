"""Velocities and accelerations of a position, how regular it is, and how exact they are."""
