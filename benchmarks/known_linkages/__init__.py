"""Random tasks made from linkages that are known beforehand, to check complete lists of exact synthesis."""
