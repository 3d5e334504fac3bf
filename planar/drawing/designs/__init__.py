"""Designs with what was wanted of them."""
