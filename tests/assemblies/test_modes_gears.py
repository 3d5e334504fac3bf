"""Every assembly of groups in which gears tie angles: counts by closed forms, and what starts find."""

import json
from math import gcd

import numpy as np
import pytest

import planar
from planar.assemblies.block_roots import block_roots
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.polynomial.gear_powers import gear_powers
from planar.assemblies.polynomial.isotropic_form import isotropic_form
from planar.document import files
from planar.equations.symbolic_equations import slice_length
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.prepared_mechanism import PreparedMechanism
from tests.draws import first_cases, is_exhaustive
from tests.inversions import unknowns_of
from tests.linkages import Built, random_linkage

GROUND, FIRST, SECOND, RODS = 150.0, 40.0, 30.0, (130.0, 110.0)
MESH = np.radians([60.0, 100.0])


def geared_five_bar(wheels: dict, at: float) -> planar.Mechanism:
    """The geared five-bar, driven where its rods meet: the angle between them is given, so the way from A to B."""
    value = json.loads(planar.dumps(planar.load("geared-five-bar")))
    own = next(k for k, pair in enumerate(value["pairs"]) if "gear" in pair)
    value["pairs"][own] = wheels | {"links": ["OA", "QB"], "mesh": {"OA": 60, "QB": 100}}
    value["inputs"] = [{"pair": "C", "position": at, "velocity": "1 rpm"}]
    return planar.from_dict(value)


def by_scanning(ratio: float, turns: int, apart: float, many: int = 400_001) -> int:
    """How often A and B are so far apart while the first crank makes so many turns, after which all is as before."""
    first = np.linspace(0.0, 2.0 * np.pi * turns, many) + 0.123
    second = MESH[1] + ratio * (first - MESH[0])
    off = np.abs(GROUND + SECOND * np.exp(1j * second) - FIRST * np.exp(1j * first)) - apart
    return int(np.sum(off[1:] * off[:-1] < 0.0))


@pytest.mark.parametrize(
    ("wheels", "p", "q"),
    first_cases(
        [
            ({"gear": "w", "teeth": [20, 20]}, -1, 1),
            ({"gear": "w", "teeth": [20, 40]}, -1, 2),
            ({"chain": "w", "ratio": 1.5}, 3, 2),
            ({"gear": "w", "teeth": [30, 20]}, -3, 2),
            ({"chain": "w", "ratio": 3}, 3, 1),
        ],
        3,
    ),
)
def test_a_geared_five_bar_has_as_many_as_the_degree_of_its_closing_says(wheels, p, q):
    """With angles q phi and p phi the square of the way from A to B is of degree max(|p|, q, |p - q|) in exp(i phi)."""
    assert gcd(p, q) == 1
    for at in (80.0, 100.0):
        setup = PreparedMechanism(geared_five_bar(wheels, at))
        (stage,) = setup.equations.blocks
        found = block_roots(setup, stage, np.zeros(2))
        assert found.expected == found.found == 2 * max(abs(p), q, abs(p - q))
        assert found.complete in (Completeness.PROVED, Completeness.NUMERICALLY)
        assert found.certified.all()
        apart = abs(RODS[0] - RODS[1] * np.exp(1j * np.radians(at)))
        assert len(found.real) == by_scanning(p / q, q, apart)


def test_a_geared_five_bar_of_equal_wheels_is_complete():
    assert planar.modes(geared_five_bar({"gear": "w", "teeth": [20, 20]}, 100.0)).complete is Completeness.PROVED


def test_a_ratio_that_is_no_float_is_counted_and_not_certified():
    modes = planar.modes(geared_five_bar({"chain": "w", "teeth": [40, 30]}, 100.0))
    assert [(group.expected, group.complete) for group in modes.groups] == [(8, Completeness.NUMERICALLY)]
    assert not any(mode.certified for mode in modes)
    assert any("no float" in sentence for sentence in modes.remarks)


def test_where_gears_make_the_count_huge_the_bound_is_said():
    (group,) = planar.modes(geared_five_bar({"gear": "w", "teeth": [31, 20]}, 100.0)).groups
    assert group.complete is Completeness.NOT
    assert "up to 48620 complex ones" in group.method


def test_ratios_that_are_not_rational_are_searched_by_starts():
    (group,) = planar.modes(geared_five_bar({"gear": "w", "ratio": -np.sqrt(2.0)}, 100.0)).groups
    assert (group.complete, group.expected) == (Completeness.NOT, None)


def test_least_angles_keep_every_direction():
    rates = np.array([[1.0, 0.0], [0.0, 1.0], [1.5, -0.5]])
    tied = gear_powers(rates, np.zeros((0, 2)))
    rng = np.random.default_rng(0)
    for _ in range(50):
        angles = rng.uniform(-40.0, 40.0, 2)
        least = tied.least_angles(angles)
        assert np.exp(1j * rates @ least) == pytest.approx(np.exp(1j * rates @ angles))
        assert np.abs(least).sum() < 2.0 * np.pi * 2.0


def with_whole_ratios(built: Built, seed: int) -> dict | None:
    """The file of a linkage with ratios of small numbers, its wheels meshed as it was built; None without any."""
    rng, there = np.random.default_rng(seed), False
    value = json.loads(json.dumps(built.value))
    angle = {name: frame.angle for name, frame in built.frames.items()} | {value["frame"]: 0.0}
    for pair in value["pairs"]:
        if "carrier" in pair and "mesh" in pair:
            there = True
            pair["ratio"] = float(rng.choice([-2.0, -1.0, -0.5, 0.5, 1.0, 1.5, 2.0]))
            pair["mesh"] = {link: angle[link] - angle[pair["carrier"]] for link in pair["links"]}
    return value if there else None


def test_of_random_geared_linkages_the_assembly_that_was_built_and_all_that_starts_find_are_listed():
    compared = between = 0
    for seed in first_cases((13, 113, 499, 11, 41, 137, 185, 190, 292), 3):
        built = random_linkage(seed, 2 + seed % 6, 0.5, 0.1)
        setup = PreparedMechanism(files.from_dict(with_whole_ratios(built, seed)))
        z, e = unknowns_of(setup, built), setup.equations
        for stage in e.blocks:
            written = None if slice_length(stage.unknowns) > 4 else isotropic_form(e, stage, setup.inputs.p)
            if (
                written is None
                or written.gears.powers == written.gears.angles_from_new.shape[0]
                or written.bezout_number > 100
            ):
                continue
            found = block_roots(setup, stage, z, certify=False)
            assert found.complete is Completeness.NUMERICALLY
            angles = np.array([e.coordinates[c].kind.value != "length" for c in e.unknowns[stage.unknowns]])
            starts = [each.z[stage.unknowns] for each in BlockAssemblies(setup).from_all_starts(stage, z)]
            for own in (z[stage.unknowns], *starts):
                gaps = np.where(angles, np.abs(np.exp(1j * found.real) - np.exp(1j * own)), np.abs(found.real - own))
                assert gaps.max(axis=1).min() < 1e-6
            compared += 1
            between += any(row.kind.value == "turns" for row in e.rows[stage.rows])
    assert compared >= (6 if is_exhaustive() else 2)
    assert between >= (2 if is_exhaustive() else 1)  # groups with rows between angles alone
