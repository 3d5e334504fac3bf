"""Laws that hold for every pair type, found by looking in the folder."""

import casadi as ca
import numpy as np
import pytest

from planar.document import files
from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Jet
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind, Pair, PairSample, pair_types
from planar.model.pairs.rubbing import LoadLaw
from planar.model.pairs.turning import TurningPair

SAMPLES = [
    pytest.param(sample, id=f"{keyword}-{index}")
    for keyword, kind in pair_types().items()
    for index, sample in enumerate(kind.samples())
]
every_sample = pytest.mark.parametrize("sample", SAMPLES)


def numbers(sample: PairSample) -> list[float]:
    return list(sample.pair.measure(sample.shapes))


def coordinates(sample: PairSample) -> np.ndarray:
    """x, y, angle of every body, then the pair's own."""
    return np.array([*(c for f in sample.frames for c in (f.x, f.y, f.angle)), *sample.own])


def placed(sample: PairSample, at) -> tuple:
    """What the pair's formulas take, from all coordinates in one row."""
    many = len(sample.frames)
    return [frame_at(*at[3 * k : 3 * k + 3]) for k in range(many)], numbers(sample), at[3 * many :]


def residual(sample: PairSample, at) -> list:
    return list(sample.pair.residual(*placed(sample, at)))


def drive(sample: PairSample, at):
    return sample.pair.input_position(*placed(sample, at))


def off(sample: PairSample) -> np.ndarray:
    """A place near the sample where the pair is open."""
    return coordinates(sample) + np.random.default_rng(1).uniform(-0.3, 0.3, coordinates(sample).size)


def test_types_are_found_and_each_brings_samples():
    assert {"turning", "sliding", "slot", "gear", "rack", "belt", "chain"} <= set(pair_types())
    assert all(kind.samples() for kind in pair_types().values())
    assert all(issubclass(kind, Pair) for kind in pair_types().values())


@every_sample
def test_a_sample_is_closed_and_its_residual_is_what_it_declares(sample):
    left = residual(sample, coordinates(sample))
    assert len(left) == len(sample.pair.residual_kinds)
    assert len(numbers(sample)) == len(sample.pair.number_kinds)
    assert len(sample.own) == len(sample.pair.coordinate_kinds)
    assert np.abs(left).max() < 1e-14  # a few roundings of numbers of order one


@every_sample
def test_floats_arrays_and_symbols_give_the_same_residual_and_drive(sample):
    at = off(sample)
    on_floats = [*residual(sample, at), drive(sample, at)]
    column = np.repeat(at[:, None], 3, axis=1)
    on_arrays = [*residual(sample, column), drive(sample, column)]
    x = ca.SX.sym("x", at.size)
    parts = ca.vertsplit(x)
    function = ca.Function("f", [x], [ca.vertcat(*residual(sample, parts), drive(sample, parts))])
    on_symbols = function(at).full().ravel()
    # the same operations in the same order: only cos and sin may come from another library, so an ulp or two
    np.testing.assert_allclose(on_symbols, on_floats, rtol=0, atol=1e-15)
    for each, value in zip(on_arrays, on_floats, strict=True):
        np.testing.assert_allclose(each, np.full(3, value), rtol=0, atol=1e-15)


@every_sample
def test_casadi_jacobian_equals_the_complex_step(sample):
    at = off(sample)
    x = ca.SX.sym("x", at.size)
    parts = ca.vertsplit(x)
    stacked = ca.vertcat(*residual(sample, parts), drive(sample, parts))
    jacobian = ca.Function("J", [x], [ca.jacobian(stacked, x)])(at).full()
    step = 1e-30  # no difference is taken, so nothing cancels
    for column in range(at.size):
        moved = at.astype(complex)
        moved[column] += 1j * step
        slopes = np.imag([*residual(sample, moved), drive(sample, moved)]) / step
        np.testing.assert_allclose(jacobian[:, column], slopes, rtol=0, atol=1e-14)


@every_sample
def test_a_rigid_motion_of_the_whole_changes_nothing(sample):
    at = off(sample)
    turn, shift = 0.83, Vector(3.0, -2.0)
    moved = at.copy()
    for k in range(0, 3 * len(sample.frames), 3):
        x, y = Vector(at[k], at[k + 1]).rotate(Vector(np.cos(turn), np.sin(turn))) + shift
        moved[k : k + 3] = x, y, at[k + 2] + turn
    before, after = residual(sample, at), residual(sample, moved)
    kinds = sample.pair.residual_kinds
    lengths = [k for k, kind in enumerate(kinds) if kind is MeasureKind.LENGTH]
    others = [k for k, kind in enumerate(kinds) if kind is not MeasureKind.LENGTH]
    # lengths turn with the whole, angles stay; five units of round-off of numbers up to ten
    assert np.linalg.norm(np.take(before, lengths)) == pytest.approx(np.linalg.norm(np.take(after, lengths)), abs=1e-14)
    np.testing.assert_allclose(np.take(before, others), np.take(after, others), atol=1e-14)
    assert drive(sample, at) == pytest.approx(drive(sample, moved), abs=1e-14)


