"""The models that come along, read and solved once for all tests; nothing of them can be changed."""

from functools import cache

import numpy as np

from planar.analysis.centres.centres import Centres, centres
from planar.document.files import load_models
from planar.model.link_graph import link_pair_graph
from planar.results.motion import State
from planar.solving.position import solve
from tests.draws import part

MODELS = {file.stem: mechanism for file, mechanism in load_models()}
"""Every model's mechanism, by the stem of its file."""


@cache
def state_of(stem: str) -> State:
    """A model at its own inputs."""
    return solve(MODELS[stem])


@cache
def found_centres(stem: str) -> Centres:
    """The instantaneous centres of that position."""
    return centres(state_of(stem))


def some_models(one_in: int, first: int = 0) -> list[str]:
    """One in so many of the models, and of pair types that these have not the first models that have them."""
    chosen = part(MODELS, one_in, first)
    kinds = {type(pair) for stem in chosen for pair in MODELS[stem].pairs}
    for stem, mechanism in MODELS.items():
        more = {type(pair) for pair in mechanism.pairs} - kinds
        if more:
            chosen.append(stem)
            kinds |= more
    return chosen


def kinds_of_model(stem: str) -> set[object]:
    """Its types of pairs, of loads, springs and masses, of pieces of laws, and the units of its file."""
    mechanism = MODELS[stem]
    parts = (*mechanism.pairs, *mechanism.loads, *mechanism.springs, *mechanism.masses)
    laws = {type(piece) for given in mechanism.inputs if given.law for piece in given.law.segments}
    return {*map(type, parts), *laws, mechanism.units}


def state_turned_by(model: str, pair: str, degrees: float):
    """A model at its own inputs, one of them farther by so much."""
    mechanism = MODELS[model]
    start = next(given.position for given in mechanism.inputs if given.pair == pair)
    return solve(mechanism, {pair: start + np.radians(degrees)})


def loop_sizes(model: str) -> list[int]:
    """The number of links in each loop."""
    import networkx as nx

    cycles = nx.simple_cycles(nx.Graph(link_pair_graph(MODELS[model])))
    return sorted(sum(kind == "link" for kind, _ in cycle) for cycle in cycles)
