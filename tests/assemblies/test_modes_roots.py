"""Every assembly of one group: counts that theory and the literature have, planted examples, and random starts."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import planar
from planar.assemblies.block_roots import block_roots
from planar.assemblies.polynomial.certification import certify_solutions
from planar.assemblies.polynomial.coefficient_family import coefficient_family
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.polynomial.isotropic_form import isotropic_form
from planar.assemblies.polynomial.path_tracker import solve_generic_instance
from planar.document import files
from planar.equations.symbolic_equations import slice_length
from planar.solving.prepared_mechanism import PreparedMechanism
from tests.builders import four_bar_document
from tests.draws import draws, first_cases, part
from tests.inversions import group, listed, missed, one_group, structures, unknowns_of
from tests.linkages import random_linkage

PROVED, NUMERICALLY, NOT = Completeness

SEVEN_LINKS = {14, 16, 18}
"""Assemblies, in complex numbers, of the three Baranov trusses of seven links: N. Rojas, F. Thomas, Distance-based
position analysis of the three seven-link Assur kinematic chains, Mech. Mach. Theory 46, 2011."""

PLATFORMS = {
    0: ([(0.27, -0.46), (-0.92, -0.97), (0.63, 0.83)], [(0.21, 0.46), (0.09, 0.87), (0.63, -0.99)], (1.41, 0.34, 1.25)),
    2: ([(0.38, -0.22), (-0.73, 0.44), (0.05, -0.4)], [(0.0, 0.78), (0.87, -0.28), (0.14, -0.36)], (1.07, 0.74, 0.81)),
    4: ([(0.85, 0.94), (-0.97, 0.73), (0.96, 0.91)], [(-0.7, 0.95), (0.78, 0.64), (-0.04, -0.54)], (1.34, 1.5, 0.65)),
    6: ([(-0.65, 0.73), (0.08, -0.4), (-0.15, -0.9)], [(-0.75, 0.3), (0.29, 0.23), (-0.2, 0.99)], (1.58, 1.19, 1.15)),
}
"""Pins on the frame, pins of a link, legs between them: a triad with so many assemblies."""


def first(value):
    """The roots of the first group of a file's value."""
    setup = PreparedMechanism(files.from_dict(value) if isinstance(value, dict) else value)
    return setup, block_roots(setup, setup.equations.blocks[0], np.zeros(len(setup.equations.unknowns)))


def platform(pins, own, legs):
    links = {
        "frame": {"points": {f"P{k}": list(at) for k, at in enumerate(pins)}},
        "platform": {"points": {f"C{k}": list(at) for k, at in enumerate(own)}},
    }
    links |= {f"leg{k}": {"ends": [f"P{k}", f"C{k}"], "length": leg} for k, leg in enumerate(legs)}
    pairs = [{"turning": name} for k in range(3) for name in (f"P{k}", f"C{k}")]
    return {"planar": 1, "name": "platform", "frame": "frame", "links": links, "pairs": pairs, "sketch": {}}


def by_scanning(pins, own, legs, many=200_001):
    """How often the third leg fits while the platform is turned right round on the other two."""
    pins, own = np.array(pins), np.array(own)
    turn = np.exp(1j * np.linspace(-np.pi, np.pi, many))
    pins, own = pins[:, 0] + 1j * pins[:, 1], own[:, 0] + 1j * own[:, 1]
    count = 0
    # legs 0 and 1 with the platform's own side between them: where C0 can be, on two circles
    centre = pins[1] - turn * (own[1] - own[0])
    apart = np.abs(centre - pins[0])
    along = (legs[0] ** 2 - legs[1] ** 2 + apart**2) / (2.0 * apart)
    height2 = legs[0] ** 2 - along**2
    for sign in (1.0, -1.0):
        C0 = pins[0] + (along + sign * 1j * np.sqrt(np.maximum(height2, 0.0))) * (centre - pins[0]) / apart
        off = np.abs(C0 + turn * (own[2] - own[0]) - pins[2]) - legs[2]
        there = (height2[1:] > 0.0) & (height2[:-1] > 0.0)
        count += int(np.sum(there & (off[1:] * off[:-1] < 0.0)))
    return count


