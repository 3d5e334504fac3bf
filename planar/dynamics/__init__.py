"""How forces and motion go together: reactions, inertia, motion under loads."""
