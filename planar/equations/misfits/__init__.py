"""Linkages that are held more than once and close but for a misfit."""
