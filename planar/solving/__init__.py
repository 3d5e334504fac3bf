"""From equations to positions, velocities and accelerations that have passed the checks."""
