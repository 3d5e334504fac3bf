"""Designs fitted to what is wanted of them, many at once, by least squares on exact derivatives."""
