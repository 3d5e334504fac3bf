"""Forces with Coulomb's friction: what it depends on, every solution, and what it holds at rest."""
