"""Complete lists against closed forms, published numbers, and the linkages that made the tasks."""

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import planar
from benchmarks.exact_makers import KINDS
from planar.foundation.jets import value_and_rates
from planar.reports.tables.design.synthesis import table
from planar.synthesis.exact import exact_synthesis
from planar.synthesis.exact.exact_linkage import evaluate
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.relations.polynomials import Polynomial
from planar.synthesis.exact.tracking import ball_paths, generic_solutions, member_solutions
from planar.synthesis.exact.tracking.ball_paths import certify_member, follow_in_balls
from planar.synthesis.exact.tracking.family_names import name_family
from planar.synthesis.exact.tracking.generic_solutions import family_record, find_generic_solutions, follow, trace_test
from planar.synthesis.exact.tracking.member_homotopy import (
    affine_solutions,
    bilinear_roots,
    exchange_images,
    first_of_same,
    homogeneous_solutions,
    representatives,
)
from planar.synthesis.exact.tracking.member_solutions import (
    ClassedSolutions,
    is_nearly_singular,
    solve_member,
    with_ball_paths,
    with_doubtful,
    with_members,
)
from planar.synthesis.task.starts import start_mechanisms
from tests.command import run
from tests.exact_tasks import POSES, family_of, five_poses, poses, task, with_points_on_coupler
from tests.remembered import remembered


@pytest.fixture(scope="module", autouse=True)
def computed_once():
    """A list that several tests look at is computed once, and so is a path in balls from one solution."""
    with pytest.MonkeyPatch.context() as patch:
        lists = remembered(exact_synthesis.synthesise_all, lambda task, *_: json.dumps(planar.write_task(task)))
        patch.setattr(exact_synthesis, "synthesise_all", lists)
        patch.setattr(ball_paths, "_follow_path", remembered(ball_paths._follow_path))
        yield


@pytest.fixture(autouse=True)
def few_designs(monkeypatch):
    monkeypatch.setattr("planar.synthesis.exact.exact_synthesis.FAMILY_DESIGNS", 1)


def carried(place, number):
    """Where a place at the first pose is at another one (m)."""
    first, other = (np.array(POSES[k][:2]) * 1e-3 for k in (0, number))
    angle = np.radians(POSES[number][2] - POSES[0][2])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return other + (place - first) @ turn.T


def frame_parts(motion, link):
    frame = motion.frames[link]
    return [np.asarray(value_and_rates(getattr(frame, part))[0]) for part in ("x", "y", "angle")]


