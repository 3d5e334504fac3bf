"""What a sweep tells beside points, and sweeps of any number of a file: as the cycle of every design has them."""

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.mechanism import relative_motions
from tests.builders import designs_around, four_bar
from tests.closed_forms import ROCKER
from tests.draws import part
from tests.known import MODELS

LINK_WORDS = ("angle", "angular_velocity", "angular_acceleration")
PAIR_WORDS = ("value", "value_rate", "value_second_rate")


def off(found, wanted):
    """How far rows are off what they should be, beside the greatest; NaN where these are."""
    np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted))
    return np.nanmax(np.abs(found - wanted), initial=0.0) / max(1.0, np.nanmax(np.abs(wanted), initial=0.0))


def motions(mechanism, designs, result, steps, pair):
    """Every design's own motion, with its number and how many of its rows were solved."""
    for k in range(len(result)):
        changed = with_design_values(mechanism, values_of_design(designs, k))
        ends = () if result.input.ndim > 1 else (result.input[0], result.input[-1])
        try:
            motion = planar.cycle(changed, steps, *ends, pair=pair)
        except NoAnswer as problem:
            assert result.outcomes[result.status[k, 0]] is problem.outcome
            continue
        many = len(motion) - (motion.outcome is not Outcome.SOLVED)
        assert int(np.sum(result.status[k] == 0)) == many
        yield k, motion, many


SAME = {
    "four-bar": (four_bar(*ROCKER, 0.8), 0.3, 40),
    "in long steps": (four_bar(*ROCKER, 0.8), 0.3, 5),
    "six-bar of four unknowns at once": (MODELS["double-butterfly"], 0.01, 30),
    "quick return": (MODELS["004-QR"], 0.03, 30),
    "gears, and a slide": (MODELS["002-E3.6a"], 0.01, 30),
    "wheels in long steps": (MODELS["geared-five-bar"], 0.01, 4),
    "slides": (MODELS["elliptical-trammel"], 0.05, 20),
}


@pytest.mark.parametrize("name", part(SAME, 3))
def test_links_and_pairs_are_those_of_every_designs_motion(name):
    mechanism, spread, steps = SAME[name]
    designs, pair = designs_around(mechanism, spread, 4), mechanism.inputs[0].pair
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    pairs = list(relative_motions(mechanism))
    result = planar.sweep(mechanism, designs, steps, links=links, pairs=pairs, pair=pair)
    assert result.points == ()
    for k, motion, many in motions(mechanism, designs, result, steps, pair):
        for link in links:
            for word in LINK_WORDS:
                found = getattr(result, word)[link][k]
                assert np.all(np.isnan(found[many:]))
                assert off(found[:many], getattr(motion.link(link), word)[:many]) < 1e-9
        for each in pairs:
            for word, wanted in zip(PAIR_WORDS, motion.pair(each).values(), strict=False):
                assert off(getattr(result, word)[each][k][:many], wanted[:many]) < 1e-9


def test_results_are_told_with_points_and_without_rates():
    mechanism, lengths = four_bar(*ROCKER, 0.8), np.linspace(0.85, 0.95, 3)
    result = planar.sweep(mechanism, {"BC.length": lengths}, 40, "C", links="BC", pairs=["C"], rates=False)
    whole = planar.sweep(mechanism, {"BC.length": lengths}, 40, "C", links="BC", pairs=["C"])
    np.testing.assert_allclose(result.angle["BC"], whole.angle["BC"], atol=1e-12)
    np.testing.assert_allclose(result.value["C"], whole.value["C"], atol=1e-12)
    np.testing.assert_allclose(result.position["C"], whole.position["C"], atol=1e-12)
    assert result.angular_velocity == {}
    assert list(whole.value_rate) == ["C"]
    for more in ({"links": "XY"}, {"pairs": "XY"}, {"links": ["AD"]}):
        with pytest.raises(BadInput):
            planar.sweep(mechanism, {"BC.length": lengths}, 40, **more)


@pytest.mark.parametrize("suffix", ["zarr", "parquet"])
def test_a_store_has_all_results_and_is_of_one_request(suffix, tmp_path):
    pytest.importorskip({"zarr": "zarr", "parquet": "pyarrow"}[suffix])
    mechanism, designs = four_bar(*ROCKER, 0.8), {"BC.length": np.linspace(0.85, 0.95, 5)}

    def swept(store=None, **more):
        return planar.sweep(mechanism, designs, 20, "C", store=store, block=2, **{"links": "BC", "pairs": "C"} | more)

    store = tmp_path / f"sweep.{suffix}"
    wanted = swept()
    for _ in range(2):
        found = swept(store)
        for word, name in (("angle", "BC"), ("angular_acceleration", "BC"), ("value", "C"), ("position", "C")):
            np.testing.assert_array_equal(np.asarray(getattr(found, word)[name][:]), getattr(wanted, word)[name])
    with pytest.raises(BadInput, match="something else"):
        swept(store, links=["BC", "AB"])


