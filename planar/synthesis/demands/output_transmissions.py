"""The transmission angles that a task demands: those of every output, where one force transmits to it."""

from __future__ import annotations

from collections.abc import Iterator

from planar.analysis.motion.transmission_angle import Transmission, transmission
from planar.foundation.errors import PlanarError
from planar.results.motion import Motion


def output_transmissions(motion: Motion) -> Iterator[Transmission]:
    """That of every pair with the frame that is no input, without those of which none is told."""
    mechanism = motion.mechanism
    inputs = {each.pair for each in mechanism.inputs}
    for pair in mechanism.pairs:
        if mechanism.frame in pair.links and pair.name not in inputs:
            try:
                yield transmission(motion, pair.name)
            except PlanarError:
                continue  # nothing is transmitted to it by one force
