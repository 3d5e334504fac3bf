"""Sections of a file that few mechanisms have."""
