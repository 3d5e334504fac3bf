"""Which linkages there are: kinematic chains, numbered once and for all, their symmetry, inversions and drawings."""
