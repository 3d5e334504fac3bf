"""From the sketch to the assembly nearest to it."""
