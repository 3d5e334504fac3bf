"""Tolerances: what a file says of them, and the tables of ISO 286 and ISO 2768."""
