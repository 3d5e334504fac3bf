"""What loads, motors and friction mean for the effort of an input, at a position or over a motion."""
