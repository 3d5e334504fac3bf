"""Results of a sweep beside those of points: of links, pairs, inputs."""