@pytest.mark.parametrize(("name", "many", "expected"), [("four-bar", 2, 2), ("slider-crank", 2, 2)])
def test_dyads_have_two_assemblies_and_it_is_proved(name, many, expected):
    _, found = first(planar.load(name))
    assert (len(found.real), found.expected, found.found, found.complete) == (many, expected, expected, PROVED)
    assert found.certified.all()
    assert not found.double.any()
    assert not found.has_curve


@pytest.mark.parametrize("many", PLATFORMS)
def test_triads_planted_with_none_two_four_and_six_assemblies(many):
    _, found = first(platform(*PLATFORMS[many]))
    assert len(found.real) == many == by_scanning(*PLATFORMS[many])
    assert (found.expected, found.found, found.complete) == (6, 6, PROVED)
    assert found.certified.all()


@pytest.mark.parametrize("name", ["stephenson-3-five-bar", "stephenson-2-six-bar"])
def test_six_bars_of_one_triad_have_six_complex_assemblies(name):
    _, found = first(planar.load(name))
    assert (len(found.real), found.expected, found.found, found.complete) == (4, 6, 6, PROVED)


@pytest.mark.parametrize(("slides", "counts"), [(0, {6}), (1, {6}), (2, {4, 6}), (3, {2, 4})])
def test_triads_with_slides(slides, counts):
    """A slide for a turning pair leaves six; a second one on the same link, and each after it, takes two away."""
    seen = set()
    for joints in structures(4, 1):
        for own in first_cases(combinations(range(6), slides), 7):
            built = group(joints, np.random.default_rng(3), own)
            if not one_group(built.setup, 4):
                continue
            found = block_roots(built.setup, built.setup.equations.blocks[0], np.zeros(4))
            assert found.found == found.expected
            assert found.complete is PROVED or slides == 3
            assert listed(built.setup, found, built.z)
            seen.add(found.expected)
    assert seen == counts


def at_infinity(joints):
    """How many of the C(6, 3) = 20 solutions of three loops stand for none.

    Two for every loop of four links, in one the e of its links vanishing, in the other their 1/e, while for the other
    three links it is the other way round. Two such loops that have one link in common are all seven links, and take the
    same two away.
    """
    joined = {frozenset(end.replace("L1", "frame") for end in joint) for joint in joints}
    links = sorted({link for joint in joined for link in joint})
    loops = []
    for a, b, c, d in combinations(links, 4):
        for ring in ((a, b, c, d), (a, c, b, d), (a, b, d, c)):
            if all(frozenset(two) in joined for two in zip(ring, (*ring[1:], ring[0]), strict=True)):
                loops.append(set(ring))
    twice = sum(len(one | other) == len(links) for one, other in combinations(loops, 2))
    return 2 * (len(loops) - twice)


def test_three_loops_have_their_published_numbers_and_it_is_proved():
    seen = set()
    for joints in structures(6, 10):
        built = group(joints, np.random.default_rng(5))
        found = block_roots(built.setup, built.setup.equations.blocks[0], np.zeros(6))
        assert listed(built.setup, found, built.z)
        if found.complete is PROVED:
            assert found.found == found.expected == 20 - at_infinity(joints)
            seen.add(found.expected)
        else:
            # a triad within a dyad about links that move: six times two
            assert (found.expected, found.complete) == (12, NUMERICALLY)
    assert seen == SEVEN_LINKS


@pytest.mark.parametrize(("name", "expected"), [("double-butterfly", 16), ("double-flier", 14), ("single-flier", 16)])
def test_eight_bars_that_come_along(name, expected):
    _, found = first(planar.load(name))
    assert (found.expected, found.found, found.complete) == (expected, expected, PROVED)
    assert found.certified.all()


