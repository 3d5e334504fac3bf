"""Many designs of a mechanism, swept and kept on disk, and those of them that come near to what is wanted."""
