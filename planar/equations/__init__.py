"""The constraint equations of a structure, and the compiled functions over z, u, p."""