def test_four_loops_are_complete_numerically():
    setup, found = first(planar.load("ten-link"))
    assert (found.expected, found.found, found.complete, len(found.real)) == (50, 50, NUMERICALLY, 14)
    assert found.certified.all()
    assert not missed(setup, found, np.random.default_rng(0), 200)


def taken_by_infinity(setup):
    """How many of Bezout's solutions of the first group stand at infinity, by linear algebra alone; None with planes.

    There the products X[k] Y[k] all vanish: X is nothing on some entries, Y on the others. Each such pair of linear
    spaces is a point, which takes one solution, or a line. Lines that cross in nodes, as one curve Z of genus p, take
    c1(E) Z - c1(T) Z + 2 - 2 p: with 2d equations of bidegree (1, 1), on a product of two spaces of dimension d, that
    is d + 1 for each line less two for each crossing (W. Fulton, Intersection Theory, 1998, prop. 9.1.1).
    """
    written = isotropic_form(setup.equations, setup.equations.blocks[0])
    A = written.polynomials(np.zeros(len(setup.equations.unknowns)), setup.inputs.u, setup.inputs.p).A
    P = np.linalg.svd(A)[2][len(A) :].conj().T
    many, size = P.shape

    def nothing_on(rows):
        """The dimension of what is nothing on these entries, less one, and all entries on which it is nothing."""
        _, values, ways = np.linalg.svd(P[rows])
        left = ways[int(np.sum(values > 1e-9)) :].conj().T
        return left.shape[1] - 1, frozenset(k for k in range(many) if np.abs(P[k] @ left).max(initial=0.0) < 1e-9)

    found = set()
    for mask in range(1, 2**many - 1):
        (x, zero_x), (y, zero_y) = (nothing_on([k for k in range(many) if mask >> k & 1 == way]) for way in (1, 0))
        if min(x, y) >= 0:
            found.add((x, y, zero_x, zero_y))
    whole = [one for one in found if not any(o != one and o[2] <= one[2] and o[3] <= one[3] for o in found)]
    if any(x + y > 1 for x, y, *_ in whole):
        return None
    lines = [one for one in whole if one[0] + one[1] == 1]
    crossings = sum(
        one[0] == other[1] == 1 and one[2] <= other[2] and other[3] <= one[3] for one in lines for other in lines
    )
    return len(whole) - len(lines) + size * len(lines) - 2 * crossings


def test_what_is_followed_of_four_loops_agrees_with_what_stands_at_infinity():
    built = group(structures(8, 1)[0], np.random.default_rng(1))
    for setup, count in first_cases([(built.setup, 48), (PreparedMechanism(planar.load("ten-link")), 50)]):
        found = block_roots(setup, setup.equations.blocks[0], np.zeros(8), certify=False)
        assert found.expected == found.found == 70 - taken_by_infinity(setup) == count


@pytest.mark.parametrize(("links", "count", "each"), [(4, 10, draws(5)), (6, 15, draws(3))])
def test_random_starts_never_find_an_assembly_that_is_not_listed(links, count, each):
    """Inversions of six-bar and eight-bar linkages whose crank drives one triad, or one larger group."""
    rng = np.random.default_rng(17)
    for joints in first_cases(structures(links, count), 4):
        for _ in range(each):
            built = group(joints, rng)
            found = block_roots(built.setup, built.setup.equations.blocks[0], np.zeros(links), certify=False)
            assert found.complete is NUMERICALLY
            assert listed(built.setup, found, built.z)
            assert not missed(built.setup, found, rng, 20)


@pytest.mark.parametrize("seed", part(range(40), 3))
def test_the_assembly_that_built_a_random_linkage_is_listed(seed):
    built = random_linkage(seed, 1 + seed % 12, 0.0, 0.2 * (seed % 2))
    setup = PreparedMechanism(files.from_dict(built.value))
    e, z = setup.equations, unknowns_of(setup, built)
    for stage in e.blocks:
        if stage.is_free or slice_length(stage.unknowns) > 8:
            continue
        found = block_roots(setup, stage, z)
        angles = np.array([e.coordinates[c].kind.value != "length" for c in e.unknowns[stage.unknowns]], dtype=bool)
        own = z[stage.unknowns]
        apart = np.where(angles, np.abs(np.exp(1j * found.real) - np.exp(1j * own)), np.abs(found.real - own))
        assert found.has_curve or np.any(np.all(apart < 1e-6, axis=1))


