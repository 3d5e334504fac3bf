"""What the kinds of files need beside their one file each."""
