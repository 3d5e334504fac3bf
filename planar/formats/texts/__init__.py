"""Texts of files as values, and the names in them; nothing of any one program."""