@pytest.mark.parametrize("model", part(["slider-crank", "002-E3.6a", "four-bar", "band-drafting-machine"], 4))
def test_any_number_of_the_file_may_be_swept(model):
    mechanism = MODELS[model]
    given = mechanism.inputs[0]
    for dimension, value in planar.dimensions(mechanism).items():
        values = value + np.array([0.0, 0.003]) * (abs(value) or 0.05)
        result = planar.sweep(
            mechanism, {dimension: values}, 5, pair=given.pair, start=given.position, stop=given.position + 0.02
        )
        for k, motion, many in motions(mechanism, {dimension: values}, result, 5, given.pair):
            for point in result.points:
                assert off(result.acceleration[point][k][:many], motion.point(point).acceleration[:many]) < 1e-9
        assert result.general == (6 if dimension.startswith("sketch") else 0)


ACTING = {
    "loads": [
        {"point": "C", "force": [3.0, -2.0]},
        {"link": "DC", "torque": 0.4},
        {"point": "E", "force": [1.0, 0.5], "axes": "BC", "varies": {"with": "A", "at": [0.0, 7.0], "factors": [1, 2]}},
    ],
    "springs": [
        {"points": ["E", "D"], "stiffness": 40.0, "free_length": 0.05, "damping": 0.3},
        {"links": ["AD", "DC"], "stiffness": 0.2, "free_angle": 0.3},
    ],
    "masses": [
        {"link": "BC", "mass": 2.0, "at": [0.02, 0.01], "inertia": 0.01},
        {"link": "DC", "mass": 1.0, "at": "C"},
    ],
    "gravity": [0.0, -9.81],
}
"""What acts on the links of a four-bar."""


def loaded(name, acting):
    return files.from_dict(files.to_dict(MODELS[name]) | acting)


LOADED = {
    "four-bar": loaded("four-bar", ACTING),
    "slide": MODELS["two-stroke-engine"],
    "teeth": loaded("geared-five-bar", {"masses": [{"link": "AC", "mass": 2.0, "at": "C", "inertia": 0.001}]}),
    "balance": MODELS["balanced-lamp"],
    "friction": MODELS["toggle-clamp"],
}


@pytest.mark.parametrize("name", part(LOADED, 2))
def test_efforts_and_reactions_are_those_of_every_motion(name):
    mechanism = LOADED[name]
    pair = mechanism.inputs[0].pair
    rng, drawn = np.random.default_rng(3), planar.dimensions(mechanism)
    acts = {key: value for key, value in drawn.items() if value and not key.startswith(("sketch", "wheels"))}
    designs = {key: value * rng.uniform(0.99, 1.01, 3) for key, value in acts.items() if "radius" not in key}
    designs.pop(f"{pair}.position")
    inputs, pairs = [given.pair for given in mechanism.inputs], [each.name for each in mechanism.pairs]
    result = planar.sweep(mechanism, designs, 24, points=[], efforts=inputs, reactions=pairs, pair=pair, rates=False)
    for k, motion, many in motions(mechanism, designs, result, 24, pair):
        forces = planar.forces(motion)
        for each in inputs:
            assert off(result.effort[each][k][:many], forces.inputs[each][:many]) < 1e-9
        for each in pairs:
            assert off(result.reaction[each][k][:many], forces.reactions[each].force[:many]) < 1e-9
            assert off(result.reaction_couple[each][k][:many], forces.reactions[each].couple[:many]) < 1e-9


@pytest.mark.parametrize(
    ("model", "output"), part([("four-bar", "DC"), ("002-E3.4", "block D"), ("004-QR", "block R")], 2)
)
def test_transmission_angles_are_those_of_every_motion(model, output):
    mechanism = MODELS[model]
    designs, pair = designs_around(mechanism, 0.01, 3), mechanism.inputs[0].pair
    result = planar.sweep(mechanism, designs, 24, points=[], outputs=output, pair=pair)
    for k, motion, many in motions(mechanism, designs, result, 24, pair):
        wanted = planar.transmission(motion, output).angle
        assert off(result.transmission_angle[output][k][:many], wanted[:many]) < 1e-9
    with pytest.raises(BadInput):
        planar.sweep(mechanism, designs, 24, outputs=mechanism.links[1].name, pair=pair)


