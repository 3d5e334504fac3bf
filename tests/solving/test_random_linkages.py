"""Random linkages of up to twelve moving links, in any loops, of turning and sliding pairs, built closed."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import planar
from planar.document import files
from planar.dynamics.forces import forces
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Drive, Mechanism, links_counting_turns
from planar.results.motion import State
from planar.solving.position import PositionSolver, solve
from tests.draws import draws
from tests.linkages import Built, assembled, conditioning, random_linkage, seeds, shares

sizes = st.integers(1, 12)
many = settings(
    max_examples=draws(15), deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


def distance(mechanism: Mechanism, state: State, place) -> float:
    """Sum of squared distances of the sketched points to where `place` has them."""
    return sum(float(np.sum((place(name) - np.array([x, y])) ** 2)) for name, x, y in mechanism.sketch)


@many
@given(seeds, sizes, shares)
def test_assembles_from_a_sketch_disturbed_by_one_percent(seed, links, higher):
    built = random_linkage(seed, links, 0.01, higher)
    mechanism, state = assembled(built, 1e-3)
    assert state.mobility == len(mechanism.inputs)
    assert state.residual < 1e-13

    def as_built(name):
        link, point = state._find_point(name).members[0]
        return np.array(built.frames[link].to_world(state.shapes[link].position(point)))

    found, drawn = (distance(mechanism, state, place) for place in (lambda n: state.point(n).position, as_built))
    # the nearest assembly is taken: the one that was built, or one nearer still to the disturbed sketch
    assert found <= drawn + 1e-9


@many
@given(seeds, sizes, shares)
def test_velocities_and_accelerations_are_the_derivatives_at_order_two(seed, links, higher):
    built = random_linkage(seed, links, 0.0, higher)
    mechanism, here = assembled(built, 0.05)

    def at(t: float) -> State:
        drives = [
            Drive(g.pair, g.position + g.velocity * t + g.acceleration * t * t / 2, g.velocity + g.acceleration * t)
            for g in mechanism.inputs
        ]
        try:
            return solve(mechanism, drives)
        except NoAnswer as problem:
            # a limit may lie within the step where one group drives the next much faster than it moves itself
            assert problem.outcome is Outcome.BRANCH_LOST
            assume(False)
            raise

    frames = [name for name in built.frames if name != "frame"]
    rates = [
        max(abs(getattr(here.frames[name], part).parts[order]) for name in frames for part in ("x", "y", "angle"))
        for order in (1, 2)
    ]
    # one group may drive the next much faster than it moves itself: the step is a part of the fastest motion's time
    coarse_step = 2e-3 / (1.0 + rates[0] + np.sqrt(rates[1]))
    errors = []
    for step in (coarse_step, coarse_step / 2):
        ahead, behind = at(step), at(-step)
        gaps = [0.0, 0.0]
        for name in frames:
            for part in ("x", "y", "angle"):
                a, b, c = (getattr(state.frames[name], part).parts for state in (ahead, here, behind))
                for order in (0, 1):
                    gaps[order] = max(gaps[order], abs((a[order] - c[order]) / (2 * step) - b[order + 1]))
        errors.append(gaps)
    for order, (coarse, fine) in enumerate(zip(*errors, strict=True)):
        # halving the step quarters the error, until what is left is rounding: of what is differenced (1e-15, through
        # a condition of at most 20 a group and its square in the rates) over the step
        rounding = 1e-12 * (1.0 + (0.0, rates[0])[order]) / coarse_step
        assert fine < rounding or 1.7 < np.log2(coarse / fine) < 2.3


@many
@given(seeds, sizes, shares, st.sampled_from([1e-6, 1e-3, 1e3]))
def test_micrometres_or_kilometres_give_the_same_numbers(seed, links, higher, factor):
    built = random_linkage(seed, links, 0.0, higher)
    mechanism, state = assembled(built, 0.01)
    # what the sketch leaves open is taken as it is found first, which rounding can change
    assume(not any("leaves open" in remark for remark in state.remarks))
    value = built.value | {"units": {"length": {1e-6: "um", 1e-3: "mm", 1e3: "km"}[factor]}}
    slides = {pair.name for pair in mechanism.pairs if pair.coordinate_kinds}
    value["inputs"] = [
        given | {key: given[key] * factor for key in ("velocity", "acceleration") if given["pair"] in slides}
        for given in value["inputs"]
    ]
    other = solve(files.from_dict(value))
    solver = PositionSolver(mechanism)
    condition = 1.0 / conditioning(solver, solver.find_assembly().z)
    for name, point in state.points.items():
        twin = other.point(name)
        for part in ("position", "velocity", "acceleration"):
            a, b = getattr(point, part), getattr(twin, part) / factor
            scale = max(1.0, *(float(np.abs(getattr(p, part)).max()) for p in state.points.values()))
            # 1e-12, times what a linkage near a dead point does to the last digit of its own dimensions
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-14 * scale * max(100.0, condition**2))


@many
@given(seeds, sizes, shares)
def test_power_balances_for_any_load(seed, links, higher):
    """Inputs against loads: sum of T_i du_i + sum of F . v vanishes at the state's own rates, whatever they are."""
    built = random_linkage(seed, links, 0.0, higher)
    rng = np.random.default_rng(seed)
    value = built.value | {
        "loads": [{"point": name, "force": rng.uniform(-5, 5, 2).tolist()} for name in list(built.value["sketch"])[:4]]
        + [{"link": next(name for name in built.frames if name != "frame"), "torque": 3.0}]
    }
    _, state = assembled(Built(value, built.frames), 0.01)
    efforts = forces(state).inputs
    drive = sum(effort * state.inputs[name].velocity for name, effort in efforts.items())
    load = sum(np.dot(each.force, state.point(each.point).velocity) for each in state.mechanism.loads if each.force)
    load += sum(each.torque * state.link(each.link).angular_velocity for each in state.mechanism.loads if each.torque)
    parts = [abs(e * state.inputs[n].velocity) for n, e in efforts.items()]
    # velocities carry the rounding of one solve: 1e-16 times the condition, at most 1e2 here squared in the positions
    assert drive + load == 0 or abs(drive + load) < 1e-11 * max(1.0, *parts)


