"""Chains on paper: no body lies on another but where a joint joins them, by plain geometry, and nothing is crowded."""

from itertools import combinations

import numpy as np
import pytest

import planar
from planar.structures.plane.layout import lay_out_chain
from tests.draws import first_cases, is_exhaustive, part

SOME = {
    (4, 1): 1,
    (6, 1): 1,
    (8, 1): 1,
    (5, 2): 1,
    (7, 2): 1,
    (8, 3): 1,
    (9, 2): 8,
    (10, 1): 29,
    (10, 3): 29,
    (12, 1): 2000,
}
"""By links and freedom: of so many chains one is drawn."""
LEAST_APART = 0.12
"""Of two joints, as a part of the greatest distance of any two."""
LEAST_ANGLE = 10.0
"""Degrees, between lines that meet in a joint."""


def some_chains():
    for (links, freedom), step in SOME.items():
        found = planar.chains(links, freedom)
        yield from (found[number] for number in part(range(0, len(found), step), 1))
    yield planar.chains(10)[40]  # not planar


@pytest.fixture(scope="module")
def drawn():
    return [(chain, lay_out_chain(chain.links, chain.edges)) for chain in some_chains()]


def bodies(layout):
    return [layout.places[list(joints)] for joints in layout.rotations]


def body_sides(corners):
    """The lines round a body; of a bar one."""
    return [(corners[k - 1], corners[k]) for k in range(len(corners) if len(corners) > 2 else 1)]


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def cross(one, other):
    """Whether two lines cross or touch."""
    (a, b), (c, d) = one, other
    return turn(a, b, c) * turn(a, b, d) <= 0 and turn(c, d, a) * turn(c, d, b) <= 0


def is_inside(spot, corners):
    """Whether a spot is within a plate, by the lines that a ray to the right meets."""
    met = 0
    for a, b in body_sides(corners):
        if (a[1] > spot[1]) != (b[1] > spot[1]):
            met += spot[0] < a[0] + (spot[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    return met % 2 == 1


def overlaps(chain, layout):
    """Two links each that lie on one another: a pinned pair beside its joint, others anywhere."""
    found = []
    every = bodies(layout)
    for one, other in combinations(range(chain.links), 2):
        shared = layout.places[chain.edges.index((one, other))] if (one, other) in chain.edges else None
        sides = [
            (s, t)
            for s in body_sides(every[one])
            for t in body_sides(every[other])
            if shared is None or not any((end == shared).all() for end in (*s, *t))
        ]
        free = [
            [spot for spot in each if shared is None or (spot != shared).any()] for each in (every[one], every[other])
        ]
        within = any(is_inside(spot, every[other]) for spot in free[0] if len(every[other]) > 2)
        within |= any(is_inside(spot, every[one]) for spot in free[1] if len(every[one]) > 2)
        if within or any(cross(*both) for both in sides):
            found.append((one, other))
    return found


def test_joints_are_those_of_the_chain_and_stand_where_all_its_links_have_them(drawn):
    for chain, layout in drawn:
        assert layout.places.shape == (chain.joints, 2)
        assert np.isfinite(layout.places).all()
        for link, joints in enumerate(layout.rotations):
            assert sorted(joints) == [number for number, joint in enumerate(chain.edges) if link in joint]


def test_no_link_of_a_planar_chain_lies_on_another_and_of_others_two_bars_cross(drawn):
    crossed = 0
    for chain, layout in drawn:
        found = overlaps(chain, layout)
        assert len(found) == layout.crossings, chain
        assert (layout.crossings == 0) == chain.is_planar
        assert all(chain.degrees[link] == 2 for both in found for link in both)
        crossed += layout.crossings > 0
    assert crossed


def test_plates_are_simple_polygons(drawn):
    for chain, layout in drawn:
        for corners in bodies(layout):
            sides = body_sides(corners)
            apart = [
                (s, t) for s, t in combinations(range(len(sides)), 2) if (t - s) % len(sides) not in (1, len(sides) - 1)
            ]
            assert not any(cross(sides[s], sides[t]) for s, t in apart), chain


def test_joints_are_not_crowded_and_no_angle_is_a_sliver(drawn):
    for chain, layout in drawn:
        apart = [np.hypot(*(a - b)) for a, b in combinations(layout.places, 2)]
        assert min(apart) > LEAST_APART * max(apart), chain
        for number, spot in enumerate(layout.places):
            ends = {}
            for joints in layout.rotations:
                for one, other in zip(joints, (*joints[1:], joints[0]), strict=True):
                    if number in (one, other):
                        ends[one + other - number] = None
            ways = np.sort([np.arctan2(*(layout.places[end] - spot)[::-1]) for end in ends])
            between = np.diff([*ways, ways[0] + 2.0 * np.pi])
            assert np.degrees(between.min()) > LEAST_ANGLE, chain


@pytest.mark.parametrize("links, freedom, number", first_cases([(12, 1, 2698), (12, 1, 2711)]))
def test_where_one_crossing_is_not_enough_two_bars_cross_twice(links, freedom, number):
    chain = planar.chains(links, freedom)[number]
    layout = lay_out_chain(chain.links, chain.edges)
    assert layout.crossings == len(overlaps(chain, layout)) == 2


def test_what_needs_many_crossings_is_drawn_all_the_same():
    """The complete bipartite chains of four and four links, and of five and five."""
    size = 5 if is_exhaustive() else 4
    joints = [(a, b) for a in range(size) for b in range(size, 2 * size)]
    layout = lay_out_chain(2 * size, joints)
    assert layout.places.shape == (size * size, 2)
    assert layout.crossings > 2
    assert np.isfinite(layout.places).all()


def test_a_chain_that_is_its_own_mirror_image_stands_so():
    places = lay_out_chain(6, planar.chains(6)[1].edges).places
    mirrored = places * [-1.0, 1.0]
    assert max(np.hypot(*(places - spot).T).min() for spot in mirrored) < 0.02
