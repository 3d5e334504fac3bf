"""Linkages of pinned bars in the places of their pins: as tapes of steps, each of which places a pin."""
