"""The numbers of mechanisms by name, and mechanisms with other numbers."""
