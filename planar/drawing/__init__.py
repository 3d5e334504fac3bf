"""Drawings on paper: what a mechanism looks like, where it goes, and the polygons of its velocities."""
