"""Instantaneous centres and centrodes drawn."""
