"""Letters and texts: their fonts, sizes and places."""
