"""Balancing: what of the masses shakes the frame, which conditions end that, and the best counterweights."""
