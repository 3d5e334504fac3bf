"""The gradient of a prepared run is that of its motion, and of differences of the run itself."""

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import design_variables
from planar.foundation.errors import BadInput, Outcome
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from tests.draws import first_cases, part
from tests.known import MODELS

ORDERS = ("position", "velocity", "acceleration")
RUNNING = [stem for stem, mechanism in MODELS.items() if len(mechanism.inputs) == 1]
STEPS, RANGE = 30, 0.3


def random_weights(ready, rng, orders=ORDERS):
    shape = (ready.steps + 1, 2)
    return {order: {name: rng.normal(size=shape) for name in ready.points[:3]} for order in orders}


def of_motion(mechanism, weights, start, stop, values=None):
    """The same by `planar.gradient`."""
    motion = planar.cycle(mechanism.with_values(values or {}), STEPS, start, stop)
    points = next(iter(weights.values()))
    return planar.gradient(motion, {name: {order: of[name] for order, of in weights.items()} for name in points})


def agree(found, wanted):
    assert list(found) == list(wanted)
    one, other = (np.array(list(each.values())) for each in (found, wanted))
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-10 * np.nanmax(np.abs(other)))


def is_turning(mechanism):
    """Whether the input turns."""
    return relative_motions(mechanism)[mechanism.inputs[0].pair].input_kind is MeasureKind.ANGLE


def try_gradient(ready, weights):
    """The gradient; None where derivatives are not told of the structure."""
    try:
        return ready.gradient(weights)
    except BadInput as problem:
        assert str(problem).startswith(("pairs: constraints hold", "closes_within", "cam")) or "cam" in str(problem)
        return None


@pytest.mark.parametrize("stem", part(RUNNING, 20))
def test_a_gradient_of_a_model_is_that_of_its_motion(stem):
    mechanism = MODELS[stem]
    start = mechanism.inputs[0].position
    ready = planar.prepared(mechanism, STEPS, start=start, stop=start + RANGE)
    weights = random_weights(ready, np.random.default_rng(1))
    found, run = try_gradient(ready, weights), ready()
    if found is None or not ready.points or run.status.any() or found.status.any():
        return
    agree(found.derivatives, of_motion(mechanism, weights, start, start + RANGE))
    told = sum(np.sum(getattr(run, order)[name] * w) for order, of in weights.items() for name, w in of.items())
    assert found.value == pytest.approx(told, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "stem", first_cases(["slider-crank", "stephenson-3-five-bar", "crank-rocker", "geared-five-bar"], 2)
)
def test_a_gradient_is_the_slope_of_the_run(stem):
    """Differences of fourth order, of steps twice as great sixteen times as far off."""
    mechanism = MODELS[stem]
    start = mechanism.inputs[0].position
    ready = planar.prepared(mechanism, 12, start=start, stop=start + RANGE)
    weights = random_weights(ready, np.random.default_rng(2))
    known = planar.dimensions(mechanism)
    lengths = [name for name, value in known.items() if name.endswith("length") and value > 0.0]
    values = {name: 1.01 * known[name] for name in lengths}
    exact = ready.gradient(weights, values)
    for name in lengths:
        off = []
        for step in (2e-2 * known[name], 1e-2 * known[name]):
            at = {
                k: ready.gradient(weights, {**values, name: values[name] + k * step}, of=name).value
                for k in (-2, -1, 1, 2)
            }
            off.append(abs((8.0 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12.0 * step) - exact.derivatives[name]))
        assert off[1] < 1e-4 * abs(exact.derivatives[name]) + 1e-8
        assert off[0] > 8.0 * off[1] or off[1] < 1e-7 * max(1.0, abs(exact.derivatives[name]))


def test_where_and_how_fast_the_input_runs_has_derivatives_too():
    mechanism = MODELS["crank-rocker"]
    pair = mechanism.inputs[0].pair
    ready = planar.prepared(mechanism, 40)
    weights = random_weights(ready, np.random.default_rng(3))
    own = planar.dimensions(mechanism)
    values = {f"{pair}.position": 0.4, f"{pair}.velocity": 3.0, f"{pair}.acceleration": -7.0}
    exact = ready.gradient(weights, values)
    for name, value in values.items():
        assert name in own
        above, below = (ready.gradient(weights, {**values, name: value + step}).value for step in (1e-5, -1e-5))
        assert (above - below) / 2e-5 == pytest.approx(exact.derivatives[name], rel=1e-6)


def both_ways(ready, weights, values):
    """The gradient by compiled code, where that is sure, and by the general path."""
    quick = ready.gradient(weights, values)
    general = planar.prepared(ready.mechanism, ready.steps, ready.points, rates=ready.rates, **ready.range)
    general.run_gradients._compiled_sums = lambda rows: None
    return quick, general.gradient(weights, values)


