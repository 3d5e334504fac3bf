"""One file for each kind of file of other programs; what a file needs alone stands in a folder of its own."""