@every_sample
def test_constraints_are_independent_and_the_drive_measures_a_freedom_that_they_leave(sample):
    at = coordinates(sample)
    x = ca.SX.sym("x", at.size)
    parts = ca.vertsplit(x)
    both = ca.vertcat(*residual(sample, parts), drive(sample, parts))
    slope = ca.Function("J", [x], [ca.jacobian(both, x)])(at).full()[:, 3:]  # the first link held
    count = len(sample.pair.residual_kinds)
    assert np.linalg.matrix_rank(slope[:count], tol=1e-9) == count
    assert np.linalg.matrix_rank(slope, tol=1e-9) == count + 1


@every_sample
def test_jets_give_the_derivatives_of_residual_and_drive(sample):
    rng = np.random.default_rng(2)
    at, rate, second = off(sample), *rng.uniform(-1, 1, (2, coordinates(sample).size))
    jets = [Jet(*parts) for parts in zip(at, rate, second, strict=True)]
    found = [*residual(sample, jets), drive(sample, jets)]

    def along(t):
        place = at + rate * t + 0.5 * second * t * t
        return np.array([*residual(sample, place), drive(sample, place)])

    h = 1e-4  # central differences: truncation h^2 about 1e-8, rounding 1e-16 / h^2 about 1e-8
    first = (along(h) - along(-h)) / (2 * h)
    twice = (along(h) - 2 * along(0) + along(-h)) / h**2
    for jet, value, slope, bend in zip(found, along(0), first, twice, strict=True):
        assert jet.parts == pytest.approx((value, slope, bend), abs=2e-7 * np.abs(at).max(initial=1.0))


@every_sample
def test_a_pair_in_a_file_is_read_and_written_back(sample):
    shapes = dict(zip("abc", sample.shapes, strict=False))
    links = {name: {"points": {p: list(at) for p, at in shape.points.items()}} for name, shape in shapes.items()}
    value = {
        "planar": 1,
        "frame": "ground",
        "links": {"ground": {"points": {"G": [0, 0]}}, **links},
        "pairs": [sample.entry, *sample.other_entries],
    }
    mechanism = files.from_dict(value)
    assert mechanism.pairs[0] == sample.pair
    assert files.from_dict(files.to_dict(mechanism)) == mechanism


@every_sample
def test_results_carry_the_names_and_kinds_that_the_type_declares(sample):
    pair = sample.pair
    report = pair.results(0.5, -2.0, 3.0)
    assert list(report) == list(pair.result_kinds)
    values = [value for value in report.values() if value is not None]
    assert 0.5 in values
    assert -2.0 in values
    assert 3.0 in values


def test_at_a_pin_on_the_frame_the_drive_is_the_angle_of_the_other_link():
    ground, link = Frame(0.0, 0.0, 1.0, 0.0, 0.0, True), frame_at(0.0, 0.0, 0.7)
    pair = next(iter(pair_types()["turning"].samples())).pair
    assert pair.input_position([ground, link], (), ()) == pair.input_position([link, ground], (), ()) == 0.7


def test_a_pin_of_three_links_is_two_pairs_with_three_relative_motions():
    links = {name: {"points": {"P": [0, 0], name: [1, 0]}} for name in ("a", "b", "c")}
    mechanism = files.from_dict(
        {"planar": 1, "frame": "a", "links": links, "pairs": [{"turning": "P", "links": ["b", "a", "c"]}]}
    )
    assert [pair.links for pair in mechanism.pairs] == [("b", "a"), ("b", "c")]
    assert list(relative_motions(mechanism)) == ["P:b,a", "P:b,c", "P:a,c"]


@every_sample
def test_friction_acts_against_the_motion_that_the_pair_leaves(sample):
    """What each contact is against has power in the sense that it says of the rate of the input position."""
    names = "abc"[: len(sample.frames)]
    frames, shapes = dict(zip(names, sample.frames, strict=True)), dict(zip(names, sample.shapes, strict=True))
    pins = [TurningPair(p, ("c", w), (p, p), p) for p, w in ("Aa", "Bb")] if len(sample.other_entries) == 2 else []
    contacts = sample.pair.rubbing_contacts(frames, shapes, [sample.pair, *pins], False)
    assert bool(contacts) == sample.pair.has_friction or not sample.other_entries
    at = coordinates(sample)
    x = ca.SX.sym("x", at.size)
    parts = ca.vertsplit(x)
    both = ca.vertcat(*residual(sample, parts), drive(sample, parts))
    slope = ca.Function("J", [x], [ca.jacobian(both, x)])(at).full()
    moves = np.linalg.svd(slope[:-1])[2][len(sample.pair.residual_kinds) :]
    rates = np.random.default_rng(3).normal(size=(20, len(moves))) @ moves
    for contact in contacts:
        assert all(load.factor > 0.0 for load in contact.loads)
        if contact.law is LoadLaw.SIGNED:
            continue
        action, power = contact.action, np.zeros(20)
        for link, sense in ((action.link, 1.0), (action.reaction_link, -1.0)):
            vx, vy, turning = rates[:, 3 * names.index(link) : 3 * names.index(link) + 3].T
            if action.point is None:
                power += sense * turning
                continue
            arm = action.point - Vector(frames[link].x, frames[link].y)
            speed = Vector(vx - turning * arm.y, vy + turning * arm.x)
            power += sense * (speed.x * action.direction.x + speed.y * action.direction.y)
        driven = rates @ slope[-1] * contact.rate_sense
        assert (np.sign(power) == np.sign(driven)).all()