@pytest.mark.parametrize("stem", part([*RUNNING, "crank-rocker", "whitworth", "four-bar"], 12, 5))
def test_compiled_code_gives_what_the_general_path_gives(stem):
    """Of other designs, those with pins elsewhere too, and where the run comes to a dead point."""
    mechanism, rng = MODELS[stem], np.random.default_rng(5)
    known = {name: each for name, each in design_variables(mechanism).items() if each.link and each.kind == "length"}
    ready = planar.prepared(mechanism, 24, stop=None if is_turning(mechanism) else mechanism.inputs[0].position + 0.1)
    weights = random_weights(ready, rng)
    for spread in (0.0, 0.01, 0.1):
        values = {name: float(each.value * np.exp(spread * rng.normal())) for name, each in known.items()}
        if spread == 0.01:
            values |= {name: 0.01 * rng.normal() for name, each in known.items() if not each.value}
        try:
            quick, general = both_ways(ready, weights, values)
        except BadInput:
            return
        np.testing.assert_array_equal(quick.status, general.status)
        one, other = (np.array(list(each.derivatives.values())) for each in (quick, general))
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-8 * np.nanmax(np.abs(other), initial=1.0))
        assert quick.value == pytest.approx(general.value, rel=1e-8, abs=1e-8)


def test_positions_that_are_not_solved_bring_nothing():
    mechanism = MODELS["crank-rocker"]
    ready = planar.prepared(mechanism, 60)
    crank = mechanism.links[1].name + ".length"
    values = {crank: 3.0 * planar.dimensions(mechanism)[crank]}
    weights = random_weights(ready, np.random.default_rng(4))
    found, run = ready.gradient(weights, values), ready(values)
    solved = run.status == 0
    assert 0 < solved.sum() < 61
    np.testing.assert_array_equal(found.status, run.status)
    told = sum(
        np.sum((getattr(run, order)[name] * w)[solved]) for order, of in weights.items() for name, w in of.items()
    )
    assert found.value == pytest.approx(told, rel=1e-9)
    assert np.isfinite(list(found.derivatives.values())).all()
    other = {
        order: {name: np.where(solved[:, None], w, 9.0) for name, w in of.items()} for order, of in weights.items()
    }
    agree(ready.gradient(other, values).derivatives, found.derivatives)


def test_what_cannot_be_assembled_has_no_gradient_and_says_so():
    mechanism = MODELS["four-bar"]
    ready = planar.prepared(mechanism, 20, "C")
    found = ready.gradient({"position": {"C": np.ones((21, 2))}}, {"BC.length": 5.0})
    assert set(found.status) == {tuple(Outcome).index(Outcome.CANNOT_BE_ASSEMBLED)}
    assert found.value == 0.0
    assert set(found.derivatives.values()) == {0.0}


def test_numbers_that_cannot_change_alone_have_no_derivative():
    mechanism = MODELS["gear-reducer"]
    ready = planar.prepared(mechanism, 12, rates=False)
    found = ready.gradient({"position": {ready.points[0]: np.ones((13, 2))}}).derivatives
    wanted = planar.gradient(planar.cycle(mechanism, 12), {ready.points[0]: np.ones((13, 2))})
    assert [name for name in found if np.isnan(found[name])] == [name for name in wanted if np.isnan(wanted[name])]


def test_only_some_derivatives_may_be_wanted():
    ready = planar.prepared("four-bar", 12, "C", start=0.5, stop=1.0)
    weights = {"position": {"C": np.ones((13, 2))}}
    every = ready.gradient(weights).derivatives
    some = ready.gradient(weights, of=["DC.length", "AB.length"]).derivatives
    assert some == {name: every[name] for name in ("DC.length", "AB.length")}


@pytest.mark.parametrize(
    ("weights", "more", "sentence"),
    [
        ({}, {}, "name what is weighed"),
        ({"force": {"C": np.ones((13, 2))}}, {}, "no 'force'"),
        ({"velocity": {"C": np.ones((13, 2))}}, {}, "prepare it with rates"),
        ({"position": {"K": np.ones((13, 2))}}, {}, "not prepared with the point 'K'"),
        ({"position": {"C": np.ones((12, 2))}}, {}, r"shape \(13, 2\)"),
        ({"position": {"C": "all"}}, {}, r"shape \(13, 2\)"),
        ({"position": {"C": np.full((13, 2), np.nan)}}, {}, "not finite"),
        ({"position": {"C": np.ones((13, 2))}}, {"of": "nothing"}, "no derivative in a number 'nothing'"),
        ({"position": {"C": np.ones((13, 2))}}, {"values": {"nothing": 1.0}}, "no such dimension"),
    ],
)
def test_what_does_not_fit_is_refused(weights, more, sentence):
    ready = planar.prepared("four-bar", 12, "C", rates=False, start=0.5, stop=1.0)
    with pytest.raises(BadInput, match=sentence):
        ready.gradient(weights, **more)


@pytest.mark.parametrize(
    ("stem", "sentence"),
    [
        ("measured-cam", "given points"),
        ("double-parallelogram", "misfit"),
        ("coupled-wheels", "more than once"),
        ("excavator-arm", "give start and stop"),
    ],
)
def test_what_has_no_gradients_is_refused_before_it_runs(stem, sentence):
    mechanism = MODELS[stem]
    pair = mechanism.inputs[0].pair if len(mechanism.inputs) > 1 else None
    ready = planar.prepared(mechanism, 12, rates=False, pair=pair)
    with pytest.raises(BadInput, match=sentence):
        ready.gradient({"position": {ready.points[0]: np.ones((13, 2))}})
