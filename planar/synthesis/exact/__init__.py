"""Exact synthesis: all linkages that meet as many demands as they have freedom, by monodromy and homotopy."""
