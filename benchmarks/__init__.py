"""The project's speed table: `python -m benchmarks`.

Everything is timed in one run, round by round in turn, and shown beside its greatest error; on a shared machine only
the ratios of one run mean anything. `linkages` are what is solved, `ways` how it is solved, the other files one table
each.
"""
