"""Random designs of a mechanism with their motions, swept once and kept on disk."""