def test_the_linkage_that_made_five_poses_is_among_the_six_that_do_them():
    maker = planar.from_dict(with_points_on_coupler())
    motion = planar.cycle(maker, 60)
    x, y, angle = frame_parts(motion, "BC")
    rows = [4, 11, 20, 27, 35]
    wanted = {
        "link": "BC",
        "poses": [{"at": [1e3 * x[k], 1e3 * y[k]], "angle": float(np.degrees(angle[k]))} for k in rows],
    }
    found = planar.synthesise(task(with_points_on_coupler(), wanted), complete=True)
    assert (found.expected, found.found, found.complete) == (6, 6, "numerically complete")
    assert len(found) in (0, 1, 6) and all(each.certified for each in found)
    pivots = [
        {(round(each["AD.A.x"], 7), round(each["AD.D.x"], 7)) for each in (planar.dimensions(one.mechanism),)}
        for one in found
    ]
    assert {(0.0, 0.1)} in pivots or {(0.1, 0.0)} in pivots
    for design in found:
        if design.defects:
            continue
        assert design.greatest_miss < 1e-10
        for at, k in zip(design.inputs[0], rows, strict=True):  # by the general path, from the file
            state = planar.solve(planar.loads(planar.dumps(design.mechanism)), {"A": float(at)})
            own = [float(value_and_rates(getattr(state.frames["BC"], part))[0]) for part in ("x", "y", "angle")]
            np.testing.assert_allclose(own[:2], [x[k], y[k]], atol=1e-9)
            assert np.cos(own[2] - angle[k]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_dyads_by_eigenvalues_are_those_that_paths_lead_to(seed):
    component = family_of(task(with_points_on_coupler(), five_poses()))
    member = component.family.random_member(np.random.default_rng(seed)) if seed else component.member
    tracked = solve_member(component.family, family_record(component.family), member).x
    direct = bilinear_roots(component.family, member, len(tracked))
    assert direct is not None and len(direct) == 4
    sizes = np.abs(tracked).max(axis=1)
    assert all(
        (np.abs(direct - each).max(axis=1) < 1e-8 * size).any() for each, size in zip(tracked, sizes, strict=True)
    )
    assert bilinear_roots(component.family, member, 3) is None


def test_rows_of_another_kind_have_no_such_closed_form():
    component = family_of(
        task("four-bar", {"from": "A", "to": "D", "pairs": [[0, 0], [25, 14], [50, 33], [70, 51], [90, 75]]})
    )
    assert bilinear_roots(component.family, component.member, 1) is None


def test_burmesters_curves_keep_their_distances_and_close():
    curves = planar.synthesise(task(with_points_on_coupler(), poses(4)), complete=True).curves
    assert [(each.pivot, each.joint, each.dimension) for each in curves] == [("A", "B", 1), ("D", "C", 1)]
    known = np.isfinite(curves[0].circle_points).all(axis=1)
    joints, pivots = curves[0].circle_points[known], curves[0].centre_points[known]
    assert known.sum() > 500
    distances = [np.linalg.norm(carried(joints, k) - pivots, axis=1) for k in range(4)]
    np.testing.assert_allclose(distances, np.broadcast_to(distances[0], (4, len(joints))), atol=1e-11)


def test_three_poses_leave_every_joint_the_centre_of_its_circle():
    found = planar.synthesise(task(with_points_on_coupler(), poses(3)), complete=True)
    joint = np.array([0.012, -0.031])
    a, b, c = (carried(joint, k) for k in range(3))
    matrix, right = 2.0 * np.array([b - a, c - a]), np.array([b @ b - a @ a, c @ c - a @ a])
    assert found.curves[0].dimension == 2 and found.expected is None and len(found) == 1
    np.testing.assert_allclose(found.curves[0].centres(joint)[0], np.linalg.solve(matrix, right), atol=1e-13)


def test_four_poses_leave_one_slide_whose_joint_stays_on_a_line():
    start = planar.to_dict(planar.load("offset-slider-crank"))
    start["links"]["rod"] = {"points": {"A": [0, 0], "B": [200, 0]}}
    wanted = poses(4) | {"link": "rod"}
    single = planar.synthesise(task(start, wanted), complete=True).curves[1]
    assert (single.pivot, single.joint, single.dimension) == ("stroke", "B", 0)
    places = np.array([carried(single.circle_points[0], k) for k in range(4)])
    assert np.linalg.svd(places - places.mean(axis=0))[1][1] < 1e-12


def test_three_pairs_with_their_zeros_are_freudensteins():
    """F. Freudenstein, Trans. ASME 77, 1955: K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi)."""
    pairs = np.array([[20.0, 50.0], [45.0, 68.0], [80.0, 95.0]])
    wanted = {"from": "A", "to": "D", "pairs": pairs.tolist(), "absolute": True}
    found = planar.synthesise(task("four-bar", wanted), complete=True)
    assert (found.expected, found.found, len(found), found[0].certified) == (1, 1, 1, True)
    phi, psi = np.radians(pairs).T
    k = np.linalg.solve(np.stack([np.cos(psi), -np.cos(phi), np.ones(3)], axis=1), np.cos(phi - psi))
    numbers = planar.dimensions(found[0].mechanism)
    d = numbers["AD.D.x"]
    # a link whose length is below zero is written by its points
    a, b, c = (numbers.get(f"{link}.length", numbers.get(f"{link}.{link[1]}.x")) for link in ("AB", "BC", "DC"))
    np.testing.assert_allclose([d / a, d / c], k[:2], rtol=1e-9)
    assert (a * a - b * b + c * c + d * d) / (2 * a * c) == pytest.approx(k[2], rel=1e-9)
    assert found[0].greatest_miss < 1e-12 and found[0].opposite == tuple(
        link for link, length in (("AB", a), ("DC", c)) if length < 0.0
    )
    assert sum("drawn the opposite way" in each for each in found.remarks) == len(found[0].opposite) > 0


def test_five_pairs_have_three_four_bars():
    motion = planar.cycle("four-bar", 48)
    rows = [3, 10, 17, 25, 31]
    phi, psi = np.degrees(motion.inputs["A"].position), np.degrees(motion.link("DC").angle)
    wanted = {"from": "A", "to": "D", "pairs": [[float(phi[k]), float(psi[k])] for k in rows]}
    found = planar.synthesise(task("four-bar", wanted), complete=True)
    assert (found.expected, found.found, found.complete) == (3, 3, "numerically complete")
    lengths = [[planar.dimensions(one.mechanism)[f"{link}.length"] for link in ("AB", "BC", "DC")] for one in found]
    assert np.abs(np.array(lengths) - [0.05, 0.066, 0.056]).max(axis=1).min() < 1e-9


def test_known_members_are_solved_by_all_that_stands_with_them():
    places = [[k * k % 17, 3 * k * k % 19] for k in range(9)]
    nine = family_of(task("four-bar", {"point": "E", "through": places}))
    record = family_record(nine.family)
    assert record.classes.shape == (1442, 3) and not record.is_traced
    assert len(record.name.exchanges) == 2  # either crank may be the first
    x = affine_solutions(record.solutions.V).T.copy()
    still = [np.zeros_like(each) for each in record.solutions.member.parts]
    f, slope, _ = nine.family.rows_at(x, record.solutions.member, still, np.zeros(x.shape[1]))
    size = np.abs(slope * x).sum(axis=1)
    assert (np.abs(f) / size).max() < 1e-8


def test_a_family_is_known_whatever_its_links_are_called():
    places = [[k * k % 17, 3 * k * k % 19] for k in range(9)]
    other = planar.to_dict(planar.load("four-bar"))
    links = other["links"]
    other["links"] = {name: links[name] for name in ("DC", "BC", "AD", "AB")}
    other["pairs"] = other["pairs"][::-1]
    first, second = (family_of(task(start, {"point": "E", "through": places})) for start in ("four-bar", other))
    assert name_family(first.family).text == name_family(second.family).text


def test_the_loops_of_a_six_bar_leave_one_turn_and_vanish_where_it_is():
    """Of a Watt II six-bar the function is that of two four-bars one after the other, whichever loops are closed."""
    rng = np.random.default_rng(2)
    value, wanted, more = KINDS["four pairs of Watt II, two links sought"](rng)
    read = planar.read_task({"planar": 1, "units": value["units"], "start": value, "wanted": wanted} | more)
    problem = ExactProblem(read, next(iter(start_mechanisms(read))))
    (component,) = problem.components
    assert component.freedom == 0
    state = planar.solve(planar.from_dict(value), {"A": wanted[0]["pairs"][0][0]})
    given, x = problem.first_values(), []
    for each in component.unknowns:
        key = next(key for key in problem.pose.places if each.own in problem.pose.place(*key).symbols)
        parts = problem.pose.place(*key).by_powers(each.own)
        at = (complex(*state.point(key[1]).position) - problem.origin) / problem.size
        x.append((at - evaluate(parts.get(0, Polynomial({})), given)) / evaluate(parts[1], given))
    x = np.array([*x, *np.conj(x)])
    still = [np.zeros_like(each) for each in component.member.parts]
    rows = component.family.rows_at(x[:, None], component.member, still, np.zeros(1))[0]
    assert np.abs(rows).max() < 1e-9


def test_a_search_for_all_solutions_goes_on_where_it_was(monkeypatch):
    class Interrupted(Exception):
        pass

    class Kept:
        content, many = None, 1

        def read(self):
            return self.content

        def write(self, content):
            self.content, self.many = content, self.many - 1
            if self.many == 0:
                raise Interrupted

    monkeypatch.setattr(generic_solutions, "KEPT_FROM", 1)
    family = family_of(task(with_points_on_coupler(), five_poses())).family
    whole = find_generic_solutions(family, enough=3)
    store = Kept()
    with pytest.raises(Interrupted):
        find_generic_solutions(family, enough=3, store=store)
    again = find_generic_solutions(family, enough=3, store=store)
    np.testing.assert_array_equal(again.V, whole.V)
    np.testing.assert_array_equal(again.member.parts[1], whole.member.parts[1])


def test_what_is_no_solution_is_not_certified():
    component = family_of(
        task(with_points_on_coupler(), {"link": "BC", "poses": [*poses(4)["poses"], {"at": [99, -30], "angle": 99}]})
    )
    record = family_record(component.family)
    x = affine_solutions(record.solutions.V)
    assert not certify_member(component.family, component.member, x * 1e6).proved.any()


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (task({"chains": [4]}, {"point": "P", "through": [[0, 0]]}), "that of one mechanism"),
        (task("four-bar", {"point": "E", "through": [[k, k * k] for k in range(10)]}), "1 condition on .* is too many"),
        (
            task("stephenson-3-five-bar", {"point": "E", "through": [[k, k * k] for k in range(9)]}),
            "more than one unknown turn",
        ),
    ],
)
def test_what_has_no_list_is_refused_in_words(value, said):
    with pytest.raises(planar.BadInput, match=said):
        planar.synthesise(value, complete=True)
    with pytest.raises(planar.BadInput, match="leave many"):
        planar.synthesise(value, complete=True, many=3)


