"""Every assembly of a mechanism at given inputs, found completely and certified."""
