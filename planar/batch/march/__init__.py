"""All designs of a block through the same steps, by numpy or by machine code."""