def test_the_command_tells_what_is_expected_found_and_proved(tmp_path):
    pairs = [[0, 0], [25, 14], [50, 33], [70, 51], [90, 75]]
    (tmp_path / "throw.json").write_text(
        json.dumps(task("four-bar", {"from": "A", "to": "D", "pairs": pairs}, name="Throw"))
    )
    out = run(tmp_path, "synthesise", "throw.json", "--complete").done()
    assert "3 of 3 found" in out and "numerically complete" in out
    told = json.loads(run(tmp_path, "synthesise", "throw.json", "--complete", "--json").done())
    assert (told["expected"], told["found"], told["curves"]) == (3, 3, [])
    assert all(isinstance(each["certified"], bool) for each in told["designs"])


def test_the_table_of_a_list_has_the_dimensions_of_each_design_and_no_file_where_none_is_written():
    found = planar.synthesise(task(with_points_on_coupler(), five_poses()), complete=True)
    console = Console(width=200)
    with console.capture() as printed:
        console.print(table(found, []))
    told = printed.get()
    numbers = found[0].numbers
    assert f"AB.length {1e3 * numbers['AB.length']:.6g} mm" in told
    assert f"AD.A.x {1e3 * numbers['AD.A.x']:.6g} mm" in told
    assert "file" not in told
    assert "e-1" not in told  # a miss that is round-off is 0
    with console.capture() as printed:
        console.print(table(found, [Path("all/01.json")]))
    assert "all/01.json" in printed.get()