def test_a_kite_folded_on_itself_is_a_curve_of_assemblies():
    value = four_bar_document(1, 0.6, 0.6, 1, 0.0, pins="OABQ", omega=None, sketch={"B": [0.7, 0.4]})
    _, found = first(value)
    assert found.has_curve
    assert found.complete is not PROVED
    _, apart = first(value | {"inputs": [{"pair": "O", "position": 0.3}]})
    assert not apart.has_curve
    assert (len(apart.real), apart.complete) == (2, PROVED)


def test_of_two_curves_of_assemblies_one_place_each_is_listed():
    """Legs pinned at one point of the frame and to three points of a line: with it they turn right round as one, the
    point on this side of the line or on that."""
    own = [(-1.0, 0.0), (0.2, 0.0), (0.9, 0.0)]
    setup, found = first(platform([(0.0, 0.0)] * 3, own, [float(np.hypot(x, 0.7)) for x, _ in own]))
    assert found.has_curve
    assert found.complete is NOT
    assert not found.double.any()
    column = [setup.equations.coordinates[c].owner for c in setup.equations.unknowns].index("leg0")
    angle = [setup.equations.coordinates[c].owner for c in setup.equations.unknowns].index("platform")
    sides = {float(np.sign(np.sin(root[angle] - root[column]))) for root in found.real}
    assert len(found.real) == 2
    assert sides == {1.0, -1.0}


def test_at_a_dead_point_two_assemblies_are_one_that_counts_double():
    sketch = {"B": [0.75, 0]}
    value = four_bar_document(0.5, 1.25, 1.75, 2.5, np.pi, pins="OABQ", omega=None, sketch=sketch)
    _, found = first(value)
    assert len(found.real) == 1
    assert found.double.all()
    assert (found.expected, found.found) == (2, 2)
    assert found.complete is NUMERICALLY
    assert not found.certified.any()
    np.testing.assert_allclose(np.exp(1j * found.real), [[1.0, -1.0]], atol=1e-6)


def test_a_triad_at_a_dead_point_has_a_double_assembly_among_others():
    """The legs of a platform put in lines through one point: its place there is a double one."""
    pins, own, _ = PLATFORMS[6]
    own = np.array(own)
    pole, place = np.array([0.3, -0.2]), np.array([0.1, 0.25])
    ends = own + place
    pins = pole + (pole - ends) * np.array([[0.4], [0.7], [-0.6]])
    _, found = first(platform(pins.tolist(), own.tolist(), np.linalg.norm(ends - pins, axis=1).tolist()))
    assert found.double.sum() == 1
    assert found.complete is NUMERICALLY
    assert (found.expected, found.found) == (6, 6)
    assert len(found.real) % 2 == 1


