"""What meets between the positions of a run: bodies on circles, whose least distance is known."""

from math import hypot, pi

import numpy as np
import pytest

import planar
from planar.manufacture.clearances import Body, body_of, keep_apart, ways_apart
from planar.manufacture.plates import convex_hull
from tests.draws import part

STEPS = 20
ROOM = 10.0


def turning(centres, turns=1.0, steps=STEPS):
    """Links that turn about centres by so many turns, of which the frame does not."""

    def places(link, points, level):
        many = steps * 2**level
        x, y = centres[link]
        angle = (0.0 if link == "frame" else 2.0 * pi * turns) * np.arange(many + 1)[:, None] / many
        u, v = np.array([(a - x, b - y) for a, b in points]).T
        return np.stack([x + np.cos(angle) * u - np.sin(angle) * v, y + np.sin(angle) * u + np.cos(angle) * v], axis=2)

    return places


@pytest.mark.parametrize("polar", np.linspace(0.1, 6.1, 9))
@pytest.mark.parametrize("gap", [-30.0, -10.05, -9.95, 9.95, 10.05, 40.0])
def test_a_tip_that_passes_a_post_between_positions_is_found(polar, gap):
    """The tip goes round at 100; the post is `gap` outside of its circle."""
    places = turning({"frame": (0.0, 0.0), "crank": (0.0, 0.0)})
    tip = Body("crank", ((100.0, 0.0),))
    post = Body("frame", (((100.0 + gap) * np.cos(polar), (100.0 + gap) * np.sin(polar)),))
    assert keep_apart(tip, post, ROOM, places) == (abs(gap) > ROOM) == keep_apart(post, tip, ROOM, places)


def test_what_is_nearer_than_can_be_told_counts_as_meeting():
    places = turning({"frame": (0.0, 0.0), "crank": (0.0, 0.0)})
    tip, post = Body("crank", ((100.0, 0.0),)), Body("frame", ((0.0, 110.0 + 1e-7),))
    assert not keep_apart(tip, post, ROOM, places)


def test_a_way_out_and_back_between_two_positions_is_seen():
    """It turns to and fro so often that at every position of the first run it is where it began."""
    places = turning({"frame": (0.0, 0.0), "crank": (0.0, 0.0)}, turns=float(STEPS))
    bar = body_of("crank", ((0.0, 0.0), (100.0, 0.0)))
    assert not keep_apart(bar, Body("frame", ((-60.0, 0.0),)), ROOM, turning({"frame": (0, 0), "crank": (0, 0)}))
    assert keep_apart(bar, Body("frame", ((0.0, 125.0),)), ROOM, places)


def test_distances_of_hulls_are_those_of_a_square_and_a_bar():
    square = np.array([[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]])
    for bar, wanted in (
        ([(13.0, 2.0), (30.0, 2.0)], 3.0),
        ([(13.0, 14.0), (40.0, 14.0)], hypot(3, 4)),
        ([(4.0, 4.0), (6.0, 6.0)], 0.0),
        ([(-5.0, 5.0), (15.0, 5.0)], 0.0),
    ):
        assert np.linalg.norm(ways_apart(square, np.array([bar]))) == pytest.approx(wanted)


def test_a_hull_has_no_corners_that_are_one_to_round_off():
    """Such a corner gives an edge of no direction, to the left of which everything would lie."""
    a, b = (-152.44760452746016, 152.4476045274602), (-124.16333327999828, 124.16333327999828)
    assert len(convex_hull([a, b, (b[0] + 1.5e-14, b[1])])) == 2
    assert len(convex_hull([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0 + 1e-15), (3.0, 3.0)])) == 2


@pytest.mark.parametrize(
    "model", part(("klann-leg", "jansen-leg", "v-twin-engine", "hoeken-straight-line", "belt-arm"), 2)
)
def test_few_positions_lead_to_the_layers_of_many(model):
    few, many = (planar.parts(model, scale=1.0, sheet=(9.0, 9.0), steps=steps) for steps in (30, 720))
    assert [(plate.name, plate.layer) for plate in few.plates] == [(plate.name, plate.layer) for plate in many.plates]
    assert few.is_clear == many.is_clear


@pytest.mark.parametrize("gap", [9.97, 11.5])
def test_a_way_from_a_dead_point_on_is_within_its_bound(gap):
    """A point goes by the square root of the input's way, past a post beside where it is first."""

    def places(link, points, level):
        along = np.sqrt(np.linspace(0.0, 1.0, STEPS * 2**level + 1))[:, None]
        bow = np.zeros_like(along) if link == "frame" else 40.0 * along * (0.1 - along)
        u, v = np.array(points).T
        return np.stack([u + (0.0 if link == "frame" else 100.0) * along, v + bow], axis=2)

    post = Body("frame", ((5.0, 40.0 * 0.05 * 0.05 + gap),))
    assert keep_apart(Body("rod", ((0.0, 0.0),)), post, ROOM, places) == (gap > ROOM)
