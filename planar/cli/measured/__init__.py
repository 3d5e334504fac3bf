"""Commands on what is measured of a mechanism."""
