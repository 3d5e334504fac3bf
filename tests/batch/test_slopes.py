"""Derivatives over sweeps: those of single motions, differences of sweeps, runs in time, stores, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput, PlanarError
from tests.draws import first_cases
from tests.known import MODELS

STEPS = 8
STEMS = [
    *("whitworth", "geared-five-bar", "double-butterfly", "planetary-differential", "oldham"),
    *sorted({*MODELS} - {"measured-cam"}),
]
"""First slides, wheels, a block without a closed form, several inputs, slots."""


def asked(mechanism):
    """A length, the input's position, a point, a link and a pair of a mechanism."""
    numbers = planar.dimensions(mechanism)
    lengths = [name for name in numbers if name.endswith((".length", ".distance", ".radius"))][:2]
    pair = mechanism.inputs[0].pair
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    return [*lengths, f"{pair}.position"], links[-1:], pair


@pytest.mark.parametrize("stem", first_cases(dict.fromkeys(STEMS), 5))
def test_they_are_those_of_a_single_motion(stem):
    mechanism = MODELS[stem]
    if not mechanism.inputs:
        return
    numbers, links, pair = asked(mechanism)
    try:
        whole = planar.cycle(mechanism, STEPS, pair=pair).inputs[pair].position
        begin = mechanism.inputs[0].position
        far = 0.3 * (whole.max() - begin) or -0.3 * (begin - whole.min())  # away from where the motion ends
        given, ends = {f"{pair}.position": [begin] * 2}, {"start": begin, "stop": begin + far, "pair": pair}
        motion = planar.cycle(mechanism, STEPS, **ends)
        swept = planar.sweep(mechanism, given, STEPS, links=links, pairs=[pair], derivatives=numbers, **ends)
    except PlanarError:
        return
    if not swept.whole.all() or motion.outcome is not planar.Outcome.SOLVED or len(motion) != STEPS + 1:
        return
    for name in numbers:
        for quantity, of in (("angle", links[0]), ("angular_velocity", links[0]), ("angular_acceleration", links[0])):
            expected = planar.sensitivity(motion, of).slopes[quantity][name]
            found = np.asarray(swept.derivatives[f"{quantity} of {of} by {name}"])[1]
            size = np.nanmax(np.abs(expected), initial=0.0)
            # a position of a sweep is another one's to rounding, which dead points near by magnify
            np.testing.assert_allclose(
                found, expected, rtol=1e-6, atol=1e-7 * size + 1e-12, err_msg=f"{quantity} {name}"
            )


def test_they_are_what_differences_of_sweeps_tend_to():
    numbers = {"AB.length": 0.03, "BC.length": 0.07}
    ends = {"start": 0.2, "stop": 1.4}
    model = MODELS["four-bar"]
    own = {name: planar.dimensions(model)[name] for name in numbers}
    found = planar.sweep(model, {name: [value] for name, value in own.items()}, 6, "E", derivatives=list(own), **ends)
    for name, value in own.items():
        errors = []
        for step in (2e-4 * value, 1e-4 * value):
            sides = planar.sweep(
                model,
                {**{each: [at] * 2 for each, at in own.items()}, name: [value - step, value + step]},
                6,
                "E",
                **ends,
            )
            for quantity in ("position", "velocity", "acceleration"):
                below, above = np.asarray(getattr(sides, quantity)["E"])
                exact = np.asarray(found.derivatives[f"{quantity} of E by {name}"])[0]
                errors.append(np.abs((above - below) / (2.0 * step) - exact).max() / np.abs(exact).max())
        for wide, narrow in zip(errors[:3], errors[3:], strict=True):
            assert narrow < 1e-6
            assert 3.5 < wide / narrow < 4.5


def test_of_points_they_are_vectors_over_all_designs_and_positions():
    name = "coupler.length"
    lengths = planar.dimensions("crank-rocker")[name] * np.linspace(0.99, 1.01, 7)
    swept = planar.sweep("crank-rocker", {name: lengths}, 12, derivatives=name, rates=False)
    assert {*swept.derivatives} == {f"position of {point} by {name}" for point in swept.points}
    one = np.asarray(swept.derivatives[f"position of B by {name}"])
    assert one.shape == (7, 13, 2)
    # along the designs they add up to the change of the place: Simpson's rule
    mid = (lengths[2] - lengths[0]) / 6.0 * (one[0] + 4.0 * one[1] + one[2])
    moved = np.asarray(swept.position["B"])
    np.testing.assert_allclose(mid, moved[2] - moved[0], atol=1e-5 * np.abs(mid).max())


def test_designs_that_end_have_none_beyond_and_those_at_a_dead_point_none():
    swept = planar.sweep("four-bar", {"BC.length": [0.02, 0.07]}, 24, "E", derivatives=["BC.length"])
    slopes, status = np.asarray(swept.derivatives["velocity of E by BC.length"]), np.asarray(swept.status)
    assert status.any()
    assert not np.isfinite(slopes[status != 0]).any()
    assert np.isfinite(slopes[status == 0]).all()


def test_in_a_run_in_time_they_are_those_of_its_motion():
    model = MODELS["stephenson-3-five-bar"] if "stephenson-3-five-bar" in MODELS else MODELS["geared-five-bar"]
    name = next(each for each in planar.dimensions(model) if each.endswith(".length"))
    value = planar.dimensions(model)[name]
    motion = planar.cycle(model, 10, duration=0.05)
    link = [each.name for each in model.links if each.name != model.frame][-1]
    swept = planar.sweep(model, {name: [value]}, 10, links=[link], derivatives=[name], duration=0.05)
    expected = planar.sensitivity(motion, link).slopes["angular_acceleration"][name]
    found = np.asarray(swept.derivatives[f"angular_acceleration of {link} by {name}"])[0]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("ending", [".zarr", ".parquet"])
def test_a_store_keeps_them(ending, tmp_path):
    designs = {"BC.length": [0.066, 0.07, 0.071]}
    given = {"steps": 4, "points": "E", "derivatives": ["AB.length"], "block": 2}
    here = planar.sweep("four-bar", designs, **given)
    there = planar.sweep("four-bar", designs, **given, store=tmp_path / f"s{ending}")
    for name, array in here.derivatives.items():
        np.testing.assert_array_equal(np.asarray(there.derivatives[name][:]), array)


def test_with_a_reduction_a_block_has_them_too():
    found = planar.sweep(
        "four-bar",
        {"BC.length": [0.066, 0.07]},
        4,
        "E",
        derivatives=["AB.length"],
        reduce={"most": lambda block: np.nanmax(np.abs(block.derivatives["position of E by AB.length"]), axis=(1, 2))},
    )
    assert found["most"].shape == (2,)
    assert (found["most"] > 0.0).all()


@pytest.mark.parametrize(
    ("model", "number", "told"),
    [
        ("four-bar", "BC.lenght", "did you mean 'BC.length'"),
        ("four-bar", "sketch.C.x", "nothing is derived in 'sketch.C.x'"),
        ("measured-cam", "cam.length", "derivatives are not told of a mechanism with a cam of given points"),
    ],
)
def test_what_has_none_is_refused_in_a_sentence(model, number, told):
    pair = MODELS[model].inputs[0].pair
    with pytest.raises(BadInput, match=told):
        planar.sweep(model, {f"{pair}.position": [0.1]}, 4, derivatives=[number])
