"""Questions about a whole motion: strokes, dwells, harmonics, time ratios."""
