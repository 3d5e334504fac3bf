"""How pairs share what links that are held more than once carry."""
