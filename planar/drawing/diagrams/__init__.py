"""Curves of a run: displacement, velocity, acceleration, loci, positions."""
