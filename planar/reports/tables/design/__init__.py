"""Tables for who designs a mechanism."""
