"""A mechanism drawn by hand in the browser: a page with a pencil, and the server on this machine that answers it."""
