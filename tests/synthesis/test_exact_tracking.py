"""Seeds that are linkages, paths between many members, decimals of the file, and a second route to all solutions."""

import json
from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest

import planar
from planar.assemblies.polynomial.path_tracker import normalize, track_paths
from planar.codegen.complex_kernel import ComplexKernel
from planar.codegen.formula_kernel import LANES
from planar.synthesis.exact import exact_synthesis
from planar.synthesis.exact.relations.exact_numbers import exact_number
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.tracking import member_solutions
from planar.synthesis.exact.tracking.ball_paths import certify_member
from planar.synthesis.exact.tracking.first_solution import first_solution
from planar.synthesis.exact.tracking.generic_solutions import family_record, find_generic_solutions, follow
from planar.synthesis.exact.tracking.member_homotopy import (
    EdgeHomotopy,
    affine_solutions,
    first_of_same,
    homogeneous_slopes,
    scaled_rows,
)
from planar.synthesis.exact.tracking.member_solutions import solve_member
from planar.synthesis.task.starts import start_mechanisms
from tests.command import run
from tests.exact_tasks import family_of, five_poses, task, with_points_on_coupler

PAIRS = {"from": "A", "to": "D", "pairs": [[0, 0], [25, 14], [50, 33], [70, 51], [90, 75]]}


def offset_slider_crank():
    """A slider-crank whose rod is written by points along its axes, three of its numbers sought."""
    start = {
        "planar": 1,
        "units": {"length": "m", "angle": "rad"},
        "frame": "f",
        "links": {
            "f": {"points": {"O": [-0.0184, -0.1406], "G": [0, 0.2544]}},
            "c": {"ends": ["O", "A"], "length": 0.5958},
            "rod": {"points": {"A": [0, 0], "B": [1.358, 0], "P": [-0.0514, 0.7779]}},
            "p": {"points": {"B": [0, 0]}},
        },
        "pairs": [
            *({"turning": pin} for pin in "OAB"),
            {"sliding": "s", "links": ["f", "p"], "line": {"through": "G", "angle": 0}, "point": "B"},
        ],
        "inputs": [{"pair": "O", "position": -0.49, "velocity": 1}],
        "sketch": {"B": [1.687, 0.2544]},
    }
    wanted = {"point": "P", "through": [[0.033, 0.239], [0.139, 0.385], [0.29, 0.667]]}
    return task(start, wanted, free=["c.length", "rod.B.x", "rod.P.x"], units={"length": "m", "angle": "rad"})


FAMILIES = [
    pytest.param(task(with_points_on_coupler(), five_poses()), 4, id="five poses"),
    pytest.param(task("four-bar", PAIRS), 3, id="five pairs"),
]


def test_a_first_solution_is_a_linkage_and_its_kind_has_more_than_the_degenerate_one():
    component = family_of(offset_slider_crank())
    member, x = first_solution(component.family, np.random.default_rng(1))
    still = [np.zeros_like(each) for each in member.parts]
    f, slope, _ = component.family.rows_at(x[:, None], member, still, np.zeros(1))
    assert (np.abs(f[:, 0]) < 1e-9 * np.abs(slope[..., 0]).sum(axis=1)).all()
    assert len(find_generic_solutions(component.family, enough=3).V) >= 3  # isotropic directions have one


@pytest.mark.parametrize(("value", "count"), FAMILIES)
def test_paths_of_several_edges_side_by_side_end_where_those_of_each_do(value, count):
    family = family_of(value).family
    known = family_record(family).solutions
    others = [family.random_member(np.random.default_rng(seed)) for seed in (1, 2)]
    V = np.concatenate([known.V, known.V])
    edges = np.repeat([[0, 1], [0, 2]], count, axis=0)
    ends = track_paths(EdgeHomotopy(family, [known.member, *others], edges), V)
    for k, other in enumerate(others):
        alone = follow(family, known.member, known.V, other, 1e-4)
        both = affine_solutions(ends.V[k * count : (k + 1) * count])
        np.testing.assert_allclose(both, affine_solutions(alone.V), rtol=1e-9)


