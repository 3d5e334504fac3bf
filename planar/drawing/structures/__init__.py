"""Drawings of kinematic chains."""
