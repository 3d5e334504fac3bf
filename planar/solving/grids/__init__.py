"""Positions over a grid of several inputs."""
