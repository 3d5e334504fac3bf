"""Many designs at once: assembled, run and checked in blocks, wherever the blocks are solved."""
