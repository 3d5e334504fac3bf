"""Tables of forces: of one position, over a motion, of loads and of what they are turned into."""
