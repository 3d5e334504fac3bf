"""Whether the fast ways to solve many designs tell what the general path tells: `python -m benchmarks.truth`."""
