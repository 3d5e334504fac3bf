"""Tables of what the numbers of a design do to results."""
