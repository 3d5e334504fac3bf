"""Instantaneous centres, centrodes, and what they show."""
