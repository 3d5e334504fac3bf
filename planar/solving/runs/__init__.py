"""Runs made into motions."""
