"""Solved mechanisms as people see them."""
