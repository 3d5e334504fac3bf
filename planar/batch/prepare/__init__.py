"""A new design of one linkage in one compiled call: its numbers, its start, its positions."""
