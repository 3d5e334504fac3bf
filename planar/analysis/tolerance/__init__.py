"""What tolerances do to a result."""
