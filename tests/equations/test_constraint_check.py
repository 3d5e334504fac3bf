"""Constraints of pairs that are computed together are those of every pair by itself."""

import numpy as np
import pytest

import planar
from benchmarks import chain
from planar.equations import constraint_check
from planar.equations.coordinates import FRAME_PARTS
from planar.equations.mechanism_numbers import shapes_of_links
from planar.equations.residuals import closing_error, residuals
from planar.foundation.geometry import GROUND, frame_at, frame_term_sizes
from planar.foundation.jets import Jet, term_sizes, value_and_rates
from planar.model.mechanism import relative_motions
from tests.known import MODELS

SAMPLES = 3


def assert_equal_to_single_pairs(mechanism, orders, samples=SAMPLES):
    """At random coordinates with so many orders of rates, which no constraint holds."""
    rng = np.random.default_rng(7)
    moving = [link.name for link in mechanism.links if link.name != mechanism.frame]
    entries = [(link, part) for link in moving for part in FRAME_PARTS]
    entries += [(pair.name, part) for pair in mechanism.pairs for part, _ in pair.coordinate_kinds]
    column = {entry: k for k, entry in enumerate(entries)}
    motion = rng.uniform(0.2, 3.0, (orders, len(entries) + len(mechanism.inputs), samples))
    values = [Jet(*parts) if orders == 3 else parts[0] for parts in motion.transpose(1, 0, 2)]
    motions = relative_motions(mechanism)
    shapes = shapes_of_links(mechanism)
    pairs = [*mechanism.pairs, *(motions[given.pair] for given in mechanism.inputs)]
    numbers = {pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in pairs}
    p = np.array([number for pair in mechanism.pairs for number in numbers[pair.name]])
    frames = {link: frame_at(*(values[column[link, part]] for part in FRAME_PARTS)) for link in moving}
    frames[mechanism.frame] = GROUND
    own = {
        pair.name: [values[column[pair.name, part]] for part, _ in pair.coordinate_kinds]
        for pair in pairs[: len(mechanism.pairs)]
    }
    u = values[len(entries) :]
    evaluated = constraint_check.constraint_check(mechanism, len(entries)).evaluate(motion, p)
    for k, (row, value) in enumerate(residuals(mechanism, frames, numbers, own, u)):
        parts = list(value_and_rates(value)[:orders])
        parts[0] = closing_error(parts[0], row.kind)
        for together, alone in zip(evaluated.rows[:, k], parts, strict=True):
            np.testing.assert_allclose(together, np.broadcast_to(alone, (samples,)), rtol=1e-13, atol=1e-13)
    if orders == 1:
        return
    sizes = {
        name: frame if frame.fixed else frame_term_sizes(*(term_sizes(frame[part]) for part in (0, 1, 4)))
        for name, frame in frames.items()
    }
    own_sizes = {name: [term_sizes(value) for value in given] for name, given in own.items()}
    rows = residuals(mechanism, sizes, numbers, own_sizes, [term_sizes(value) for value in u])
    for k, (_, value) in enumerate(rows):
        expected = value.parts[1:] if isinstance(value, Jet) else (0.0, 0.0)
        for together, alone in zip(evaluated.sizes[:, k], expected, strict=True):
            np.testing.assert_allclose(together, np.broadcast_to(alone, (samples,)), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("orders", [1, 3])
def test_constraints_of_all_models_are_those_of_single_pairs(orders):
    for name in MODELS:
        assert_equal_to_single_pairs(planar.load(name), orders)


def test_one_position_is_as_many():
    for name in list(MODELS)[::8]:
        assert_equal_to_single_pairs(planar.load(name), 3, samples=1)


def test_pairs_that_exceed_the_largest_array_are_computed_in_parts(monkeypatch):
    mechanism = planar.from_dict(chain.document(20))
    monkeypatch.setattr(constraint_check, "MAX_STACKED_NUMBERS", 2 * SAMPLES)
    assert_equal_to_single_pairs(mechanism, 1)


def test_equal_pairs_are_computed_by_one_formula():
    """Pins of a row: between the frame and a link, and between two links; the input is the third formula."""
    mechanism = planar.from_dict(chain.document(20))
    groups = constraint_check.constraint_check(mechanism, 57).groups
    assert sorted(len(group.names) for group in groups) == [1, 10, 18]