def test_machine_code_of_complex_rows_computes_what_numpy_does():
    rows = family_of(task("four-bar", PAIRS)).family.parts[1].rows
    kernel: ComplexKernel = rows._kernel
    rng = np.random.default_rng(0)
    operands = rng.normal(size=(len(kernel.operands), 3 * LANES)) + 1j * rng.normal(
        size=(len(kernel.operands), 3 * LANES)
    )
    np.testing.assert_allclose(kernel(operands), kernel.in_numpy(operands), rtol=1e-10)
    more = kernel(operands.astype(np.clongdouble))
    assert more.dtype == np.clongdouble


class ProductStart:
    """From products of linear forms in places and in conjugates, as many of each as a row has degree, to a member."""

    def __init__(self, family, member, rng):
        self.family, self.member = family, member
        self.degrees = [self.row_degrees(side, rng) for side in (0, 1)]
        n = family.size
        shape = (family.row_count, n + 1)
        self.forms = [
            [[rng.normal(size=n + 1) + 1j * rng.normal(size=n + 1) for _ in range(degree)] for degree in of]
            for of in self.degrees
        ]
        self.turn = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, shape[0]))

    def rows(self, x):
        still = [np.zeros_like(each) for each in self.member.parts]
        return self.family.rows_at(x, self.member, still, np.zeros(x.shape[1]))[:2]

    def row_degrees(self, side, rng):
        """Degrees of the rows in places or in conjugates, by how they grow."""
        n = self.family.size
        x = rng.normal(size=2 * n) + 1j * rng.normal(size=2 * n)
        far = np.array([x, x])
        far[0, side * n : (side + 1) * n] *= 1e5
        far[1, side * n : (side + 1) * n] *= 1e6
        f = np.abs(self.rows(far.T.copy())[0])
        return np.rint(np.log10(f[:, 1] / f[:, 0])).astype(int)

    def starts(self):
        n, count = self.family.size, self.family.row_count
        found = []
        for chosen in combinations(range(count), n):
            sides = [0 if k in chosen else 1 for k in range(count)]
            for picks in product(*(range(self.degrees[side][k]) for k, side in enumerate(sides))):
                halves = []
                for side in (0, 1):
                    forms = [self.forms[side][k][picks[k]] for k in range(count) if sides[k] == side]
                    halves.append(np.linalg.svd(np.array(forms))[2][-1].conj())
                found.append(np.concatenate(halves))
        return np.array(found)

    def __call__(self, V, way):
        n = self.family.size
        x = affine_solutions(V).T.copy()
        f, slope = self.rows(x)
        g, h = np.empty_like(f), np.zeros_like(slope)
        for k in range(self.family.row_count):
            values, slopes = [], []
            for side in (0, 1):
                for form in self.forms[side][k]:
                    own = slice(side * n, (side + 1) * n)
                    gradient = np.zeros(2 * n, dtype=complex)
                    gradient[own] = form[1:]
                    values.append(form[0] + form[1:] @ x[own])
                    slopes.append(gradient)
            g[k] = self.turn[k] * np.prod(values, axis=0)
            for j, gradient in enumerate(slopes):
                others = np.prod([v for i, v in enumerate(values) if i != j], axis=0)
                h[k] += self.turn[k] * gradient[:, None] * others
        total = way * slope + (1.0 - way) * h
        return scaled_rows(way * f + (1.0 - way) * g, homogeneous_slopes(total, V), f - g)


@pytest.mark.parametrize(("value", "count"), FAMILIES)
def test_a_multihomogeneous_start_leads_to_the_same_solutions(value, count):
    component = family_of(value)
    member = component.family.random_member(np.random.default_rng(4))
    known = solve_member(component.family, family_record(component.family), member).x
    homotopy = ProductStart(component.family, member, np.random.default_rng(5))
    ends = track_paths(homotopy, normalize(homotopy.starts()), 1e-3, 1e-6, 400)
    V = ends.V[ends.is_single]
    x = affine_solutions(V[first_of_same(V) == np.arange(len(V))])
    x = x[np.abs(x).max(axis=1) < 1e4]
    assert len(known) == count
    assert all((np.abs(x - each).max(axis=1) < 1e-6 * np.abs(each).max()).any() for each in known)
    others = [each for each in x if np.abs(known - each).max(axis=1).min() > 1e-6 * np.abs(each).max()]
    pivots = member.parts[0][0, :, :].T.ravel()  # cranks of no length do any function
    assert len(others) == count % 2 and all(np.abs(each - pivots).max() < 1e-8 for each in others)


