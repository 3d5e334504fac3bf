"""Cams: their profiles, pressure angles and radii of curvature, and how small they may be."""
