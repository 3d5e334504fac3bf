"""Linkages for what they must do: those that do a task best, and those that trace the same path."""
