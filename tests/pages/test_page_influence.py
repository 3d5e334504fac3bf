"""What a page tells of each dimension's influence, and the bands that it draws by it, against Python's derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import planar
from planar.analysis.tolerance.spread import LinearSpread
from planar.analysis.tolerance.variations import find_variations
from planar.foundation.errors import NoAnswer, PlanarError
from tests.known import MODELS
from tests.page_scripts import PAGE_STEMS, in_node, needs_node

SCRIPTS = ("layers/ink.js", "solve/slopes.js", "controls/influence.js", "layers/bands.js")
STEMS = ("four-bar", "whitworth", "geared-five-bar", "double-butterfly", "klann-leg")
SLOPES = """
  const slopes = new DesignSlopes(page), sides = slopes.sides(page.linkage.z, page.linkage.u), found = {};
  for (const name of Object.keys(page.data.points)) found[name] = DesignSlopes.ofPoint(page, sides, name);
  return { points: found, names: page.data.dimensions.map(({ name }) => name) };
"""
CLOSE = 2e-7
"""Beside the greatest slope: what a difference of 1e-5 of the size leaves."""


@needs_node
def test_a_points_slopes_by_every_dimension_are_those_that_python_has():
    stems = sorted({*STEMS, *PAGE_STEMS})
    told, compared = in_node({stem: MODELS[stem] for stem in stems}, SLOPES, *SCRIPTS), 0
    for stem, found in told.items():
        mechanism = MODELS[stem]
        try:
            state = planar.solve(mechanism)
        except NoAnswer:
            continue
        for point, by_dimension in [*found["points"].items()][-2:]:
            try:
                slopes = planar.sensitivity(state, point).slopes["position"]
            except PlanarError:
                continue
            for name, own in zip(found["names"], by_dimension, strict=True):
                if own is None or name not in slopes or not np.isfinite(slopes[name]).all():
                    continue
                size = max(1.0, *np.abs([*map(np.ravel, slopes.values())]).ravel())
                np.testing.assert_allclose(
                    own, np.ravel(slopes[name]), rtol=0, atol=CLOSE * size, err_msg=f"{stem} {point} {name}"
                )
                compared += 1
    assert compared > 150


@needs_node
def test_the_corners_of_a_band_are_the_farthest_deviations():
    rng = np.random.default_rng(3)
    slopes, ends = rng.normal(size=(1, 2, 7)), np.sort(rng.normal(size=(7, 2)), axis=1)
    none = np.zeros
    linear = LinearSpread(slopes, ends[:, 0], ends[:, 1], none((1, 2, 0, 2)), none((1, 0)), none((1, 2)), sigmas=3.0)
    act = f"return deviations({slopes[0].T.tolist()}, {ends.tolist()});"
    found = in_node({"": MODELS["four-bar"]}, act, *SCRIPTS)[""]
    corners = linear.boundary(len(found["worst"]))[0]
    np.testing.assert_allclose(found["worst"], corners, atol=1e-12)
    np.testing.assert_allclose(found["most"], np.hypot(*corners.T).max(), rtol=1e-12)
    covariance = linear.variances.sum(axis=0)[0]
    off = np.array(found["likely"]) - linear.middle[0]
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance), off), 9.0, rtol=1e-9)


@needs_node
def test_a_hull_holds_all_points_and_turns_one_way():
    points = np.random.default_rng(4).normal(size=(40, 2))
    hull = np.array(in_node({"": MODELS["four-bar"]}, f"return convexHull({points.tolist()});", *SCRIPTS)[""])
    sides = np.roll(hull, -1, axis=0) - hull
    assert (sides[:, 0] * np.roll(sides[:, 1], -1) - sides[:, 1] * np.roll(sides[:, 0], -1) > 0.0).all()
    away = points[:, None] - hull
    assert (sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0] >= -1e-12).all()


WORST = """
  [...document.querySelectorAll(".influence tbody tr:last-child td")].slice(0, 2)
    .map(({ dataset }) => JSON.parse(dataset.si))
"""


def test_the_table_and_the_band_follow_the_files_tolerances_or_one_of_them_all(shown):
    mechanism = MODELS["hoeken-straight-line"]
    window = shown(mechanism)
    band = planar.tolerance(planar.solve(mechanism), "P")
    low, high = band.linear.limits()
    np.testing.assert_allclose(window.evaluate(WORST), np.transpose([low[0], high[0]]), rtol=1e-6)
    window.get_by_label("Tolerance bands").check()
    window.wait_for_selector("path.band.worst")
    motion = planar.tolerance(planar.cycle(mechanism, 120), "P")
    told = window.locator("#layers .notes").inner_text()
    assert f"P {1e3 * motion.worst.max():.3g} mm" in told, told
    window.get_by_label("Every dimension may be off by").fill("0.1")
    every = {each.number: 1e-4 for each in find_variations(mechanism, None).numbers}
    zeros = dict.fromkeys(("frame.O.x", "frame.O.y", "frame.C.y"), 0.0001)
    band = planar.tolerance(planar.solve(mechanism), "P", tolerances=every | zeros)
    low, high = band.linear.limits()
    np.testing.assert_allclose(window.evaluate(WORST), np.transpose([low[0], high[0]]), rtol=1e-6)


def test_without_tolerances_a_page_says_where_to_give_them(shown):
    window = shown(replace(MODELS["four-bar"], tolerances=None))
    window.get_by_label("Tolerance bands").check()
    assert "by how much they may be off" in window.locator("#layers .notes").inner_text()
    assert window.locator(".influence tbody tr").count() == window.evaluate("page.data.dimensions.length")
