"""What each dimension does to a result."""
