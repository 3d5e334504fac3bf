"""Instantaneous centres: laws over all models and random linkages, closed forms, derivations executed again."""

from __future__ import annotations

import json
import re
from cmath import phase
from collections import Counter
from dataclasses import replace
from itertools import combinations
from math import atan2, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import planar
from benchmarks import chain
from planar.analysis.centres.centres import Centre, Centres, OpeningPairs, centres
from planar.analysis.centres.two_directions import centre_of
from planar.analysis.centres.velocities import links_by_centres, velocity_by_centres
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome, Unknown
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.reports.tables.centres import remarks
from planar.results.motion import State
from planar.solving.position import solve
from tests.builders import four_bar_document, slider_crank_document
from tests.closed_forms import between, piston
from tests.command import run, written
from tests.draws import covering, draws, first_cases
from tests.known import MODELS, kinds_of_model, some_models, state_of
from tests.known import found_centres as found
from tests.linkages import random_linkage
from tests.work import calls

EXACT = 1e-10
many = settings(
    max_examples=draws(15), deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


def moved(mechanism: Mechanism, rng: np.random.Generator) -> State | None:
    """The mechanism at a generic position near the file's; None where its branch does not lead there."""
    for far in (0.2, 0.05, 0.01):
        drives = []
        for each in mechanism.inputs:
            slides = planar.model.mechanism.relative_motions(mechanism)[each.pair].input_kind.value == "length"
            size = abs(each.position) or 0.1 if slides else 1.0
            drives.append(Drive(each.pair, each.position + far * size * float(rng.uniform(-1.0, 1.0))))
        try:
            return solve(mechanism, drives)
        except NoAnswer:
            continue
    return None


def one(at) -> np.ndarray:
    """A homogeneous point of length one."""
    at = np.asarray(at, dtype=float)
    return at / np.linalg.norm(at)


class Scale:
    """Homogeneous points with lengths in a position's own size, about its middle."""

    def __init__(self, state: State):
        points = np.array([point.position for point in state.points.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        self.middle, self.size = 0.5 * (low + high), float((high - low).max()) or 1.0

    def __call__(self, at) -> np.ndarray:
        x, y, w = at
        return one([(x - w * self.middle[0]) / self.size, (y - w * self.middle[1]) / self.size, w])

    def point(self, x: float, y: float) -> np.ndarray:
        return self((x, y, 1.0))


def same(a, b, within: float = 1e-12) -> bool:
    """Whether two homogeneous points are one."""
    return float(np.linalg.norm(np.cross(one(a), one(b)))) <= within


# laws


def motions_of(state: State, scale: Scale) -> dict[str, np.ndarray] | None:
    """Every link's w times its pole, from the rates that the state was solved with; a third route."""
    poles = {}
    for link, frame in state.frames.items():
        values = [getattr(frame, each) for each in ("x", "y", "angle")]
        (x, vx), (y, vy), (_, w) = (v.parts[:2] if hasattr(v, "parts") else (float(v), 0.0) for v in values)
        x, y = (x - scale.middle[0]) / scale.size, (y - scale.middle[1]) / scale.size
        poles[link] = np.array([w * x - vy / scale.size, w * y + vx / scale.size, w])
    most = max(np.linalg.norm(pole) for pole in poles.values())
    return {link: pole / most for link, pole in poles.items()} if most else None


def lawful(centres: Centres, within: float = EXACT) -> None:
    """All n(n-1)/2 centres, proved by the Jacobian, in line by threes, and with the rates that were solved for."""
    state = centres.state
    links = [link.name for link in state.mechanism.links]
    assert len(centres) == len(links) * (len(links) - 1) // 2
    assert {frozenset(each.links) for each in centres} == {frozenset(two) for two in combinations(links, 2)}
    assert [each.order for each in centres] == list(range(1, len(centres) + 1))
    assert centres.proof.collinear < within
    assert centres.proof.routes is None or centres.proof.routes < within
    assert centres.proof.velocities is None or centres.proof.velocities < within
    scale = Scale(state)
    motions = motions_of(state, scale)
    if motions is None:
        return
    for each in centres:
        if each.how == "open":
            continue
        a, b = each.links
        relative = motions[b] - motions[a]
        length = float(np.linalg.norm(relative))
        if each.how == "as one":
            assert length < 1e-6
        elif length > 1e-6:
            apart = float(np.linalg.norm(np.cross(scale(each.homogeneous), relative / length)))
            assert apart < within * 1e-3 / min(length, 1e-3), each


@pytest.mark.parametrize("stem", some_models(3, 1))
def test_every_model_has_all_its_centres_and_they_are_proved(stem):
    centres = found(stem)
    state = centres.state
    misfit = max((float(each) for each in state.misfits.values()), default=0.0)  # by as much the routes differ
    lawful(centres, max(EXACT, 10.0 * misfit / Scale(state).size))


@pytest.mark.parametrize("stem", some_models(6))
def test_they_are_proved_in_other_positions_too(stem):
    state = moved(MODELS[stem], np.random.default_rng(7))
    if state is not None:
        lawful(centres(state))


def random_state(seed: int, links: int, higher: float) -> State:
    mechanism = files.from_dict(random_linkage(seed, links, 0.0, higher).value)
    try:
        return solve(mechanism)
    except NoAnswer:
        assume(False)
        raise


@many
@given(st.integers(0, 10**6), st.integers(1, 12), st.sampled_from([0.0, 0.3]))
def test_random_linkages_have_all_their_centres_and_they_are_proved(seed, links, higher):
    state = random_state(seed, links, higher)
    result = centres(state)
    # what the null vector tells of two links that hardly move against each other is as much less exact
    scale = Scale(state)
    motions = motions_of(state, scale)
    least = 1.0
    for a, b in combinations(motions, 2):
        length = float(np.linalg.norm(motions[a] - motions[b]))
        least = min(least, length) if length > 1e-12 else least
    lawful(result, EXACT * max(1.0, 1e-3 / least))
    assert not [each for each in result if each.how == "open"]


# every derivation is executed again, from pins and slides, by this test's own code


class Again:
    """Executes the derivations of one position as they are written."""

    def __init__(self, centres: Centres):
        self.centres = centres
        self.state = centres.state
        self.scale = Scale(self.state)
        self.entries = planar.model.mechanism.relative_motions(self.state.mechanism)
        self.known: dict[str, np.ndarray] = {}
        self.linked = {each.name: frozenset(each.links) for each in centres}

    def run(self) -> None:
        for each in self.centres:
            if each.homogeneous is None:
                continue
            at = self.executed(each)
            assert same(at, self.scale(each.homogeneous), 1e-9), each
            self.known[each.name] = at

    def executed(self, centre: Centre) -> np.ndarray:
        text = centre.derivation
        if " by the equations round the loops" in text:
            return self.scale(centre.homogeneous)
        if text.startswith(f"{centre.name} = "):
            first, second = text[len(centre.name) + 3 :].split(" × ")
            return one(np.cross(self.line(first), self.line(second)))
        if ratio := re.fullmatch(r"(I\S+) on (I\S+) (I\S+), in the ratio of (.*)", text):
            return self.in_ratio(self.linked[ratio[1]], ratio[4])
        if slid := re.fullmatch(r"(I\S+) at infinity, square to the motion at (.*)", text):
            way = self.direction(slid[2])
            return np.array([-way[1], way[0], 0.0])
        return self.contact(re.fullmatch(r"(I\S+) at (.*)", text)[2])

    def line(self, text: str) -> np.ndarray:
        if named := re.fullmatch(r"the normal at (.*)", text):
            name = named[1]
            way, rider = self.direction(name), self.rider(name)
            return np.cross(rider, [-way[1], way[0], 0.0])
        first, second = text.split(" ")
        return np.cross(self.known[first], self.known[second])

    def in_ratio(self, two: frozenset[str], name: str) -> np.ndarray:
        """Against the carrier c the wheels obey w_b = n w_a: w_b - n w_a + (n - 1) w_c = 0 whoever looks on."""
        pair = self.entries[name]
        a, b = pair.links
        ratio = pair.ratio() if hasattr(pair, "ratio") else self.ratio_of_rates(a, b, pair.carrier)
        weights = {b: 1.0, a: -ratio, pair.carrier: ratio - 1.0}
        p, q = sorted(two)
        (third,) = set(weights) - two
        points = {}
        for link in (p, q):
            x, y, w = self.known[self.centres[link, third].name]
            points[link] = np.array([x / w, y / w, 1.0])
        # p and q turn against the third as weights[q] and -weights[p], and in the centre they are as fast
        return one(weights[q] * points[p] + weights[p] * points[q])

    def ratio_of_rates(self, first: str, second: str, carrier: str) -> float:
        """How fast one link turns beside another, of which a law says so."""
        rates = {name: self.state.links[name].angular_velocity for name in (first, second, carrier)}
        return (rates[second] - rates[carrier]) / (rates[first] - rates[carrier])

    def direction(self, name: str) -> np.ndarray:
        """Of the line at a pair, in the frame's axes."""
        pair = self.entries[name]
        guide = pair.links[0]
        angle = pair.line.direction_angle(self.state.shapes[guide]) + self.state.link(guide).angle
        return np.array([cos(angle), sin(angle)])

    def rider(self, name: str) -> np.ndarray:
        pair = self.entries[name]
        return self.scale.point(*self.state.point(f"{pair.links[1]}.{pair.point}").position)

    def contact(self, name: str) -> np.ndarray:
        """The pin of a pair, or where a pinion touches its rack."""
        pair = self.entries[name]
        together = pair.coincident_points()
        if together:
            return self.scale.point(*self.state.point(".".join(together[0])).position)
        way = self.direction(name)
        centre = self.state.point(f"{pair.links[1]}.{pair.point}").position
        return self.scale.point(*(centre - pair.radius * np.array([-way[1], way[0]])))


@pytest.mark.parametrize("stem", some_models(3))
def test_each_derivation_executed_again_gives_its_point(stem):
    Again(found(stem)).run()


def test_derivations_of_all_kinds_were_executed():
    wanted = {"pair", "Kennedy", "ratio", "equations", "normal", "infinity"}
    kinds = set()
    for stem in ("screw-jack", *some_models(3), *MODELS):
        for each in found(stem):
            kinds |= {each.how, *(["normal"] if "the normal at" in each.derivation else [])}
            kinds |= {"infinity"} if "at infinity" in each.derivation else set()
        if wanted <= kinds:
            return
    assert wanted <= kinds


@many
@given(st.integers(0, 10**6), st.integers(1, 10), st.sampled_from([0.0, 0.3]))
def test_each_derivation_of_random_linkages_executed_again_gives_its_point(seed, links, higher):
    state = random_state(seed, links, higher)
    result = centres(state)
    assume(all(each.proof.routes is None or each.proof.routes < 1e-12 for each in (result,)))
    Again(result).run()


@pytest.mark.parametrize("stem", some_models(3))
def test_the_lines_of_a_derivation_are_those_it_names(stem):
    for each in found(stem):
        told = [" ".join(line.centres) or f"the normal at {line.pair}" for line in each.lines]
        if each.how == "Kennedy":
            assert each.derivation == f"{each.name} = {told[0]} × {told[1]}"
            assert len(set(told)) == 2
        known = [other.name for other in found(stem) if other.order < each.order]
        assert all(name in known for line in each.lines for name in line.centres)


# how many are found how


BY_EQUATIONS = {
    "double-butterfly": 1,
    "double-flier": 1,
    "four-bar": 0,
    "watt-1-six-bar": 0,
    "stephenson-3-five-bar": 0,
    "klann-leg": 0,
    "peaucellier-lipkin": 0,
    "002-E3.6a": 0,
    "single-flier": 1,
    "ten-link": 1,
    "stephenson-1-six-bar": 0,
    "jansen-leg": 0,
    "rotary-engine": 0,
}


@pytest.mark.parametrize("stem", first_cases(BY_EQUATIONS, 8))
def test_only_kennedy_indeterminate_linkages_need_the_equations(stem):
    counts = Counter(each.how for each in found(stem))
    assert counts["equations"] == BY_EQUATIONS[stem]
    told = " ".join(remarks(found(stem)))
    assert ("none needed the simultaneous equations" in told) == (not BY_EQUATIONS[stem])
    for each in found(stem):
        if each.how == "equations":
            assert f"{each.name} needed the simultaneous equations" in told


@pytest.mark.parametrize("stem", covering(MODELS, kinds_of_model))
def test_pins_and_slides_show_as_many_as_there_are_two_links_that_they_join(stem):
    mechanism = MODELS[stem]
    joined = {
        frozenset(pair.links)
        for pair in planar.model.mechanism.relative_motions(mechanism).values()
        if pair.prevented_motion_count() == 2 and len(pair.bodies) == 2
    }
    assert joined <= {frozenset(each.links) for each in found(stem) if each.how == "pair"}


# closed forms


def pivoted_four_bar(a, b, c, at, angle, sketch=None, velocity=1.0, ground=(0.0, 0.0)):
    """The pivot of its rocker is `at`, that of its crank `ground`."""
    way, sketch = complex(*at) - complex(*ground), sketch or {"C": [at[0], at[1] + c]}
    more = {"shift": ground, "turn": phase(way), "omega": velocity, "sketch": sketch}
    return planar.from_dict(four_bar_document(a, b, c, abs(way), angle, **more))


def crossing(p, q, r, s) -> np.ndarray:
    """Where the line pq meets the line rs, by Cramer's rule."""
    (px, py), (qx, qy), (rx, ry), (sx, sy) = p, q, r, s
    matrix = np.array([[qx - px, rx - sx], [qy - py, ry - sy]])
    t = np.linalg.solve(matrix, np.array([rx - px, ry - py]))[0]
    return np.array([px + t * (qx - px), py + t * (qy - py)])


def test_in_a_four_bar_opposite_links_meet_in_the_two_centres_that_are_not_pins():
    state = solve(pivoted_four_bar(1.0, 3.0, 2.5, (3.2, 0.4), 1.1))
    a, b, c, d = (state.point(name).position for name in "ABCD")
    result = centres(state)
    np.testing.assert_allclose(result["BC", "AD"].position, crossing(a, b, d, c), rtol=1e-12)
    np.testing.assert_allclose(result["AB", "DC"].position, crossing(b, c, a, d), rtol=1e-12)
    assert result["DC", "AB"] is result["AB", "DC"]
    assert [each.derivation for each in result][4:] == ["I13 = I12 I23 × I14 I34", "I24 = I12 I14 × I23 I34"]


def placed_slider_crank(r, rod, offset, angle, turn=0.0, shift=(0.0, 0.0)):
    """With a link for its block, turned and shifted as a whole."""
    names = {"pins": "OBA", "names": ("frame", "OB", "BA"), "piston": "block"}
    return planar.from_dict(slider_crank_document(r, rod, angle, offset, turn=turn, shift=shift, omega=2.0, **names))


def test_in_a_slider_crank_the_crank_meets_the_square_to_the_stroke():
    r, rod, e, angle = 0.3, 1.1, 0.1, 0.8
    result = centres(solve(placed_slider_crank(r, rod, e, angle)))
    x = piston(angle, r, rod, e)[0]
    np.testing.assert_allclose(result["BA", "frame"].position, [x, x * sin(angle) / cos(angle)], rtol=1e-12)
    # I13 is where the rod's line meets the square to the stroke through O: v = w |OI|
    slope = (r * sin(angle) - e) / (r * cos(angle) - x)
    np.testing.assert_allclose(result["OB", "block"].position, [0.0, e - x * slope], rtol=1e-12, atol=1e-15)
    assert same(result["block", "frame"].homogeneous, [0.0, 1.0, 0.0])
    assert result["block", "frame"].position is None
    np.testing.assert_allclose(result["block", "frame"].direction, [0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_the_rod_of_a_trammel_turns_about_the_corner_opposite_to_that_of_the_slides(share):
    mechanism = MODELS["elliptical-trammel"]
    rod = hypot(*np.subtract(*(found("elliptical-trammel").state.point(name).position for name in "PQ")))
    result = centres(solve(mechanism, {"across": share * rod}))
    p, q = (result.state.point(name).position for name in "PQ")
    centre = result["bar", "frame"].position
    np.testing.assert_allclose(centre, [p[0], q[1]], rtol=1e-12, atol=1e-15)
    assert hypot(*centre) == pytest.approx(rod, rel=1e-12)  # the fixed centrode: a circle of the rod's radius
    assert hypot(*(centre - 0.5 * (p + q))) == pytest.approx(0.5 * rod, rel=1e-12)  # the moving one: half of it


def test_a_rolling_wheel_turns_about_where_it_touches():
    mechanism = MODELS["rolling-wheel"]
    result = found("rolling-wheel")
    rack = next(pair for pair in mechanism.pairs if hasattr(pair, "radius") and hasattr(pair, "line"))
    rolling = result[rack.links]
    centre = result.state.point(f"{rack.links[1]}.{rack.point}").position
    assert hypot(*(rolling.position - centre)) == pytest.approx(abs(rack.radius), rel=1e-12)
    frame = result.state.link(rack.links[0]).angle
    way = rack.line.direction_angle(result.state.shapes[rack.links[0]]) + frame
    assert abs((rolling.position - centre) @ [cos(way), sin(way)]) < 1e-12 * abs(rack.radius)
    assert rolling.how == "pair"


@pytest.mark.parametrize("radii", [(0.3, 0.5), (-0.8, 0.3), (0.2, -0.7)])
def test_two_wheels_touch_in_their_pitch_point(radii):
    r, s = radii
    apart = abs(r + s)
    value = {
        "planar": 1,
        "name": "gears",
        "frame": "frame",
        "links": {
            "frame": {"points": {"A": [0.0, 0.0], "B": [apart * cos(0.4), apart * sin(0.4)]}},
            "a": {"points": {"A": [0.0, 0.0], "P": [r / 2, 0.0]}},
            "b": {"points": {"B": [0.0, 0.0], "Q": [s / 2, 0.0]}},
        },
        "pairs": [
            {"turning": "A", "links": ["frame", "a"]},
            {"turning": "B", "links": ["frame", "b"]},
            {"gear": "mesh", "links": ["a", "b"], "radii": [r, s]},
        ],
        "inputs": [{"pair": "A", "position": 0.7, "velocity": 1.0}],
    }
    result = centres(solve(files.from_dict(value)))
    a, b = (result.state.point(name).position for name in "AB")
    pitch = result["a", "b"].position
    assert hypot(*(pitch - a)) == pytest.approx(abs(r), rel=1e-12)
    assert hypot(*(pitch - b)) == pytest.approx(abs(s), rel=1e-12)
    assert (pitch - a) @ (pitch - b) == pytest.approx(-r * s, rel=1e-12)  # between them, or beyond where internal
    assert result["a", "b"].how == "ratio"


def test_wheels_that_turn_alike_have_their_centre_at_infinity_along_the_arm():
    value = {
        "planar": 1,
        "name": "belt",
        "frame": "frame",
        "links": {
            "frame": {"points": {"A": [0.0, 0.0]}},
            "arm": {"ends": ["A", "B"], "length": 2.0},
            "a": {"points": {"A": [0.0, 0.0], "P": [0.3, 0.0]}},
            "b": {"points": {"B": [0.0, 0.0], "Q": [0.3, 0.0]}},
        },
        "pairs": [
            {"turning": "A", "links": ["frame", "arm", "a"]},
            {"turning": "B", "links": ["arm", "b"]},
            {"belt": "belt", "links": ["a", "b"], "carrier": "arm", "radii": [0.3, 0.3]},
        ],
        "inputs": [
            {"pair": "A:frame,arm", "position": 0.7, "velocity": 1.0},
            {"pair": "A:frame,a", "position": 0.1, "velocity": 3.0},
        ],
    }
    result = centres(solve(files.from_dict(value)))
    assert same(result["a", "b"].homogeneous, [cos(0.7), sin(0.7), 0.0])
    assert result["a", "b"].how == "ratio"
    # w_b = 3 about B, which moves with w = 1 about A: I_bf on the arm at 2 - 2 / 3
    np.testing.assert_allclose(result["b", "frame"].position, 4 / 3 * np.array([cos(0.7), sin(0.7)]), rtol=1e-12)


def test_the_coupler_of_a_parallelogram_has_its_centre_at_infinity_along_the_cranks():
    result = centres(solve(pivoted_four_bar(1.0, 3.0, 1.0, (3.0, 0.0), 0.9, {"C": [3.0 + cos(0.9), sin(0.9)]})))
    for two, way in ((("BC", "AD"), [cos(0.9), sin(0.9), 0.0]), (("AB", "DC"), [1.0, 0.0, 0.0])):
        assert same(result[two].homogeneous, way, 1e-12)
        assert result[two].position is None
        assert hypot(*result[two].direction) == pytest.approx(1.0)


# centres belong to the mechanism


def still(at):
    return at


def alike(first: Centres, second: Centres, moving=still, within: float = 1e-9) -> None:
    scale = Scale(second.state)
    for each in first:
        other = second[each.links]
        assert (each.how in ("equations", "Kennedy")) == (other.how in ("equations", "Kennedy"))
        if moving is still:  # which of lines that meet alike are taken may depend on the axes
            assert (each.how, each.derivation) == (other.how, other.derivation)
        if each.homogeneous is not None:
            assert same(scale(moving(each.homogeneous)), scale(other.homogeneous), within), each


@pytest.mark.parametrize("stem", [s for s in some_models(3, 2) if len(MODELS[s].inputs) == 1])
def test_an_input_at_rest_or_twice_as_fast_changes_nothing(stem):
    (given_input,) = MODELS[stem].inputs
    for rate in (0.0, 2.0 * (given_input.velocity or 1.0)):
        other = replace_inputs(MODELS[stem], (Drive(given_input.pair, velocity=rate, acceleration=3.0),))
        alike(found(stem), centres(solve(other)), within=1e-13)


@pytest.mark.parametrize("stem", some_models(3, 1))
def test_a_mechanism_has_the_centres_of_its_position(stem):
    alike(found(stem), centres(MODELS[stem]), within=1e-10)


@pytest.mark.parametrize(
    "turn, shift, factor", [(1.1, (3.0, -2.0), 1.0), (-2.3, (0.1, 40.0), 50.0), (pi, (0, 0), 1e-4)]
)
def test_turned_moved_or_scaled_mechanisms_have_their_centres_turned_moved_or_scaled(turn, shift, factor):
    way = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    motion = np.block([[factor * way, np.reshape(shift, (2, 1))], [np.zeros((1, 2)), np.ones((1, 1))]])

    def place(x, y):
        return (motion @ [x, y, 1.0])[:2].tolist()

    here = solve(pivoted_four_bar(1.0, 3.0, 2.5, (3.2, 0.4), 1.1, {"C": [3.0, 2.5]}))
    lengths = [factor * each for each in (1.0, 3.0, 2.5)]
    there = pivoted_four_bar(*lengths, place(3.2, 0.4), 1.1, {"C": place(3.0, 2.5)}, ground=place(0.0, 0.0))
    alike(centres(here), centres(solve(there)), lambda at: motion @ at, 1e-11)
    here = solve(placed_slider_crank(0.3, 1.1, 0.1, 0.8))
    there = solve(placed_slider_crank(0.3 * factor, 1.1 * factor, 0.1 * factor, 0.8, turn, shift))
    alike(centres(here), centres(there), lambda at: motion @ at, 1e-11)


@pytest.mark.parametrize("stem", ["single-flier", "double-flier", "double-butterfly", "watt-1-six-bar", "jansen-leg"])
def test_linkages_of_pins_turned_and_moved_have_their_centres_turned_and_moved(stem):
    turn, shift = 0.8, np.array([0.3, -0.2])
    value = files.to_dict(MODELS[stem])
    unit = {"mm": 1e-3, "m": 1.0}[value.get("units", {}).get("length", "m")]
    way = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])

    def place(at):
        return (way @ np.array(at, dtype=float) + shift / unit).tolist()

    frame = value["links"][value["frame"]]
    frame["points"] = {name: place(at) for name, at in frame["points"].items()}
    value["sketch"] = {name: place(at) for name, at in value["sketch"].items()}
    mechanism = files.from_dict(value)
    (given_input,) = mechanism.inputs
    mechanism = replace_inputs(mechanism, (Drive(given_input.pair, given_input.position + turn),))
    motion = np.block([[way, shift[:, None]], [np.zeros((1, 2)), np.ones((1, 1))]])
    alike(found(stem), centres(solve(mechanism)), lambda at: motion @ at)


# dead points and change points


def on_a_dead_point(velocity: float = 1.0) -> Mechanism:
    """A rocker that drives, in the position where coupler and other rocker are in line."""
    a, b, c, d = 2.0, 1.5, 1.0, 2.2
    angle = float(between(a, d, b + c))
    return pivoted_four_bar(a, b, c, (d, 0.0), angle, {"C": [1.5, 0.7]}, velocity)


def test_on_a_dead_point_of_the_input_there_are_all_centres_though_no_velocities():
    mechanism = on_a_dead_point()
    with pytest.raises(NoAnswer) as refused:
        solve(mechanism)
    assert refused.value.outcome is Outcome.DEAD_POINT
    result = centres(mechanism)
    lawful(result)
    b, d = (result.state.point(name).position for name in "BD")
    # where two links are in line places are exact to the root of rounding
    np.testing.assert_allclose(result["BC", "AD"].position, b, atol=1e-6)
    np.testing.assert_allclose(result["AB", "DC"].position, d, atol=1e-6)
    assert result.as_one == (("AB", "AD"),)
    assert "AB rests in this position" in remarks(result)
    assert any("dead point" in remark for remark in result.state.remarks)
    alike(result, centres(on_a_dead_point(0.0)), within=0.0)


@pytest.mark.parametrize("crank", [1e-8, 1e-9, 1e-10])
def test_a_link_that_moves_slowly_in_a_regular_position_does_not_rest(crank):
    result = centres(files.from_dict(four_bar_document(crank, 1.0, 1.0, 1.2, 1.0)))
    assert not result.as_one
    lawful(result, EXACT * 1e-3 / crank)


def test_a_dead_point_of_a_piston_that_drives_has_all_centres():
    r, rod = 0.3, 1.1
    mechanism = placed_slider_crank(r, rod, 0.0, 0.0)
    driven = replace(mechanism, inputs=(planar.Input("stroke", r + rod, 1.0),))
    result = centres(driven)
    lawful(result)
    np.testing.assert_allclose(result["BA", "frame"].position, [r + rod, 0.0], atol=1e-6)
    assert ("block", "frame") in result.as_one
    for each in centres(solve(mechanism)):  # numbered from the crank, but where they were
        assert same(each.homogeneous, result[each.links].homogeneous, 1e-6)


@pytest.mark.parametrize("velocity", [0.0, 1.0])
def test_at_a_change_point_what_is_not_determined_is_said_and_nothing_is_invented(velocity):
    flat = pivoted_four_bar(1.0, 2.0, 1.0, (2.0, 0.0), 0.0, {"B": [1.0, 0.0], "C": [3.0, 0.0]}, velocity)
    with pytest.raises(NoAnswer) as refused:
        solve(flat)
    assert refused.value.outcome is Outcome.CHANGE_POINT
    result = centres(flat)
    lawful(result)
    assert {each.name for each in result if each.how == "open"} == {"I13", "I24"}
    for each in result:
        if each.how == "open":
            assert each.homogeneous is each.position is each.direction is None
            assert "may move in 2 ways from this position" in each.derivation
    assert "I13 and I24 are not determined" in " ".join(remarks(result))
    with pytest.raises(NoAnswer) as refused:
        velocity_by_centres(result, "C")
    assert refused.value.outcome is Outcome.CHANGE_POINT


def test_at_a_change_point_each_branch_has_its_own_centres():
    """w_3 = w_1 of the parallelogram; else w_3 = -(d + a) / (d - a) w_1 of the antiparallelogram, from the second order
    of the loop: (w_3 - w_1)(w_3 + w_1) a = d ((w_3 - w_1) a / d)^2."""
    a, d = 1.0, 2.0
    flat = pivoted_four_bar(a, d, a, (d, 0.0), 0.0, {"B": [a, 0.0], "C": [a + d, 0.0]})
    result = centres(flat)
    straight, crossed = sorted(result.branches, key=lambda branch: -abs(branch["I13"][0]))
    for name in ("I13", "I24"):
        assert same(straight[name], [1.0, 0.0, 0.0], 1e-6)
    ratio = -(d + a) / (d - a)
    along = ratio * d / (ratio - 1.0)  # w_1 x = w_3 (x - d)
    np.testing.assert_allclose(crossed["I13"][:2] / crossed["I13"][2], [along, 0.0], atol=1e-6)
    turns = (ratio - 1.0) * a / d  # of the coupler, whose end B moves with w_1 a
    np.testing.assert_allclose(crossed["I24"][:2] / crossed["I24"][2], [a - a / turns, 0.0], atol=1e-6)
    told = " ".join(remarks(result))
    assert "on branch 1" in told
    assert "on branch 2" in told
    # and it is what the position next to it has
    angle = 1e-4
    near = solve(pivoted_four_bar(a, d, a, (d, 0.0), angle, {"C": [a + d, a * ratio * angle], "B": [a, a * angle]}))
    assert same(centres(near)["AB", "DC"].homogeneous, crossed["I13"], 1e-3)
    assert found("four-bar").branches == ()


def test_a_truss_has_its_pins_and_all_its_links_at_rest():
    truss = pivoted_four_bar(1.0, 2.0, 1.5, (2.0, 0.0), 1.0)
    held = replace(truss, pairs=(*truss.pairs,), inputs=())
    value = files.to_dict(held)
    value["links"]["BC"]["points"] = {"E": [1.0, 0.5]}
    value["links"]["AD"]["points"]["F"] = [1.2, 1.9]
    value["links"]["EF"] = {"ends": ["E", "F"], "length": 0.9}
    value["pairs"] += [{"turning": "E", "links": ["BC", "EF"]}, {"turning": "F", "links": ["EF", "AD"]}]
    result = centres(files.from_dict(value))
    assert result.as_one == (("AB", "BC", "DC", "EF", "AD"),) or len(result.as_one[0]) == 5
    assert result.proof.routes is None
    assert result.proof.velocities is None
    assert {each.how for each in result} <= {"pair", "Kennedy", "as one"}


# several inputs


SEVERAL = [stem for stem, mechanism in MODELS.items() if len(mechanism.inputs) > 1]


@pytest.mark.parametrize("stem", covering(SEVERAL, kinds_of_model))
def test_several_inputs_have_the_centres_of_the_ratio_of_their_rates(stem):
    mechanism = MODELS[stem]
    rng = np.random.default_rng(3)
    rates = {each.pair: float(rng.uniform(0.5, 2.0)) for each in mechanism.inputs}
    first = replace_inputs(mechanism, tuple(Drive(pair, velocity=rate) for pair, rate in rates.items()))
    result = centres(solve(first))
    lawful(result)
    thrice = replace_inputs(mechanism, tuple(Drive(pair, velocity=3.0 * rate) for pair, rate in rates.items()))
    alike(result, centres(thrice), within=1e-9)


@pytest.mark.parametrize("stem", covering(SEVERAL, kinds_of_model))
def test_with_all_inputs_at_rest_the_centres_that_depend_on_them_are_left_open(stem):
    mechanism = MODELS[stem]
    still = replace_inputs(mechanism, tuple(Drive(each.pair, velocity=0.0) for each in mechanism.inputs))
    result = centres(still)
    lawful(result)
    left = [each for each in result if each.how == "open"]
    assert left
    assert all("the ratio of the inputs' rates" in each.derivation for each in left)
    # what is found without them is what is found with any
    for each in result:
        if each.how in ("pair", "ratio"):
            assert each.derivation == found(stem)[each.links].derivation


def test_a_planetary_differential_follows_the_ratio_of_its_inputs():
    result = found("planetary-differential")
    sun, ring = (given.velocity for given in MODELS["planetary-differential"].inputs)
    inner, outer = (result[two].position for two in (("sun", "planet"), ("ring", "planet")))
    v_inner, v_outer = sun * hypot(*inner), ring * hypot(*outer)
    # the planet's velocity is v_inner at one pitch point and v_outer at the other: nothing on the line between
    share = v_inner / (v_inner - v_outer)
    np.testing.assert_allclose(result["planet", "frame"].position, inner + share * (outer - inner), rtol=1e-10)
    assert any("given ratio of the inputs' rates" in remark for remark in remarks(result))


# velocities by centres


@pytest.mark.parametrize("stem", some_models(3))
def test_velocities_by_centres_are_those_of_the_state(stem):
    result = found(stem)
    points = result.state.points
    fastest = max(hypot(*point.velocity) for point in points.values())
    turning = links_by_centres(result)
    for link, each in turning.items():
        np.testing.assert_allclose(
            each.angular_velocity,
            result.state.link(link).angular_velocity,
            atol=1e-10 * max(1.0, *(abs(link.angular_velocity) for link in result.state.links.values())),
        )
    for name in list(points)[:6]:
        by = velocity_by_centres(result, name)
        np.testing.assert_allclose(by.velocity, points[name].velocity, atol=1e-10 * (fastest or 1.0))
        if by.radius is not None:
            assert hypot(*by.velocity) == pytest.approx(abs(by.angular_velocity) * by.radius, abs=1e-10 * fastest)


@many
@given(st.integers(0, 10**6), st.integers(1, 9), st.sampled_from([0.0, 0.3]))
def test_velocities_by_centres_of_random_linkages_are_those_of_the_state(seed, links, higher):
    state = random_state(seed, links, higher)
    result = centres(state)
    assume(result.proof.routes is not None and result.proof.routes < 1e-12)
    try:
        turning = links_by_centres(result)
    except NoAnswer:
        assume(False)  # an input alone does not tell what others drive that hang on none of its links
        raise
    fastest = max(abs(link.angular_velocity) for link in state.links.values())
    for link, each in turning.items():
        assert each.angular_velocity == pytest.approx(state.link(link).angular_velocity, abs=1e-7 * (fastest or 1.0))


def test_the_chapters_connecting_rod_turns_about_its_centre():
    """004, problem by the method of instantaneous centres: r 160 mm, l 500 mm, 4500 rpm, 40 deg."""
    result = found("004-EX-piston")
    r, rod, angle = 0.16, 0.5, 2 * pi / 9
    x = piston(angle, r, rod)[0]
    corner = np.array([x, x * sin(angle) / cos(angle)])
    turning = result["AB", "frame"]
    np.testing.assert_allclose(turning.position, corner, rtol=1e-12)
    assert turning.derivation == "I24 = I12 I14 × I23 I34"
    a, b, p = (velocity_by_centres(result, name) for name in "ABP")
    omega = 4500 * 2 * pi / 60 * r / hypot(*(corner - [r * cos(angle), r * sin(angle)]))
    assert a.radius == pytest.approx(corner[1], rel=1e-12)
    assert b.radius == pytest.approx(r, rel=1e-12)  # the crank's own: B belongs to it first
    assert p.radius == pytest.approx(0.5631762, rel=1e-6)
    assert abs(p.angular_velocity) == pytest.approx(omega, rel=1e-12)
    assert hypot(*p.velocity) == pytest.approx(66.48, abs=0.005)
    assert hypot(*p.velocity) == pytest.approx(omega * p.radius, rel=1e-12)
    assert hypot(*a.velocity) == pytest.approx(omega * a.radius, rel=1e-12)


def test_a_sliding_link_moves_by_its_centre_at_infinity():
    mechanism = placed_slider_crank(0.3, 1.1, 0.1, 0.8)
    (given_input,) = mechanism.inputs
    state = solve(mechanism)
    driven = replace(mechanism, inputs=(planar.Input("stroke", state.pair("stroke")["displacement"], -0.7),))
    result = centres(solve(driven))
    a = velocity_by_centres(result, "block.A")
    assert hypot(*a.velocity) == pytest.approx(0.7)
    assert result.state.point("A").velocity == pytest.approx(a.velocity)
    crank = links_by_centres(result)["OB"]
    assert crank.angular_velocity == pytest.approx(result.state.link("OB").angular_velocity)
    assert given_input.pair == "O"


def test_points_of_the_frame_rest_and_unknown_ones_are_refused():
    result = found("four-bar")
    assert not velocity_by_centres(result, "A").velocity.any()
    with pytest.raises(Unknown, match="there is no point 'X'"):
        velocity_by_centres(result, "X")
    with pytest.raises(Unknown, match="links are"):
        _ = result["AB", "X"]


def test_on_a_dead_point_the_rate_of_the_input_tells_no_velocity():
    with pytest.raises(NoAnswer) as refused:
        velocity_by_centres(centres(on_a_dead_point()), "C")
    assert refused.value.outcome is Outcome.DEAD_POINT
    with pytest.raises(NoAnswer, match="does not determine"):
        velocity_by_centres(centres(on_a_dead_point(0.0)), "C")


def test_an_input_at_rest_leaves_all_at_rest():
    still = replace_inputs(MODELS["four-bar"], (Drive("A", velocity=0.0),))
    result = centres(still)
    assert not any(velocity_by_centres(result, name).velocity.any() for name in "ABCD")


# two known directions of velocity


@given(st.integers(0, 10**6))
@settings(max_examples=draws(40), deadline=None)
def test_two_velocities_of_a_turning_link_give_back_its_centre(seed):
    rng = np.random.default_rng(seed)
    centre, a, b = rng.uniform(-1.0, 1.0, (3, 2))
    omega = float(rng.uniform(0.5, 3.0) * rng.choice([-1.0, 1.0]))
    va, vb = (omega * np.array([-(p - centre)[1], (p - centre)[0]]) for p in (a, b))
    assume(min(hypot(*va), hypot(*vb), hypot(*(b - a))) > 1e-2)
    assume(abs(va[0] * vb[1] - va[1] * vb[0]) > 1e-2 * hypot(*va) * hypot(*vb))
    along = (b - a) / hypot(*(b - a))
    for told in (vb, atan2(vb[1], vb[0]), atan2(-vb[1], -vb[0])):
        if np.ndim(told) == 0 and abs(vb @ along) < 1e-2:
            continue
        link = centre_of(a, va, b, told)
        np.testing.assert_allclose(link.position, centre, atol=1e-10)
        assert link.radius_a == pytest.approx(hypot(*(a - centre)), abs=1e-10)
        assert link.radius_b == pytest.approx(hypot(*(b - centre)), abs=1e-10)
        assert link.angular_velocity == pytest.approx(omega, abs=1e-9)
        np.testing.assert_allclose(link.velocity_b, vb, atol=1e-9)
        assert hypot(*va) == pytest.approx(abs(link.angular_velocity) * link.radius_a, abs=1e-9)
        assert hypot(*link.velocity_b) == pytest.approx(abs(link.angular_velocity) * link.radius_b, abs=1e-9)


@pytest.mark.parametrize("vb, centre", [(3.0, -1.0), (-1.0, 1.0), (0.5, 4.0), (0.0, 2.0)])
def test_parallel_velocities_have_their_centre_on_the_line_through_the_arrow_heads(vb, centre):
    """Case 2: v_A = 1 at x = 0, v_B at x = 2, both upwards; v = 1 + (v_B - 1) x / 2."""
    link = centre_of((0.0, 0.0), (0.0, 1.0), (2.0, 0.0), (0.0, vb))
    np.testing.assert_allclose(link.position, [centre, 0.0], atol=1e-15)
    assert link.angular_velocity == pytest.approx((vb - 1.0) / 2.0)
    assert link.radius_a == pytest.approx(abs(centre))
    assert link.radius_b == pytest.approx(abs(centre - 2.0))


@pytest.mark.parametrize("told", [(1.0, 1.0), pi / 4, -3 * pi / 4])
def test_equal_velocities_put_the_centre_at_infinity_square_to_them(told):
    link = centre_of((0.0, 0.0), (1.0, 1.0), (2.0, 0.0), told)
    assert link.position is link.radius_a is link.radius_b is None
    assert same(link.homogeneous, [-1.0, 1.0, 0.0])
    assert link.angular_velocity == 0.0
    np.testing.assert_allclose(link.velocity_b, [1.0, 1.0])


def test_a_point_at_rest_is_the_centre_and_a_link_at_rest_has_none():
    link = centre_of((1.0, 2.0), (0.0, 0.0), (1.0, 4.0), (-6.0, 0.0))
    np.testing.assert_allclose(link.position, [1.0, 2.0])
    assert (link.radius_a, link.radius_b, link.angular_velocity) == pytest.approx((0.0, 2.0, 3.0))
    still = centre_of((1.0, 2.0), (0.0, 0.0), (1.0, 4.0), (0.0, 0.0))
    assert still.homogeneous is still.position is None
    assert still.angular_velocity == 0.0


@pytest.mark.parametrize(
    "given_values, said",
    [
        (((0, 0), (1, 0), (2, 0), (2, 0)), "move apart"),
        (((0, 0), (1, 0), (0, 0), (1, 0)), "one point"),
        (((0, 0), (0, 1), (2, 0), pi / 2), "its direction is not enough"),
        (((0, 0), (1, 0), (2, 0), pi / 2), "no rigid link can do"),
        (((0, 0), (0, 0), (2, 0), pi / 2), "its direction is not enough"),
        (((0, 0), (1, np.nan), (2, 0), 0.0), "finite"),
        (((0, 0), (1, 0), (2, 0), np.inf), "finite"),
        (((0, 0), (1, 0), (2, 0), (1, 2, 3)), "finite"),
    ],
)
def test_velocities_that_no_rigid_link_has_are_refused(given_values, said):
    with pytest.raises(BadInput, match=said):
        centre_of(*given_values)


# speed and names


def test_a_centre_of_many_links_takes_no_more_work_than_one_of_few():
    few, state, results = centres(state_of("four-bar")), state_of("chain-42"), []
    most = calls(lambda: centres(state_of("four-bar"))) / len(few)
    work = calls(lambda: results.append(centres(state)))
    (result,) = results
    assert len(result) == 861
    assert work / len(result) < most
    assert result["crank", "frame"].name == "I1,42" if "crank" in result.numbers else True
    assert all(re.fullmatch(r"I\d+,\d+", each.name) for each in result)


def test_up_to_nine_links_names_need_no_comma():
    assert all(re.fullmatch(r"I\d\d", each.name) for each in found("stephenson-valve-gear"))
    assert all(re.fullmatch(r"I\d+,\d+", each.name) for each in found("ten-link"))


HOSTILE = {"AB": "[bold]x × y", "BC": "I24 = I12", "DC": "a - b", "AD": "$(rm) frame/é"}


def hostile() -> dict:
    text = json.dumps(files.to_dict(MODELS["four-bar"]))
    for old, new in HOSTILE.items():
        text = text.replace(json.dumps(old), json.dumps(new))
    return json.loads(text)


def test_links_may_have_any_names():
    result = centres(files.from_dict(hostile()))
    for each in found("four-bar"):
        other = result[tuple(HOSTILE[link] for link in each.links)]
        assert (other.name, other.derivation) == (each.name, each.derivation)
        assert same(other.homogeneous, each.homogeneous)


# the whole program


def test_the_command_prints_all_centres_in_the_order_of_finding(tmp_path):
    ended = run(tmp_path, "centres", "002-E3.1")
    assert (ended.status, ended.err) == (0, "")
    rows = re.findall(r"^ +(\d+) +(I\d\d) +(\S+ - \S+) +(\w+) +(\S+) +(\S+) +(I.*?) *$", ended.out, re.MULTILINE)
    assert [row[:2] for row in rows] == [(str(e.order), e.name) for e in found("002-E3.1")]
    for row, each in zip(rows, found("002-E3.1"), strict=True):
        assert [float(row[4]), float(row[5])] == pytest.approx(list(1000.0 * each.position), rel=1e-5, abs=1e-9)
        assert (row[2], row[3], row[6]) == (" - ".join(each.links), each.how, each.derivation)
    assert "6 centres of 4 links: 4 by the pairs and 2 by Kennedy's theorem" in ended.out
    assert "none needed the simultaneous equations" in ended.out
    assert len(re.findall(r"to round-off \(\d\.\de-1\d|exactly", ended.out)) == 3


def test_the_command_says_what_lies_at_infinity_and_where(tmp_path):
    ended = run(tmp_path, "centres", "elliptical-trammel", "--at", "across=60mm")
    assert ended.status == 0
    assert re.search(r"I14 .*at infinity +at 90 deg +I14 at infinity, square to the motion at across", ended.out)
    assert re.search(r"I24 +bar - frame +Kennedy +60 +103\.923", ended.out)  # 120^2 = 60^2 + 103.923^2


def test_the_command_prints_si_values_for_programs(tmp_path):
    ended = run(tmp_path, "centres", "single-flier", "--json")
    value = json.loads(ended.out)
    assert value["links"]["frame"] == "8"
    assert len(value["centres"]) == 28
    for told, each in zip(value["centres"], found("single-flier"), strict=True):
        assert told["links"] == list(each.links)
        assert told["derivation"] == each.derivation
        np.testing.assert_allclose(told["position"], each.position, rtol=1e-9)
        np.testing.assert_allclose(told["homogeneous"], each.homogeneous, atol=1e-9)
    assert sum(each["how"] == "equations" for each in value["centres"]) == 1
    assert set(value["proof"]) == {"routes", "collinear", "velocities"}
    assert max(value["proof"].values()) < EXACT
    trammel = json.loads(run(tmp_path, "centres", "elliptical-trammel", "--json").out)["centres"][0]
    assert (trammel["position"], trammel["homogeneous"][2]) == (None, 0.0)


def test_the_command_answers_on_dead_points_and_change_points(tmp_path):
    (tmp_path / "dead.json").write_text(planar.dumps(on_a_dead_point()))
    ended = run(tmp_path, "centres", "dead.json")
    assert (ended.status, ended.err) == (0, "")
    assert "AB rests in this position" in ended.out
    flat = pivoted_four_bar(1.0, 2.0, 1.0, (2.0, 0.0), 0.0, {"B": [1.0, 0.0], "C": [3.0, 0.0]})
    (tmp_path / "flat.json").write_text(planar.dumps(flat))
    ended = run(tmp_path, "centres", "flat.json")
    assert ended.status == 0
    assert "I13 and I24 are not determined" in ended.out


def test_the_command_prints_hostile_names_as_they_are(tmp_path):
    (tmp_path / "x.json").write_text(json.dumps(hostile()))
    ended = run(tmp_path, "centres", "x.json")
    assert (ended.status, ended.err) == (0, "")
    assert "[bold]x × y - I24 = I12" in ended.out


def test_the_command_refuses_what_it_cannot_do_in_a_sentence(tmp_path):
    ended = run(tmp_path, "centres", "no-such-model")
    assert ended.status == 2
    ended = run(tmp_path, "centres", "four-bar", "--at", "X=1")
    assert ended.status == 2
    ended = run(tmp_path, "centres", "four-bar", "--json", "-o", "x.txt")
    assert ended.status == 2
    open_chain = files.to_dict(MODELS["geared-five-bar"])
    open_chain["inputs"] = []
    (tmp_path / "open.json").write_text(json.dumps(open_chain))
    ended = run(tmp_path, "centres", "open.json")
    assert (ended.status, ended.out) == (1, "")
    assert ended.err.startswith("planar: too few inputs:")
    assert run(tmp_path, "centres", "four-bar", "-o", "x.txt").status == 0
    assert "I24 = I12 I14 × I23 I34" in (tmp_path / "x.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize("seed", range(5))
def test_openings_are_counted_as_centres_become_known(seed):
    """Beside the same count made at once from all that is known."""
    rng, count = np.random.default_rng(seed), 9
    opening, known = OpeningPairs(count), np.zeros((count, count), dtype=int)
    left = {*combinations(range(count), 2)}
    while left:
        line = (known == 0) & (known @ known > 0)
        np.fill_diagonal(line, val=False)
        opens = line.astype(int) @ known
        opens = opens + opens.T
        assert opening.best_pair() == max(sorted(left), key=lambda two: opens[two])
        pair = sorted(left)[rng.integers(len(left))]
        left.remove(pair)
        if rng.random() < 0.2:
            opening.exclude(pair)
        else:
            opening.add_known([pair])
            known[pair] = known[pair[::-1]] = 1
    assert opening.best_pair() is None


def test_centres_of_one_link_are_those_among_all():
    """Of many links only those of the link and of the frame are searched for, of few all."""
    for state, link in ((state_of("slider-crank"), "rod"), (solve(planar.from_dict(chain.document(44))), "rocker5")):
        every, some = centres(state), centres(state, link)
        assert [centre.name for centre in every if link in centre.links] == sorted(
            (centre.name for centre in some), key=[centre.name for centre in every].index
        )
        assert len(some) == len(every.numbers) - 1
        for centre in some:
            point, expected = centre.homogeneous, every[centre.links].homogeneous
            assert np.linalg.norm(np.cross(point, expected / np.linalg.norm(expected))) < 1e-10
        assert some.proof.routes < 1e-9
        assert f"{len(some)} centres of {link} of" in remarks(some)[0]
        with pytest.raises(Unknown, match=f"only centres of {link} were computed"):
            some[tuple(name for name in every.numbers if name != link)[:2]]


def test_centres_between_some_links_and_of_no_link(tmp_path):
    state = state_of("four-bar")
    assert [centre.links for centre in centres(state, ["BC", "AD"])] == [("BC", "AD")]
    with pytest.raises(BadInput, match="there is no link of this name"):
        centres(state, "AE")
    listed = json.loads(run(tmp_path, "centres", "four-bar", "--link", "BC", "--json").done())
    assert [centre["name"] for centre in listed["centres"]] == ["I12", "I23", "I24"] and listed["of"] == ["BC"]
    text = run(tmp_path, "centres", "four-bar", "--link", "BC", "--link", "AD").done()
    assert "I24" in text and "I13" not in text and "1 centre of BC and AD of 4 links" in text
    run(tmp_path, "centres", "four-bar", "--link", "BC", "-o", "centres.txt").done()
    written_text = (tmp_path / "centres.txt").read_text()
    assert "I23" in written_text and "I13" not in written_text
    refused = run(tmp_path, "centres", "four-bar", "--link", "BC", "--cycle").refused(2)
    assert "with --cycle name a centre with --of" in refused


def test_centres_of_too_many_links_are_refused_with_what_to_do(tmp_path):
    document = chain.document(1000)
    name = written(tmp_path, document)
    refused = run(tmp_path, "centres", name).refused(2)
    assert refused.startswith("links: instantaneous centres of 1,000 links would take minutes; up to 600 links")
    assert "instantaneous centres of 1,000" in run(tmp_path, "centres", name, "--link", "crank").refused(2)
    assert "1,000 links" in run(tmp_path, "plot", name, "centres", "-o", "a.svg").refused(2)
    assert "a page of 1,000 links" in run(tmp_path, "view", name, "-o", "a.html").refused(2)
    with pytest.raises(BadInput, match="those of one link take seconds: --link frame"):
        centres(planar.from_dict(chain.document(300)))
