"""Free bodies, force polygons, torque and bearing loads drawn."""
