"""Where the joints of a chain stand in a drawing of it."""
