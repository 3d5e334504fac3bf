"""The worked solution of a position, in sentences and formulas."""
