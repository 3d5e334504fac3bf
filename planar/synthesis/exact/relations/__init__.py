"""What a task wants of a structure, as polynomials in isotropic coordinates."""
