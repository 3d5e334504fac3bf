"""Where designs start: their assemblies nearest to the sketch."""
