"""The models that come along, read and solved once for all tests; nothing of them can be changed."""

from functools import cache

from planar.analysis.centres import Centres, centres
from planar.files import models
from planar.motion import State
from planar.solving.position import solve

MODELS = {file.stem: mechanism for file, mechanism in models()}
"""Every model's mechanism, by the stem of its file."""


@cache
def state_of(stem: str) -> State:
    """A model at its own inputs."""
    return solve(MODELS[stem])


@cache
def found_centres(stem: str) -> Centres:
    """The instantaneous centres of that position."""
    return centres(state_of(stem))
