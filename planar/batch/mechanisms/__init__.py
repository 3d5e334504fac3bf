"""Mechanisms as lists of groups: linkages of any structure run side by side, without a program of their own."""
