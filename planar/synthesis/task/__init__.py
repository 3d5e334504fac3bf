"""What is wanted of a linkage: a task, read from its file, with the mechanisms to start from."""
