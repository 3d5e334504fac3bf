"""What a mechanism is: its mobility, its names, what acts on it."""
