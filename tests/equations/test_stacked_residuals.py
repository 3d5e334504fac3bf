"""Residuals of pairs that are computed together are those of every pair by itself."""

import numpy as np
import pytest

import planar
from benchmarks import chain
from planar.equations import stacked_residuals
from planar.equations.mechanism_numbers import shapes_of_links
from planar.equations.residuals import residuals
from planar.equations.stacked_residuals import StackedResiduals
from planar.foundation.geometry import GROUND, frame_at, frame_term_sizes
from planar.foundation.jets import Jet, term_sizes
from planar.model.mechanism import relative_motions
from tests.known import MODELS

SAMPLES = 3


def random_arguments(mechanism, motions, kind):
    """Frames, own coordinates, numbers and positions of inputs at random: floats, arrays (samples,), jets of these."""
    rng = np.random.default_rng(7)

    def value():
        parts = rng.uniform(0.2, 3.0, (3, SAMPLES))
        return {"float": float(parts[0, 0]), "array": parts[0], "jet": Jet(*parts), "float jet": Jet(*parts[:, 0])}[
            kind
        ]

    moving = [link.name for link in mechanism.links if link.name != mechanism.frame]
    frames = {mechanism.frame: GROUND} | {link: frame_at(value(), value(), value()) for link in moving}
    own = {pair.name: [value() for _ in pair.coordinate_kinds] for pair in mechanism.pairs}
    shapes = shapes_of_links(mechanism)
    pairs = [*mechanism.pairs, *(motions[given.pair] for given in mechanism.inputs)]
    numbers = {pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in pairs}
    return frames, own, numbers, [value() for _ in mechanism.inputs]


def assert_equal_to_single_pairs(mechanism, kind):
    motions = relative_motions(mechanism)
    frames, own, numbers, u = random_arguments(mechanism, motions, kind)
    together = StackedResiduals(mechanism, motions)
    coordinates = together.stack(frames, own, u)
    assert_rows_equal(
        together.evaluate(coordinates, numbers), [value for _, value in residuals(mechanism, frames, numbers, own, u)]
    )
    if "jet" in kind:
        sizes = {
            name: frame if frame.fixed else frame_term_sizes(*(term_sizes(frame[part]) for part in (0, 1, 4)))
            for name, frame in frames.items()
        }
        own_sizes = {name: [term_sizes(value) for value in values] for name, values in own.items()}
        single = residuals(mechanism, sizes, numbers, own_sizes, [term_sizes(value) for value in u])
        assert_rows_equal(together.evaluate(coordinates.term_sizes(), numbers), [value for _, value in single])


def assert_rows_equal(together, single):
    orders = len(together.parts) if isinstance(together, Jet) else 1
    for order in range(orders):
        rows = together.parts[order] if isinstance(together, Jet) else together
        assert len(rows) == len(single)
        for row, value in zip(rows, single, strict=True):
            expected = value.parts[order] if isinstance(value, Jet) else value if order == 0 else 0.0
            np.testing.assert_allclose(row, np.broadcast_to(expected, row.shape), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("kind", ["float", "array", "jet", "float jet"])
def test_residuals_of_all_models_are_those_of_single_pairs(kind):
    for name in MODELS:
        assert_equal_to_single_pairs(planar.load(name), kind)


def test_pairs_that_exceed_the_largest_array_are_computed_in_parts(monkeypatch):
    mechanism = planar.from_dict(chain.document(20))
    monkeypatch.setattr(stacked_residuals, "MAX_STACKED_NUMBERS", 2 * SAMPLES)
    assert_equal_to_single_pairs(mechanism, "array")


def test_equal_pairs_are_computed_by_one_formula():
    """Pins of a row: between the frame and a link, and between two links; the input is the third formula."""
    mechanism = planar.from_dict(chain.document(20))
    groups = stacked_residuals._make_groups(
        mechanism.pairs,
        tuple(relative_motions(mechanism)[given.pair] for given in mechanism.inputs),
        tuple(link.name for link in mechanism.links if link.name != mechanism.frame),
    )
    assert sorted(len(group.names) for group in groups) == [1, 10, 18]
