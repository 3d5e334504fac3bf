"""Commands for who designs a mechanism."""
