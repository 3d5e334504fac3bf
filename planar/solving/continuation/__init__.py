"""Along the curve of positions: predictor and corrector, turning points, bifurcations."""
