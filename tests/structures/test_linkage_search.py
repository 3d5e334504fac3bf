"""Linkages made of chains: they have the structure that was asked for, go together, and do what their notes say."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.structures.chain import Chain
from planar.structures.linkage_dimensions import Linkage, candidate_places, linkage_document
from tests.command import run
from tests.draws import part

CHOICES = part(
    [
        (links, freedom, number, frame, drives)
        for links, freedom in ((4, 1), (6, 1), (8, 1), (5, 2), (7, 2), (6, 3))
        for number, chain in enumerate(planar.chains(links, freedom))
        for frame, drives, _, _ in chain.mechanisms()
    ],
    one_in=40,
)


def joined_links(mechanism: planar.Mechanism) -> set[frozenset[str]]:
    """The pairs of a mechanism, each by its two links."""
    return {frozenset(pair.links) for pair in mechanism.pairs}


@pytest.mark.parametrize(("links", "freedom", "number", "frame", "drives"), CHOICES)
def test_a_chains_mechanism_has_its_structure_goes_together_and_turns_as_its_note_says(
    links, freedom, number, frame, drives
):
    chain = planar.chains(links, freedom)[number]
    mechanism = chain.mechanism(frame, drives, seed=1)
    letters = [each.name for each in mechanism.pairs]
    assert letters == sorted(letters)
    by_link = {link.name: {k for k, name in enumerate(letters) if name in link.names} for link in mechanism.links}
    expected = [{k for k, edge in enumerate(chain.edges) if link in edge} for link in range(links)]
    assert sorted(map(sorted, by_link.values())) == sorted(map(sorted, expected))
    assert by_link["frame"] == expected[frame]
    assert tuple(letters.index(each.pair) for each in mechanism.inputs) == drives
    state = planar.solve(mechanism)
    assert state.mobility == freedom
    assert state.residual < 1e-12
    motion = planar.cycle(mechanism, 36, pair=mechanism.inputs[0].pair)
    at = motion.inputs[mechanism.inputs[0].pair].position
    (note,) = mechanism.notes
    assert ("turns fully" in note) == (np.ptp(at) > 2.0 * pi - 1e-9)
    assert chain.mechanism(frame, drives, seed=1) == mechanism


def test_a_four_bar_that_turns_fully_is_grashofs():
    for seed in range(4):
        mechanism = planar.chains(4)[0].mechanism(seed=seed)
        assert "turns fully" in mechanism.notes[0]
        lengths = [value for name, value in planar.dimensions(mechanism).items() if name.endswith(".length")]
        ends = [value for name, value in planar.dimensions(mechanism).items() if name.startswith("frame.")]
        lengths.append(float(np.hypot(ends[0] - ends[2], ends[1] - ends[3])))
        assert min(lengths) + max(lengths) < 0.5 * sum(lengths)


def test_where_nothing_turns_fully_the_range_is_said(monkeypatch):
    """A crank as long as the rest is drawn only."""
    monkeypatch.setattr("planar.structures.linkage_dimensions.CRANK_SIZES", (1.6,))
    monkeypatch.setattr("planar.structures.linkage_search.ROUNDS", 1)
    monkeypatch.setattr("planar.structures.linkage_search.CANDIDATES", 3)
    found = [planar.chains(6)[0].mechanism(seed=seed) for seed in range(6)]
    (mechanism, *_) = [each for each in found if "turns fully" not in each.notes[0].split(";")[0]]
    motion = planar.cycle(mechanism)
    low, high = np.degrees([motion.inputs["A"].position.min(), motion.inputs["A"].position.max()])
    assert f"turns from {low:.6g} deg to {high:.6g} deg" in mechanism.notes[0]
    assert "of 3 random linkages of this structure none turns fully" in mechanism.notes[0]


def test_a_drive_between_moving_links_is_the_second_against_the_first():
    chain = planar.chains(6)[1]
    frame, drive = 2, next(k for k, edge in enumerate(chain.edges) if 2 not in edge)
    mechanism = chain.mechanism(frame, drive, seed=2)
    letter = [each.name for each in mechanism.pairs][drive]
    assert mechanism.inputs[0].pair == letter
    assert planar.solve(mechanism).residual < 1e-12


def test_the_sketch_of_a_document_is_where_it_was_drawn():
    linkage = Linkage(planar.chains(6)[1].edges, 4, (1,))
    places = candidate_places([linkage], np.random.default_rng(3))[0]
    mechanism = planar.from_dict(linkage_document(linkage, places, "x"))
    state = planar.solve(mechanism)
    size = 0.2 * np.ptp(places)
    for name, x, y in mechanism.sketch:
        assert state.point(name).position == pytest.approx((x, y), abs=0.02 * size)


@pytest.mark.parametrize(
    ("chosen", "told"),
    [
        ({"frame": 6}, "from 0 to 5 is wanted"),
        ({"drive": 7}, "from 0 to 6 is wanted"),
        ({"drive": (0, 1)}, "1 joint wanted that drive all links, as"),
        ({"frame": True}, "not True"),
        ({"seed": -1}, "from 0 on"),
    ],
)
def test_what_does_not_drive_a_chain_is_refused_in_a_sentence(chosen, told):
    with pytest.raises(BadInput, match=told):
        planar.chains(6)[0].mechanism(**chosen)


def test_a_chain_without_a_number_makes_mechanisms_too():
    edges = planar.chains(6)[0].edges
    assert Chain(6, 1, edges).mechanism(seed=1) == planar.chains(6)[0].mechanism(seed=1)


def test_the_command_writes_a_mechanism_that_solves(tmp_path):
    done = run(tmp_path, "generate", "--links", "6", "--chain", "1", "--frame", "4", "--seed", "3", "-o", "six.json")
    done.done()
    assert "Stephenson I six-bar. The link that" in done.out
    assert planar.solve(tmp_path / "six.json").residual < 1e-12
    for words, told in (
        (("--chain", "2", "-o", "a.json"), "numbers from 0 to 1"),
        (("--count", "2", "-o", "a.json"), "this is for a data set"),
        (("--chain", "1", "-o", "a.zarr"), "for one linkage write"),
        (("-o", "a.txt"), "a data set to a .zarr folder"),
    ):
        assert told in run(tmp_path, "generate", "--links", "6", *words).refused(2)
