"""Casadi's programs printed for other machines."""
