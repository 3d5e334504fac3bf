"""A position by itself and as a row of a motion: the same is said of both."""

from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Input
from planar.solving.prepared_mechanism import PreparedMechanism
from tests.builders import bare_four_bar
from tests.draws import part


def tiller_driven(degrees):
    """Rapson's slide, driven at the tiller: at 0 deg its line becomes parallel to the carriage's."""
    return replace(planar.load("rapsons-slide"), inputs=(Input("O", np.radians(degrees), 1.0, 0.0, None),))


@pytest.mark.parametrize("degrees", [1e-3, 1e-4])
def test_where_lines_become_parallel_a_row_without_rates_says_what_the_position_says(degrees):
    with pytest.raises(NoAnswer) as problem:
        planar.solve(tiller_driven(degrees))
    assert problem.value.outcome is Outcome.DEAD_POINT
    motion = planar.cycle(tiller_driven(45.0), 2, start=np.radians(10.0), stop=np.radians(degrees))
    assert np.isnan(motion.point("K").velocity).any(axis=1).tolist() == [False, False, True]
    assert f"1 row without rates: {problem.value.reason}" in motion.remarks


def test_where_both_have_rates_nothing_is_said():
    motion = planar.cycle(tiller_driven(45.0), 2, start=np.radians(10.0), stop=np.radians(0.1))
    assert not any("rates" in remark for remark in motion.remarks)
    position = planar.solve(tiller_driven(0.1))
    assert motion.point("K").velocity[-1] == pytest.approx(position.point("K").velocity, rel=1e-6)


@pytest.mark.parametrize("noise", [-9.9e-33, 1e-15, -0.0])
def test_rounding_noise_in_a_position_of_the_input_is_printed_as_0(noise):
    setup = PreparedMechanism(planar.load("four-bar"))
    pair = setup.mechanism.inputs[0].pair
    assert setup.describe_input(pair, noise) == f"{pair} = 0 deg"
    assert setup.describe_input(pair, 1e-9) != f"{pair} = 0 deg"


@pytest.mark.parametrize("short_of_it", part([1e-3, 1e-5, 1e-6], 1, 1))
def test_next_to_a_dead_point_a_singular_assembly_is_not_refused_for_what_rounding_leaves_open(short_of_it):
    # OA and OB near the line OP: the assembly nearest to the sketch has A on B, and QA and QB turn freely about it
    mechanism = planar.load("peaucellier-lipkin")
    (limit, *_) = (each.input for each in planar.cycle(mechanism, 4).limits if each.kind == "input dead point")
    at = limit + np.radians(short_of_it) * -np.sign(limit)
    with pytest.raises(NoAnswer) as problem:
        planar.solve(replace(mechanism, inputs=(Input("C", at, 1.0, 0.0, None),)))
    assert problem.value.outcome is Outcome.TOO_FEW_INPUTS
    assert planar.solve(mechanism, {"C": at}).residual < 1e-13


@pytest.mark.parametrize("beyond", [-1e-10, 0.0, 1e-10])
def test_within_rounding_of_a_dead_point_it_is_one_on_either_side(beyond):
    a, b, c, d = 0.08, 0.05, 0.06, 0.1
    limit = np.arccos((a * a + d * d - (b + c) ** 2) / (2.0 * a * d))
    linkage = bare_four_bar(a, b, c, d, limit + np.radians(beyond))
    with pytest.raises(NoAnswer) as problem:
        planar.solve(linkage)
    assert problem.value.outcome is Outcome.DEAD_POINT
