"""Whether a design does what is wanted, by the general path."""
