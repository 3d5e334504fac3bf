"""Questions about solved positions, one file each."""
