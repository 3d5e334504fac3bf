"""How fast this machine solves a mechanism, and what bounds it."""
