"""Derivatives of a weighed sum of what a prepared run tells, in all numbers of the file."""
