"""Questions about solved positions and motions."""
