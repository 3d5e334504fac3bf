"""Tables of what was fitted to measurements."""