@many
@given(seeds, sizes, shares)
def test_turning_and_shifting_the_whole_turns_and_shifts_every_result(seed, links, higher):
    """The frame's points moved rigidly (with an input that counts from the frame's axis turned along)."""
    built = random_linkage(seed, links, 0.0, higher)
    mechanism, state = assembled(built, 0.01)
    # what the sketch leaves open is taken as it is found first, which rounding can change
    assume(not any("leaves open" in remark for remark in state.remarks))
    turn, shift = 1.1, np.array([3.0, -2.0])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    # a gear whose wheels' turns nothing tells takes them between -pi and pi, and turning the whole may leave that;
    # so may any other link, from whose angle that of a wheel follows through a slide
    turned = [state.link(link.name).angle + turn for link in mechanism.links if links_counting_turns(mechanism)]
    assume(all(abs(angle) < np.pi for angle in turned))

    def moved(point):
        return (rotation @ np.array(point) + shift).tolist()

    value = files.to_dict(mechanism)
    frame = value["links"]["frame"]
    value["links"] = value["links"] | {"frame": {"points": {n: moved(p) for n, p in frame["points"].items()}}}
    value["sketch"] = {name: moved(at) for name, at in value["sketch"].items()}
    for entry in value["pairs"]:
        turns = {link: 0.0 if link == "frame" else turn for link in (*entry["links"], entry.get("carrier"))}
        first, second = (turns[link] for link in entry["links"][:2])
        if "line" in entry and first == 0.0:
            line = entry["line"]
            through = moved(line["through"]) if isinstance(line["through"], list) else line["through"]
            entry["line"] = {"through": through, "angle": line["angle"] + turn}
        if "sliding" in entry and second == 0.0:
            entry["turn"] = entry.get("turn", 0.0) - turn
        if "rack" in entry:
            entry["mesh"]["angle"] += second - first
        elif "mesh" in entry:
            entry["mesh"] = {link: at + turns[link] - turns[entry["carrier"]] for link, at in entry["mesh"].items()}
    for given_input in value["inputs"]:
        entry = next(e for e in value["pairs"] if given_input["pair"] in (e.get("turning"), e.get("sliding")))
        if "turning" in entry and "frame" in entry["links"]:
            given_input["position"] = float(given_input["position"]) + turn
    other = solve(files.from_dict(value))
    for name, point in state.points.items():
        twin = other.point(name)
        scale = 1.0 + max(float(np.abs(p.acceleration).max()) for p in state.points.values())
        np.testing.assert_allclose(twin.position, moved(point.position), atol=1e-9)
        np.testing.assert_allclose(twin.velocity, rotation @ point.velocity, atol=1e-8 * scale)
        np.testing.assert_allclose(twin.acceleration, rotation @ point.acceleration, atol=1e-8 * scale)


def test_links_that_hold_each_other_twice_are_not_called_open_by_round_off():
    """The closed form of two of their links divides by nothing, and says nothing of whether they can be joined."""
    with pytest.raises(NoAnswer) as refused:
        planar.solve(files.from_dict(random_linkage(2991, 8).value))
    assert refused.value.outcome is Outcome.TOO_FEW_INPUTS


@pytest.mark.parametrize(("seed", "links", "higher"), [(2815, 7, 0.3), (92, 9, 0.5)])
def test_slides_that_go_out_without_an_end_meet_no_dead_point_there(seed, links, higher):
    mechanism = files.from_dict(random_linkage(seed, links, 0.0, higher).value)
    first = mechanism.inputs[0]
    motion = planar.cycle(mechanism, 30, first.position, first.position + 0.6, pair=first.pair)
    assert motion.outcome is Outcome.BRANCH_LOST
    assert "slide out without an end" in motion.reason


def test_a_last_row_without_rates_does_not_take_those_of_the_others():
    mechanism = files.from_dict(random_linkage(2650, 5, 0.0, 0.5).value)
    start = mechanism.inputs[0].position
    motion = planar.cycle(mechanism, 30, start, start + 0.6)
    assert motion.outcome is Outcome.BRANCH_LOST
    rates = next(iter(motion.points.values())).velocity
    assert np.isfinite(rates[:-1]).all()
