"""A whole motion: an input through its range, or all inputs in time."""