@pytest.mark.parametrize(("first_leg", "second_leg"), first_cases([(0.4, 0.7), (-0.4, 0.3), (0.9, 0.2)], 2))
def test_where_three_assemblies_of_a_triad_meet_they_are_one_found_to_the_cube_root_of_rounding(first_leg, second_leg):
    """Legs in lines through one point, and so long that the platform's way off is closed to second order too.

    With r from that point and legs (1 + l) r, the ends turn about it and shift by a: (1 + l) r.a = -l r.r for all.
    """
    own = np.array(PLATFORMS[6][1])
    pole, ends = np.array([0.3, -0.2]), own + np.array([0.1, 0.25])
    r = ends - pole
    legs = [first_leg, second_leg, 0.0]

    def closing(third):
        factors = np.array([*legs[:2], third])[:, None]
        return np.linalg.det(np.hstack([(1.0 + factors) * r, factors * np.sum(r * r, axis=1, keepdims=True)]))

    legs[2] = closing(0.0) / (closing(0.0) - closing(1.0))  # linear in it
    pins = pole - r * np.array(legs)[:, None]
    setup, found = first(platform(pins.tolist(), own.tolist(), np.linalg.norm(ends - pins, axis=1).tolist()))
    assert (found.expected, found.found, found.complete) == (6, 6, NUMERICALLY)
    assert found.double.sum() == 1
    e = setup.equations
    platforms = [e.coordinates[column].owner for column in e.unknowns].index("platform")
    # turned by phi, and moved by phi^2 a as the second order asks, the squares of the legs are off by c phi^3 along
    # n, which no move mends; they are rounded by the last digits of twice their length times the largest coordinate
    arms, lengths = (1.0 + np.array(legs))[:, None] * r, np.linalg.norm(ends - pins, axis=1)
    a = np.linalg.lstsq(2.0 * arms, np.array(legs) * np.sum(r * r, axis=1), rcond=None)[0]
    n = np.linalg.svd(arms.T)[2][-1]
    c = abs(n @ (2.0 * np.stack([-r[:, 1], r[:, 0]], axis=1) @ a))
    rounded = 4.0 * np.finfo(float).eps * np.abs(n) @ (2.0 * lengths * np.abs(pins).max())
    assert abs(found.real[found.double][0, platforms]) <= (rounded / c) ** (1.0 / 3.0)


def test_redundant_cranks_stand_in_one_way_only():
    _, found = first(planar.load("three-parallel-cranks"))
    assert (len(found.real), found.complete) == (1, NUMERICALLY)
    assert not found.certified.any()


def test_without_ball_arithmetic_nothing_is_said_to_be_proved(monkeypatch):
    monkeypatch.setattr("planar.assemblies.block_roots.is_available", lambda: False)
    for name, many in (("stephenson-3-five-bar", 4), ("scotch-yoke", 1)):
        _, found = first(planar.load(name))
        assert (len(found.real), found.complete) == (many, NUMERICALLY)
        assert not found.certified.any()


def test_linear_groups_have_one_assembly():
    _, found = first(planar.load("scotch-yoke"))
    assert (len(found.real), found.expected, found.complete) == (1, 1, PROVED)


def test_groups_that_are_no_such_polynomials_are_searched_and_said_to_be():
    _, found = first(planar.load("rack-differential"))
    assert len(found.real) >= 1
    assert (found.complete, found.expected) == (NOT, None)
    assert "starts only" in found.method


def test_a_random_linkage_of_a_structure_has_as_many_solutions_whichever_it_is():
    setup = PreparedMechanism(planar.load("double-flier"))
    written = isotropic_form(setup.equations, setup.equations.blocks[0])
    drawn = coefficient_family(
        setup.equations, written, np.zeros(written.entry_count * len(written.combined), dtype=bool)
    ).draw_member
    counts = {
        (len(each.V), each.finite) for each in (solve_generic_instance(written, drawn, seed) for seed in (1, 2, 3))
    }
    assert counts == {(20, 14)}


def test_what_is_no_solution_is_not_certified():
    setup = PreparedMechanism(planar.load("stephenson-3-five-bar"))
    stage = setup.equations.blocks[0]
    written = isotropic_form(setup.equations, stage)
    z, u, p = np.zeros(4), setup.inputs.u, setup.inputs.p
    unit = np.exp(1j * block_roots(setup, stage, z).real)
    one = np.ones((len(unit), 1))
    V = np.concatenate([one, unit, one, 1.0 / unit], axis=1)
    found = certify_solutions(written, (z, u, p), V)
    assert found.proved.all()
    assert found.real.all()
    # moved by less than drawings show, it is refused; twice the same is not two
    assert not certify_solutions(written, (z, u, p), V * np.exp(1j * np.linspace(0.0, 1e-5, 10))).proved.any()
    assert certify_solutions(written, (z, u, p), V[[0, 0]]).proved.sum() == 1