def test_decimals_of_a_file_are_the_same_in_every_unit():
    places = [["0.5", "1.06"], ["-0.83", "-0.27"], ["-0.34", "0.22"], ["-0.13", "0.43"], ["0.22", "0.78"]]
    exact = []
    for unit, power in (("m", 0), ("cm", 2), ("mm", 3)):
        through = [[float(Fraction(each) * 10**power) for each in place] for place in places]
        value = task("four-bar", {"point": "E", "through": through}, units={"length": unit, "angle": "deg"})
        read = planar.read_task(value | {"free": ["AB.length", "BC.length", "BC.E", "DC.length"]})
        scale = ExactProblem(read, next(iter(start_mechanisms(read)))).exact_scale
        exact.append([exact_number(complex(*place), scale.lengths) for place in read.wanted[0].places])
    assert exact[0] == exact[1] == exact[2]
    assert [each.imaginary - each.real for each in exact[0]] == [Fraction(14, 25)] * 5  # on one line


def test_degrees_are_rational_multiples_of_pi():
    component = family_of(task("four-bar", PAIRS))
    assert component.member.exact[1][0][0].pi_multiple == Fraction(25, 180)


def test_certificates_are_of_the_numbers_of_the_file():
    component = family_of(task("four-bar", PAIRS))
    known = solve_member(component.family, family_record(component.family), component.member).x
    exact = [[*entry] for entry in component.member.exact[1]]
    moved = exact[0][0]._replace(pi_multiple=exact[0][0].pi_multiple + Fraction(1, 10**6))
    other = component.member._replace(exact=(component.member.exact[0], [[moved, *exact[0][1:]], *exact[1:]]))
    for member, least, most in ((component.member, 0.0, 1e-9), (other, 1e-8, 1e-1)):
        proof = certify_member(component.family, member, known)
        assert proof.proved.all()
        assert least <= np.abs(proof.x - known).max() / np.abs(known).max() <= most


def with_untested_record(monkeypatch, tested):
    known = member_solutions.family_record
    monkeypatch.setattr(
        member_solutions, "family_record", lambda *given: known(*given)._replace(is_traced=False, is_tested=False)
    )
    monkeypatch.setattr(member_solutions, "tested_record", tested)


def test_designs_come_before_the_test_that_they_are_all(monkeypatch):
    def traced(_, record):
        reported.append("trace test")
        monkeypatch.setattr(
            member_solutions, "family_record", lambda *_: record._replace(is_traced=True, is_tested=True)
        )
        return record

    reported = []
    with_untested_record(monkeypatch, traced)
    found = planar.synthesise(
        task("four-bar", PAIRS), complete=True, progress=lambda done: done.result and reported.append(done.result)
    )
    first, second = reported
    assert second == "trace test" and first.designs == found.designs and len(found)
    assert "not made yet" in first.complete and found.complete == "numerically complete" and found.is_finished


def test_an_interrupted_test_leaves_the_designs_and_says_so(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    with_untested_record(monkeypatch, interrupted)
    found = planar.synthesise(task("four-bar", PAIRS), complete=True)
    assert len(found) and not found.is_finished and "not made yet" in found.complete
    (tmp_path / "throw.json").write_text(json.dumps(task("four-bar", PAIRS)))
    ended = run(tmp_path, "synthesise", "throw.json", "--complete")
    assert ended.status == 130 and "Dimensions" in ended.out
    assert "not that there are no others" in ended.err


def test_what_is_nearly_at_infinity_stands_last(monkeypatch):
    def far(components, say):
        (one,) = member_solutions.solve_components(components, say)
        x = one.x.copy()
        x[0] *= 2e4
        return [one._replace(x=x)]

    value = task("four-bar", PAIRS)
    plain = planar.synthesise(value, complete=True)
    monkeypatch.setattr(exact_synthesis, "solve_components", far)
    found = planar.synthesise(value, complete=True)
    assert len(found) == len(plain)
    assert max(found[-1].numbers.values()) > 1e3 * max(plain[-1].numbers.values())
    assert any("nearly at infinity" in each for each in found.remarks)
