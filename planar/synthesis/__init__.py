"""Linkages for what they must do: those that trace the same path, and catalogues of swept designs."""
