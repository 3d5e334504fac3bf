"""What programs have in common: joints where they were drawn; a file format's contract; to planar's form and back."""
