"""Pages that carry a mechanism and solve it themselves: one HTML file, no network, no server."""
