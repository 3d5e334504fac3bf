"""Layers of JAX: jit, vmap, gradients, masks. Where it is not installed nothing is tried."""

import re

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.guide.topics import read_page

jax = pytest.importorskip("jax")

FREE = ["crank.length", "coupler.length"]


@pytest.fixture(autouse=True)
def _double():
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", False)


def make(**more):
    return planar.jax.Linkage("crank-rocker", free=FREE, points=["B"], steps=24, **more)


def test_single_precision_is_refused():
    linkage = make()
    with pytest.raises(BadInput, match="double precision"):
        linkage(linkage.file_values.astype("float32"))
    jax.config.update("jax_enable_x64", False)
    with pytest.raises(BadInput, match="jax_enable_x64"):
        make()


def test_positions_are_those_of_a_run():
    linkage = make()
    position, solved = jax.jit(linkage)(linkage.file_values)
    assert solved.all()
    np.testing.assert_array_equal(position, planar.prepared("crank-rocker", 24, "B")().position["B"])


@pytest.mark.parametrize("rates", [False, True])
def test_gradients_are_those_of_differences(rates):
    linkage = planar.jax.Linkage("slider-crank", ["crank.length", "O.velocity"], ["B", "E"], 6, rates=rates)
    rng = np.random.default_rng(1)
    values = np.asarray(linkage.file_values)
    weights = [rng.normal(size=(7, 2, 2)) / 10.0**k for k in range(3 if rates else 1)]

    def loss(values):
        return sum((w * each).sum() for w, each in zip(weights, linkage(values)[:-1], strict=True))

    found = jax.jit(jax.grad(loss))(values)
    for k in range(2):
        step = 1e-6 * np.eye(2)[k]
        slope = float(loss(values + step) - loss(values - step)) / 2e-6
        assert float(found[k]) == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_jit_and_vmap_go_over_it():
    linkage = make(rates=True)
    values = linkage.file_values * (1.0 + 0.01 * np.arange(5)[:, None])

    def loss(values):
        return sum((each**2).sum() for each in linkage(values)[:-1])

    for one, other in zip(jax.jit(jax.vmap(linkage))(values), linkage(values), strict=True):
        np.testing.assert_array_equal(one, other)
    each = np.stack([jax.grad(loss)(one) for one in values])
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.grad(loss)))(values), each, rtol=1e-12)
    slopes = jax.jacrev(lambda values: linkage(values)[0])(values[0])
    assert slopes.shape == (25, 2, 2)


def test_what_is_not_solved_is_masked_and_has_no_nan():
    linkage = make()
    values = np.array([[0.9, 0.1], [np.nan, 0.1], [0.15, 0.18]])
    position, solved = linkage(values)
    assert not solved[:2].any()
    assert 0 < solved[2].sum() < 25
    assert not np.asarray(position)[~np.asarray(solved)].any()
    slopes = jax.grad(lambda values: (linkage(values)[0] ** 2).sum())(values)
    assert np.isfinite(slopes).all()
    assert not slopes[:2].any()


def test_the_snippets_of_the_guide_run():
    snippets = re.findall(r"```py\n(.*?)```", read_page("design/gradients"), re.DOTALL)
    own = [each for each in snippets if "jax" in each]
    assert own
    for each in own:
        names = {"planar": planar}
        exec(each, names)
        assert names["slope"](names["linkage"].file_values).shape == (2,)
