"""Solved positions and motions: arrays with names."""