def test_an_interrupted_list_says_that_its_search_is_kept(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("planar.synthesis.exact.tracking.member_solutions.family_record", interrupted)
    unknown = {"link": "BC", "poses": [*poses(4)["poses"], {"at": [107, -28], "angle": 97}]}
    (tmp_path / "five.json").write_text(json.dumps(task(with_points_on_coupler(), unknown)))
    told = run(tmp_path, "synthesise", "five.json", "--complete").refused(130)
    assert told.startswith("interrupted: ") and told.endswith("the same command goes on from there")


def test_a_picture_shows_each_curve_once():
    found = planar.synthesise(task(with_points_on_coupler(), poses(4)), complete=True)
    texts = [each.get_text() for each in planar.plot.dyad_curves(found).findobj(lambda one: hasattr(one, "get_text"))]
    assert sum("Dyads B about A and C about D" in each for each in texts) == 1
    with pytest.raises(planar.BadInput, match="no curve"):
        planar.plot.dyad_curves(planar.synthesise(task(with_points_on_coupler(), poses(3)), complete=True))


def test_the_command_draws_curves_of_dyads_on_sheets_and_in_the_gallery(tmp_path):
    file = tmp_path / "hatch.json"
    file.write_text(json.dumps(task(with_points_on_coupler(), poses(4))))
    run(tmp_path, "synthesise", "hatch.json", "--complete", "-o", "curves.svg").done()
    assert "Dyads B about A and C about D" in (tmp_path / "curves.svg").read_text()
    run(tmp_path, "synthesise", "hatch.json", "--complete", "-o", "all").done()
    page = (tmp_path / "all" / "index.html").read_text()
    assert "Dyads B about A and C about D" in page
    assert page.count("<svg") == 2, "the curves, and one design of the family"
    file.write_text(json.dumps(task(with_points_on_coupler(), poses(3))))
    run(tmp_path, "synthesise", "hatch.json", "--complete", "-o", "designs.svg").done()
    assert "<svg" in (tmp_path / "designs.svg").read_text(), "of three poses there are designs, and no curves"


def test_what_moves_alike_comes_round_together_and_is_roberts_cognates():
    """S. Roberts, Three-bar motion in plane space, 1875: the three fixed pivots are a triangle like the coupler's."""
    places = [[k * k % 17, 3 * k * k % 19] for k in range(9)]
    component = family_of(task("four-bar", {"point": "E", "through": places}))
    family, record = component.family, family_record(component.family)
    rng = np.random.default_rng(2)
    member = family.random_member(rng)
    one = follow(family, record.solutions.member, record.representatives.V[:1], member, 1e-4)
    images = exchange_images(record.name.exchanges)
    known = ClassedSolutions(representatives(one.V, images), np.zeros(1, dtype=int))
    found = with_members(family, record, member, known, np.arange(1442) < 1, rng)
    assert found.classes.tolist() == [0, 0, 0]
    own = affine_solutions(found.V)[:, : family.size]
    order = [each.own for each in component.unknowns]
    (a, d, b, c) = (order.index(k) for k in dyad_symbols(component))
    place = member.parts[0][0, 0, 0]
    third = own[:, a] + (place - own[:, b]) / (own[:, c] - own[:, b]) * (own[:, d] - own[:, a])
    corners = np.sort_complex(np.stack([own[:, a], own[:, d], third], axis=1))
    np.testing.assert_allclose(corners, corners[[0, 0, 0]], rtol=1e-8)


def dyad_symbols(component):
    """The symbols of both pivots of nine places, and of the joints that go with them."""
    places = [[k * k % 17, 3 * k * k % 19] for k in range(9)]
    wanted = planar.read_task(task("four-bar", {"point": "E", "through": places}))
    pose = ExactProblem(wanted, next(iter(start_mechanisms(wanted)))).pose
    return [min(pose.place(*each).symbols) for each in (("AD", "A"), ("AD", "D"), ("AB", "B"), ("DC", "C"))]


def test_paths_end_at_the_same_places_in_more_digits():
    wanted = {"link": "BC", "poses": [*poses(4)["poses"], {"at": [99, -30], "angle": 99}]}
    component = family_of(task(with_points_on_coupler(), wanted))
    known = family_record(component.family).solutions
    plain, more = (
        follow(component.family, known.member, known.V, component.member, 1e-4, each) for each in (None, 2000)
    )
    assert plain.is_single.all() and more.is_single.all()
    np.testing.assert_allclose(affine_solutions(plain.V), affine_solutions(more.V), rtol=1e-12)


def test_a_trace_is_even_of_all_solutions_and_tells_where_one_is_left_out():
    component = family_of(task(with_points_on_coupler(), five_poses()))
    record = family_record(component.family)
    exchanges, known = record.name.exchanges, record.solutions
    assert trace_test(component.family, known, exchanges)
    assert not trace_test(component.family, known._replace(V=known.V[1:]), exchanges)
    assert not trace_test(component.family, known, exchanges, most_points=len(known.V))


def test_paths_in_balls_end_at_the_same_places():
    component = family_of(task(with_points_on_coupler(), five_poses()))
    known = family_record(component.family).solutions
    plain = follow(component.family, known.member, known.V, component.member, 1e-4)
    x = follow_in_balls(component.family, known.member, affine_solutions(known.V), component.member)
    np.testing.assert_allclose(affine_solutions(plain.V), x, rtol=1e-10)
    none = follow(component.family, known.member, known.V[:0], component.member, 1e-4)
    assert none.V.shape == (0, known.V.shape[1])


def test_a_path_in_balls_to_where_several_meet_ends_nowhere():
    """Two poses that are one leave a curve of dyads."""
    poses_ = five_poses()
    component = family_of(
        task(with_points_on_coupler(), poses_ | {"poses": [*poses_["poses"][:4], poses_["poses"][3]]})
    )
    known = family_record(component.family).solutions
    x = follow_in_balls(component.family, known.member, affine_solutions(known.V)[:2], component.member)
    assert np.isnan(x).all()


@pytest.mark.parametrize("gone", range(4))
def test_what_paths_lose_is_found_in_balls_and_nothing_twice(gone):
    component = family_of(task(with_points_on_coupler(), five_poses()))
    record = family_record(component.family)
    whole = solve_member(component.family, record, component.member)
    kept = np.arange(4) != gone
    rest = whole._replace(x=whole.x[kept], classes=whole.classes[kept])
    assert (rest.found, rest.lost) == (3, 1)
    found = with_ball_paths(component, record, rest, print)
    assert sorted(found.classes.tolist()) == [0, 1, 2, 3]
    np.testing.assert_allclose(found.x[3], whole.x[gone], rtol=1e-10)
    # far out, where it stands beside one that is known
    doubtful = rest._replace(
        doubtful=whole.x[[gone, gone - 1]],
        doubtful_classes=whole.classes[[gone, gone - 1]],
        is_doubtful_infinite=np.ones(2, dtype=bool),
    )
    assert (doubtful.at_infinity, doubtful.singular, doubtful.lost) == (1, 0, 0)
    found = with_doubtful(component, record, doubtful)
    assert len(found.x) == found.found == 4 and not found.at_infinity


def lose_paths(monkeypatch, lost, leap):
    """Those paths are lost, or leap to the end of the first, and long doubles are of no help."""
    plain = member_solutions.follow

    def follow_less(family, begin, V, end, near, long_steps=None):
        ends = plain(family, begin, V, end, near, long_steps)
        if long_steps is None:
            assert len(V) == 4, "another way was tried"
            if leap:
                ends.V[lost] = ends.V[0]
            else:
                ends.has_converged[lost], ends.is_near_end[lost] = False, False
            return ends
        return ends._replace(has_converged=np.zeros(len(V), dtype=bool), is_near_end=np.zeros(len(V), dtype=bool))

    monkeypatch.setattr(member_solutions, "follow", follow_less)


@pytest.mark.parametrize("lost", [[2], [1, 3], [1, 2, 3]])
@pytest.mark.parametrize("leap", [False, True])
def test_paths_that_are_lost_or_leap_are_followed_in_balls_before_other_ways(monkeypatch, lost, leap):
    component = family_of(task(with_points_on_coupler(), five_poses()))
    record = family_record(component.family)
    known = solve_member(component.family, record, component.member)
    lose_paths(monkeypatch, lost, leap)
    said = []
    found = solve_member(component.family, record, component.member, said.append)
    np.testing.assert_allclose(found.x, known.x, rtol=1e-10)
    assert found.found == 4 and sorted(found.classes.tolist()) == [0, 1, 2, 3]
    assert said == [f"{len(lost) + leap} path{'s' * (len(lost) + leap > 1)} in balls"]
    assert found.ball_rows.tolist() == ([0, *lost] if leap else lost)


def test_solutions_that_nearly_meet_or_are_far_out_are_told_from_others():
    component = family_of(task(with_points_on_coupler(), five_poses()))
    known = solve_member(component.family, family_record(component.family), component.member)
    assert not is_nearly_singular(component.family, component.member, known.x).any()
    assert is_nearly_singular(component.family, component.member, known.x * 1e9).all()


def test_solutions_that_are_nearly_real_are_told_from_their_images():
    one = np.array([0.3 + 1e-5j, -1.2, 0.3 - 1e-5j, -1.2])
    V = homogeneous_solutions(np.array([one, one[[2, 3, 0, 1]], one + 1e-12]))
    assert first_of_same(V).tolist() == [0, 1, 0]
