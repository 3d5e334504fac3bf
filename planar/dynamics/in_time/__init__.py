"""What a simulation is made of beside its equations of motion: contacts at stops, motors, the motion as a result."""
