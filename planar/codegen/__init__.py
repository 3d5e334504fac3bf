"""Casadi functions as instruction lists, printed for other machines."""
