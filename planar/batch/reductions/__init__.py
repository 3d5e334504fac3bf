"""What is kept of a sweep whose positions are not: extremes, paths' measures, whatever a function makes of a block."""
