"""Many designs of a mechanism with their motion, and those of them that come near to what is wanted."""
