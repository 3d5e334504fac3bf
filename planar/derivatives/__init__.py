"""Derivatives of results in every dimension of a mechanism's file."""
