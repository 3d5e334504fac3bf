"""All kinematic chains of so many links."""
