"""Tasks that leave numbers open: exact designs sampled from the family of all of them."""
