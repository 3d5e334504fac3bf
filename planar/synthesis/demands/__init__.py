"""What is demanded of a design's motion, as the fit and the judgement both see it."""
