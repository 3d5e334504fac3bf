"""A mechanism as immutable data: links, pairs, inputs, loads, and the graph that they make."""
