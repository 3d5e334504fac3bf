"""A pair type that nothing else knows by name: found, read, solved, rated, drawn, forced and written."""

from dataclasses import dataclass

import numpy as np
import pytest

import planar
from planar.drawing.scheme.scheme import scheme
from planar.model.pairs import pair_types
from planar.model.pairs.guide_line import LinkLine
from planar.model.pairs.slot import SlotPair
from tests.linkages import Builder


@dataclass(frozen=True)
class TrialPair(SlotPair):
    """A pin in a slot by another name."""

    keyword = "trial"

    @classmethod
    def read(cls, entry):
        name, links = entry.name("trial"), entry.two_links("links")
        return (cls(name, links, LinkLine.read(entry, "line", links[0]), entry.point("point", links[1])),)

    @classmethod
    def write(cls, group, quantity):
        return {"trial" if key == "slot" else key: value for key, value in super().write(group, quantity).items()}

    @classmethod
    def samples(cls):
        def entry(of):
            return {"trial" if key == "slot" else key: value for key, value in of.items()}

        return tuple(each._replace(entry=entry(each.entry)) for each in super().samples())


@pytest.mark.parametrize("seed", range(3))
def test_a_new_pair_type_is_built_solved_rated_forced_drawn_and_written(seed, monkeypatch):
    monkeypatch.setitem(pair_types(), "trial", TrialPair)
    builder = Builder(np.random.default_rng(seed))
    crank, rider = builder.link(), builder.link()
    builder.drive(builder.turning("frame", crank), "frame", crank, 1.5, 0.5)
    name = builder.as_sampled("trial", crank, rider)
    builder.turning("frame", rider)
    mechanism = planar.from_dict(builder.built().value)
    state = planar.solve(mechanism)
    assert isinstance(next(each for each in mechanism.pairs if each.name == name), TrialPair)
    for link in (crank, rider):
        off = state.link(link).angle - builder.frames[link].angle
        assert np.exp(1j * off) == pytest.approx(1.0, abs=1e-9)
        assert np.isfinite(state.link(link).angular_acceleration)
    assert name in planar.forces(state).reactions
    assert scheme(state).marks
    assert planar.loads(planar.dumps(mechanism)) == mechanism
