"""A mechanism made ready to be run over and over gives what a sweep of one design gives."""

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import design_variables
from planar.foundation.errors import BadInput
from tests.builders import open_four_bar
from tests.draws import part
from tests.known import MODELS

RUNNING = [stem for stem, mechanism in MODELS.items() if len(mechanism.inputs) == 1]


def agree(found, swept, points):
    np.testing.assert_array_equal(found.status, np.asarray(swept.status)[0])
    for told, wanted, near in zip(
        found[:3], (swept.position, swept.velocity, swept.acceleration), (1e-12, 1e-9, 2e-7), strict=True
    ):
        for point in points:
            scale = max(1.0, np.nanmax(np.abs(wanted[point][0]), initial=0.0))
            np.testing.assert_allclose(told[point], wanted[point][0], atol=near * scale)


@pytest.mark.parametrize("stem", part(RUNNING, 12))
def test_a_run_of_a_model_is_that_of_a_sweep(stem):
    mechanism = MODELS[stem]
    at = mechanism.inputs[0]
    ready = planar.prepared(mechanism, 40, start=at.position, stop=at.position + 0.2)
    swept = planar.sweep(mechanism, {f"{at.pair}.position": at.position}, 40, start=at.position, stop=at.position + 0.2)
    agree(ready(), swept, ready.points)
    agree(ready(), swept, ready.points)


def test_dimensions_change_from_run_to_run():
    mechanism = MODELS["crank-rocker"]
    ready = planar.prepared(mechanism, 60)
    name = next(name for name in design_variables(mechanism) if name.endswith(".length"))
    value = design_variables(mechanism)[name].value
    for factor in (1.0, 1.02, 0.99, 1.02):
        agree(ready({name: factor * value}), planar.sweep(mechanism, {name: [factor * value]}, 60), ready.points)
    agree(ready(), planar.sweep(mechanism, {name: [value]}, 60), ready.points)


def test_parts_of_a_result_that_are_kept_stay_as_they_are():
    mechanism = MODELS["crank-rocker"]
    ready = planar.prepared(mechanism, 60)
    name = next(name for name in design_variables(mechanism) if name.endswith(".length"))
    value, point = design_variables(mechanism)[name].value, ready.points[-1]
    designs = [{name: (1.0 + 1e-4 * k) * value} for k in range(50)]
    # an array, a column of one, a buffer and a result, of which the rest is let go
    kept = [(k, ready(design).velocity[point]) for k, design in enumerate(designs)]
    columns = [ready(design).velocity[point][:, 0] for design in designs]
    buffers = [memoryview(ready(design).velocity[point]) for design in designs]
    orders = [ready(design).velocity for design in designs]
    for k, array in kept:
        swept = planar.sweep(mechanism, {name: [designs[k][name]]}, 60, point).velocity[point][0]
        for same in (array, np.asarray(buffers[k]), orders[k][point]):
            np.testing.assert_allclose(same, swept, rtol=0.0, atol=1e-9 * np.abs(swept).max())
        np.testing.assert_array_equal(columns[k], array[:, 0])


def test_a_design_that_stops_says_so():
    mechanism = MODELS["crank-rocker"]
    ready = planar.prepared(mechanism, 60)
    crank = mechanism.links[1].name + ".length"
    long = 3.0 * design_variables(mechanism)[crank].value
    found, swept = ready({crank: long}), planar.sweep(mechanism, {crank: [long]}, 60)
    assert found.status[-1] != 0
    assert found.remarks == swept.remarks
    agree(found, swept, ready.points)


def test_positions_between_which_a_dead_point_lies_are_not_told():
    # at every step the rocker could be there, but the crank cannot get across from one to the other
    mechanism = open_four_bar(0.4999, 0.8, 0.7, 1.0)
    ready, swept = (
        planar.prepared(mechanism, 13),
        planar.sweep(mechanism, {"AB.length": [0.4999]}, 13),
    )
    agree(ready(), swept, ready.points)


def test_a_name_that_is_not_there_is_refused():
    with pytest.raises(BadInput, match="no such dimension"):
        planar.prepared(MODELS["crank-rocker"])({"nothing": 1.0})
    with pytest.raises(BadInput, match="whole number of steps"):
        planar.prepared(MODELS["crank-rocker"], 0)