EVERY = {
    "wide four-bars": (four_bar(*ROCKER, 0.8), 0.5),
    "six-bar of dyads": (MODELS["stephenson-1-six-bar"], 0.05),
    "slides and gears": (MODELS["002-E3.6a"], 0.01),
    "six-bar of four unknowns at once": (MODELS["double-butterfly"], 0.02),
}


@pytest.mark.parametrize("name", part(EVERY, 2))
def test_all_assemblies_of_every_design_are_those_of_its_list(name):
    mechanism, spread = EVERY[name]
    designs, pair = designs_around(mechanism, spread, 4), mechanism.inputs[0].pair
    result = planar.sweep(mechanism, designs, 12, pair=pair, assemblies="all")
    assert len(result) == len(result.design) == len(result.assembly)
    for k in range(4):
        modes = planar.modes(with_design_values(mechanism, values_of_design(designs, k)), certify=False)
        rows = np.flatnonzero(result.design == k)
        assert list(result.assembly[rows]) == (list(range(1, len(modes) + 1)) or [0])
        for row, mode in zip(rows, modes, strict=False):
            ends = np.broadcast_to(result.input, result.status.shape)[row, [0, -1]]
            motion = planar.cycle(mode.mechanism, 12, *map(float, ends), pair=pair)
            many = len(motion) - (motion.outcome is not Outcome.SOLVED)
            assert int(np.sum(result.status[row] == 0)) == many
            for point in result.points:
                assert off(result.position[point][row][:many], motion.point(point).position[:many]) < 1e-9
    with pytest.raises(BadInput):
        planar.sweep(mechanism, designs, 12, pair=pair, assemblies="some")


def lawful(name, law):
    value = files.to_dict(MODELS[name])
    (given,) = value["inputs"]
    return files.from_dict(value | {"inputs": [given | {"law": law}]})


TIMED = {
    "two inputs at their speeds": (MODELS["pantograph"], 0.4, 0),
    "a speed that grows": (MODELS["four-bar"], 0.01, 39),
    "three inputs": (MODELS["excavator-arm"], 0.4, 0),
    "a law": (lawful("slider-crank", [{"motion": "cycloidal", "by": "90 deg", "in": 0.5}]), None, 39),
}


@pytest.mark.parametrize("name", part(TIMED, 3))
def test_several_inputs_run_in_time_as_in_a_cycle(name):
    mechanism, duration, general = TIMED[name]
    designs, links = designs_around(mechanism, 0.003, 3), [mechanism.links[1].name]
    result = planar.sweep(mechanism, designs, 12, duration=duration, links=links)
    points = planar.sweep(mechanism, designs, 12, duration=duration)
    assert points.general == general
    np.testing.assert_array_equal(result.input, np.linspace(0.0, duration or 0.5, 13))
    for k in range(3):
        motion = planar.cycle(with_design_values(mechanism, values_of_design(designs, k)), 12, duration=duration)
        many = len(motion) - (motion.outcome is not Outcome.SOLVED)
        assert int(np.sum(result.status[k] == 0)) == many
        for link in links:
            for word in LINK_WORDS:
                assert off(getattr(result, word)[link][k][:many], getattr(motion.link(link), word)[:many]) < 1e-9
        for point in points.points:
            assert off(points.acceleration[point][k][:many], motion.point(point).acceleration[:many]) < 1e-9
    for wrong in ({"duration": -1.0}, {"duration": 1.0, "stop": 2.0}):
        with pytest.raises(BadInput, match="duration"):
            planar.sweep(mechanism, designs, 12, **wrong)


def test_dead_points_are_those_of_triangles():
    a, b, c = np.array([0.9, 0.7, 0.3]), 0.8, np.array([0.5, 0.85, 0.9])
    designs = {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": 1.0}
    result = planar.sweep(four_bar(0.9, b, 0.5, 1.0, 0.8), designs, 60)
    # coupler and follower in one line, so long as that goes together with the crank and the base
    wanted = np.arccos((a**2 + 1.0 - (b + c) ** 2) / (2.0 * a), where=a + 1.0 > b + c, out=np.full(3, np.nan))
    np.testing.assert_allclose(result.dead_point, wanted, atol=1e-9)
