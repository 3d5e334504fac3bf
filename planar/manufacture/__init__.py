"""Linkages to be built: links as plates that are cut, stacked in layers that clear one another, on sheets."""
