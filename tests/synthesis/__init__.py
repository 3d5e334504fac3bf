"""Linkages for what they must do."""
