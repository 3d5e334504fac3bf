"""Cognates: other linkages in which a point traces the same path."""
