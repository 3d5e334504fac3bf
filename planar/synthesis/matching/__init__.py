"""Designs of a swept catalogue that come near to what is wanted, wherever, however large and however turned."""
