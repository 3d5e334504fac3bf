"""Forces over several inputs at once."""
