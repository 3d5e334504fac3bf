"""What layers are made of: many designs at once, masks, and derivatives that are those of differences."""

import numpy as np
import pytest

import planar
from planar.batch.linkage_layer import LinkageLayer
from planar.batch.prepared import RangeArguments
from planar.foundation.errors import BadInput
from tests.draws import first_cases, is_exhaustive

FREE = ["crank.length", "coupler.length"]


def make(points="B", steps=24, rates=False, stem="crank-rocker", free=FREE):
    return LinkageLayer(stem, free, points, steps, rates, RangeArguments(start=None, stop=None, pair=None))


def test_runs_are_those_of_a_sweep():
    layer, rng = make(rates=True), np.random.default_rng(1)
    values = layer.file_values * (1.0 + 0.05 * rng.normal(size=(3, 4, 2)))
    told, solved = layer.run(values)
    designs = {name: values[..., k].ravel() for k, name in enumerate(FREE)}
    swept = planar.sweep("crank-rocker", designs, 24, "B")
    assert solved.all()
    for order, wanted in zip(told, (swept.position, swept.velocity, swept.acceleration), strict=True):
        np.testing.assert_allclose(order.reshape(12, 25, 2), wanted["B"], atol=1e-8)


def test_derivatives_are_those_of_differences():
    layer, rng = make(points=["B", "A"], rates=True), np.random.default_rng(2)
    values = layer.file_values * (1.0 + 0.05 * rng.normal(size=(2, 2)))
    weights = [rng.normal(size=(2, 25, 2, 2)) for _ in range(3)]
    found = layer.pull_back(values, weights)
    for k in range(2):
        step = np.zeros(2)
        step[k] = 1e-6
        total = [
            sum((w * each).sum(axis=(1, 2, 3)) for w, each in zip(weights, layer.run(at)[0], strict=True))
            for at in (values + step, values - step)
        ]
        np.testing.assert_allclose((total[0] - total[1]) / 2e-6, found[:, k], rtol=1e-5)


def test_what_is_not_solved_is_nothing_and_masked():
    layer = make()
    values = np.array([[0.9, 0.1], [np.nan, 0.1], [0.15, 0.18], layer.file_values])
    (position,), solved = layer.run(values)
    assert not solved[:2].any()
    assert 0 < solved[2].sum() < 25
    assert solved[3].all()
    assert not position[~solved].any()
    slopes = layer.pull_back(values, [np.ones(position.shape)])
    assert not slopes[:2].any()
    assert np.isfinite(slopes).all()
    masked = np.where(solved[..., None], np.ones(2), 77.0)
    np.testing.assert_array_equal(layer.pull_back(values, [masked]), slopes)


@pytest.mark.parametrize("stem", first_cases(["stephenson-3-five-bar", "geared-five-bar", "crank-rocker"]))
def test_derivatives_of_many_designs_are_those_of_each(stem):
    """Some of which go to a dead point, or do not go together."""
    rng = np.random.default_rng(3)
    runs = planar.prepared(stem, 30)
    free = [name for name, value in runs.derivative_values.items() if value and name.endswith("length")]
    point = runs.points[-1]
    layer = make(point, 30, stem == "crank-rocker", stem, free)
    count = 24 if is_exhaustive() else 8
    values = layer.file_values * np.exp(0.2 * rng.normal(size=(count, len(free))))
    weights = rng.normal(size=(len(layer.orders), count, *layer.result_shape))
    found = layer.pull_back(values, weights)
    for design, each, slopes in zip(values, weights.swapaxes(0, 1), found, strict=True):
        of = {order: {point: one} for order, one in zip(layer.orders, each, strict=True)}
        told = runs.gradient(of, dict(zip(free, design.tolist(), strict=True))).derivatives
        wanted = np.array([told[name] for name in free])
        np.testing.assert_allclose(slopes, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())


def test_one_point_has_no_axis_of_points():
    assert make().result_shape == (25, 2)
    assert make(points=["A", "B"]).result_shape == (25, 2, 2)
    assert make().run(np.ones((0, 2)))[0][0].shape == (0, 25, 2)


@pytest.mark.parametrize(
    ("stem", "free", "sentence"),
    [
        ("crank-rocker", ["nothing"], "no derivative in a number 'nothing'"),
        ("crank-rocker", [], "name the numbers that are free"),
        ("gear-reducer", None, "cannot change alone"),
        ("measured-cam", None, "given points"),
    ],
)
def test_what_cannot_be_free_is_refused(stem, free, sentence):
    with pytest.raises(BadInput, match=sentence):
        make(None, 12, False, stem, free)


def test_values_have_one_for_each_free_number():
    with pytest.raises(BadInput, match=r"\(..., 2\) of crank.length, coupler.length"):
        make().check_shape((3, 4))


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_a_library_that_is_missing_is_named_with_its_extra(library, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, library, None)
    monkeypatch.delitem(sys.modules, f"planar.{library}", raising=False)
    with pytest.raises(BadInput, match=rf"planar-linkages\[{library}\]"):
        getattr(planar, library)
