"""The march by numpy: designs and steps in arrays."""
