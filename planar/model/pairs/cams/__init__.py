"""What cams are made of: laws of lift, followers, and where the two touch."""
