"""All circuits of a mechanism and their branches, while one input runs."""
