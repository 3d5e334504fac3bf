"""From equations to positions, velocities and accelerations that have passed the gate."""

from planar.solve.position import solve

__all__ = ["solve"]
