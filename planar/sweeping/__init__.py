"""Many designs of one mechanism at once: assembled, run and judged in blocks, wherever the blocks are solved."""
