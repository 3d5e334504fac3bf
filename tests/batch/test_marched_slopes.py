"""Derivatives that machine code tells beside a march are those by the places of links, wherever a design comes."""

from __future__ import annotations

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import design_variables
from planar.batch.named_results.design_slopes import DesignSlopes
from planar.derivatives.design_equations import design_equations
from planar.derivatives.result_slopes import tied_dimensions
from planar.foundation.errors import PlanarError
from tests.draws import first_cases
from tests.known import MODELS

STEMS = [
    *("whitworth", "double-butterfly", "tangent-cam", "sun-and-planet"),
    *(stem for stem, mechanism in sorted(MODELS.items()) if len(mechanism.inputs) == 1),
]
"""First slides, a block without a closed form, a cam, wheels."""


def both_ways(monkeypatch, mechanism, designs, steps, **asked):
    """A sweep with derivatives as it comes, and with those by the places of links alone."""
    quick = planar.sweep(mechanism, designs, steps, **asked)
    with monkeypatch.context() as patched:
        patched.setattr(DesignSlopes, "march_block", lambda *given: None)
        return quick, planar.sweep(mechanism, designs, steps, **asked)


def assert_alike(quick, general, allowed=1e-12):
    """Alike beside the greatest of each quantity by any number, and told at the same positions."""
    assert [*quick.derivatives] == [*general.derivatives]
    sizes: dict[str, float] = {}
    for name, wanted in general.derivatives.items():
        what = name.split(" by ")[0]
        sizes[what] = max(sizes.get(what, 0.0), np.nanmax(np.abs(np.asarray(wanted)), initial=0.0))
    for name, wanted in general.derivatives.items():
        size = sizes[name.split(" by ")[0]]
        np.testing.assert_allclose(
            np.asarray(quick.derivatives[name]), np.asarray(wanted), rtol=allowed, atol=allowed * size, err_msg=name
        )


def lengths_of(mechanism):
    """Two of its lengths that can change alone."""
    bound = tied_dimensions(mechanism)
    return [name for name in planar.dimensions(mechanism) if name.endswith(".length") and name not in bound][:2]


def random_designs(mechanism, rng, spread=0.05, many=12):
    """Values of up to six lengths about those of the file."""
    known = design_variables(mechanism)
    names = [name for name, each in known.items() if each.link and each.kind == "length"][:6]
    names = names or [f"{mechanism.inputs[0].pair}.position"]
    return {name: known[name].value * (1.0 + spread * rng.normal(size=many)) for name in names}


@pytest.mark.parametrize("stem", first_cases(dict.fromkeys(STEMS), 4))
def test_they_are_those_by_the_places_of_links(stem, monkeypatch):
    mechanism, rng = MODELS[stem], np.random.default_rng(7)
    try:
        numbers = rng.permutation(design_equations(mechanism).names)[:3].tolist()
    except PlanarError:
        return
    links = [link.name for link in mechanism.links if link.name != mechanism.frame][-2:]
    asked = {"links": links, "pairs": [mechanism.inputs[0].pair], "derivatives": numbers}
    designs = random_designs(mechanism, rng)
    assert_alike(*both_ways(monkeypatch, mechanism, designs, 60, **asked), 1e-10)


@pytest.mark.parametrize("stem", first_cases(["crank-rocker", "stephenson-3-five-bar"]))
def test_away_from_dead_points_they_agree_to_twelve_digits(stem, monkeypatch):
    mechanism, rng = MODELS[stem], np.random.default_rng(3)
    points = planar.prepared(mechanism, 12, rates=False).points[-1:]
    numbers = rng.permutation(design_equations(mechanism).names)[:4].tolist()
    asked = {"points": points, "derivatives": numbers}
    assert_alike(*both_ways(monkeypatch, mechanism, random_designs(mechanism, rng, 0.001), 60, **asked))


def test_more_numbers_than_one_function_takes_come_in_parts(monkeypatch):
    numbers = [name for name in planar.dimensions("klann-leg") if name.endswith((".length", ".x", ".y"))][:10]
    asked = {"points": ["foot"], "derivatives": numbers, "rates": False}
    assert_alike(*both_ways(monkeypatch, MODELS["klann-leg"], {numbers[0]: [0.1, 0.1001]}, 24, **asked))


def test_where_machine_code_does_not_tell_them_they_follow_from_places(monkeypatch):
    """Slides between limits of their own, and single precision."""
    whole = {"points": ["B"], "derivatives": ["crank.length"]}
    designs = {"coupler.length": [0.17, 0.18, 0.19]}
    found = planar.sweep("crank-rocker", designs, 24, **whole, dtype="float32")
    assert_alike(found, planar.sweep("crank-rocker", designs, 24, **whole), 1e-6)
    for steps in (2, 3):
        assert_alike(*both_ways(monkeypatch, MODELS["crank-rocker"], designs, steps, **whole))
    slide = MODELS["tipper"]
    found = planar.sweep(
        slide, {f"{slide.inputs[0].pair}.position": [slide.inputs[0].position]}, 12, derivatives=lengths_of(slide)
    )
    for name, each in found.derivatives.items():
        assert np.isfinite(np.asarray(each)[np.asarray(found.status) == 0]).all(), name


def test_numbers_that_cannot_change_alone_have_none_beside_those_that_can(monkeypatch):
    asked = {"points": ["E", "N"], "derivatives": ["mesh.radii.0", "wheel.E.distance", "arm.length"]}
    designs = {"wheel.E.distance": [0.02, 0.03]}
    quick, general = both_ways(monkeypatch, MODELS["cardan-gears"], designs, 90, **asked)
    assert_alike(quick, general)
    assert np.isnan(np.asarray(quick.derivatives["position of E by mesh.radii.0"])).all()
    assert np.isfinite(np.asarray(quick.derivatives["position of E by wheel.E.distance"])).all()
