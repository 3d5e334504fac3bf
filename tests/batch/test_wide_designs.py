"""Designs drawn from a wide box, many of which cannot be assembled or cannot turn: in the lanes as by themselves."""

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import DesignRun
from planar.batch.reference_design import reference_design
from planar.document.dimensions import link_lengths
from planar.foundation.errors import Outcome
from tests.builders import four_bar
from tests.draws import first_cases
from tests.known import MODELS

CODES = tuple(Outcome)
STEPS, FIRST = 60, 0.8
CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.9, 0.7, 1.0


def wide_designs(mechanism, spread, many, seed):
    """Lengths of all links, each times a number that is often near to one and sometimes far."""
    rng = np.random.default_rng(seed)
    lengths = link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
    return {each.name: each.value * np.exp(spread * rng.uniform(-1.0, 1.0, many)) for each in lengths if each.value}


def agrees_with_general_path(mechanism, designs, steps, **more):
    """A sweep, whose every status and number is what the general path says of the design."""
    swept, base = planar.sweep(mechanism, designs, steps, **more), reference_design(mechanism, None)
    for index in range(len(swept)):
        own = with_design_values(base.mechanism, values_of_design(designs, index))
        row = np.broadcast_to(swept.input, swept.status.shape)[index]
        grid = None if base.is_sliding else row
        alone = DesignRun(own, base.pair, grid, steps).solve(swept.points, swept.velocity is not None)
        assert alone.status.tolist() == swept.status[index].tolist(), (index, alone.message)
        orders = [each for each in (swept.position, swept.velocity, swept.acceleration) if each is not None]
        found = np.hstack([order[name][index] for order in orders for name in swept.points])
        scale = np.nanmax(np.abs(alone.out), axis=0, initial=base.unit)
        np.testing.assert_allclose(found / scale, alone.out / scale, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(swept.input[index] if grid is None else row, alone.input, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(swept.dead_point[index], alone.dead_point, rtol=0.0, atol=1e-10)
    return swept


@pytest.mark.parametrize(
    "name, spread",
    first_cases(
        [
            ("crank-and-slotted-lever", 0.5),
            ("watt-six-bar", 0.3),
            ("slider-crank", 0.9),
            ("crank-rocker", 0.4),
            ("elliptical-trammel", 0.6),
        ],
        3,
    ),
)
def test_wide_designs_are_what_the_general_path_finds(name, spread):
    agrees_with_general_path(MODELS[name], wide_designs(MODELS[name], spread, 8, 2), STEPS, rates=name[0] != "w")


def random_four_bars(many):
    a, b, c, d = np.random.default_rng(0).uniform(0.2, 1.5, (4, many))
    return (a, b, c, d), {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": d}


def four_bar_by_closed_form(a, b, c, d, steps):
    """Whether each comes to each crank angle, where its pin C is, and where its crank has its first dead point."""
    theta = FIRST + np.linspace(0.0, 2.0 * np.pi, steps + 1)
    limits = [(a * a + d * d - (b + sign * c) ** 2) / (2.0 * a * d) for sign in (1.0, -1.0)]
    with np.errstate(invalid="ignore"):
        angles = [turn + sign * np.arccos(limit) for limit in limits for sign in (1.0, -1.0) for turn in (0, 2 * np.pi)]
        dead = np.fmin.reduce([np.where(angle > FIRST, angle, np.nan) for angle in angles])
        pin = a[:, None, None] * np.stack([np.cos(theta), np.sin(theta)], axis=-1)
        across = np.stack([d, 0.0 * d], axis=-1)[:, None] - pin
        square = np.sum(across**2, axis=2)
        along = (b[:, None] ** 2 - c[:, None] ** 2 + square) / (2.0 * square)
        height = np.sqrt(b[:, None] ** 2 / square - along**2)
        left = np.stack([-across[..., 1], across[..., 0]], axis=-1)
        points = [pin + along[..., None] * across + sign * height[..., None] * left for sign in (1.0, -1.0)]
    sketch = np.array([0.9, 0.7])
    nearer = np.sum((points[0][:, :1] - sketch) ** 2, axis=2) <= np.sum((points[1][:, :1] - sketch) ** 2, axis=2)
    comes = np.isfinite(points[0][:, :1, 0]) & ~(theta > np.where(np.isnan(dead), np.inf, dead)[:, None])
    return comes, np.where(nearer[..., None], *points), dead


def test_random_four_bars_are_refused_where_they_cannot_turn_and_told_where():
    lengths, designs = random_four_bars(3000)
    mechanism = four_bar(CRANK, COUPLER, ROCKER, GROUND, FIRST)
    mechanism = planar.from_dict(planar.to_dict(mechanism) | {"sketch": {"C": [0.9, 0.7]}})
    found = planar.sweep(mechanism, designs, 200, "C", rates=False)
    comes, pin, dead = four_bar_by_closed_form(*lengths, 200)
    assert np.array_equal(found.status == 0, comes)
    assert np.array_equal(np.isfinite(found.position["C"][..., 0]), comes)
    assert np.abs(found.position["C"] - pin)[comes].max() < 1e-9
    ends = comes[:, 0] & ~comes[:, -1]
    assert set(np.unique(found.status[~comes[:, 0]])) == {CODES.index(Outcome.CANNOT_BE_ASSEMBLED)}
    assert set(found.status[ends, -1]) == {CODES.index(Outcome.DEAD_POINT)}
    assert np.array_equal(np.isfinite(found.dead_point), ends)
    np.testing.assert_allclose(found.dead_point[ends], dead[ends], rtol=0.0, atol=1e-9)
    assert found.general < 0.01 * comes.sum()


def test_dead_points_of_several_blocks_are_the_same_by_closed_forms_and_along_the_curves(monkeypatch):
    designs = wide_designs(MODELS["watt-six-bar"], 0.15, 40, 4)
    found = planar.sweep(MODELS["watt-six-bar"], designs, STEPS, rates=False)
    monkeypatch.setattr("planar.batch.block.closed_form_designs", lambda *_: None)
    followed = planar.sweep(MODELS["watt-six-bar"], designs, STEPS, rates=False)
    assert np.array_equal(found.status, followed.status)
    assert np.count_nonzero(np.isfinite(found.dead_point)) > 5
    np.testing.assert_allclose(found.dead_point, followed.dead_point, rtol=0.0, atol=1e-9)


def test_ranges_of_different_lengths_and_starts_far_off():
    mechanism = four_bar(CRANK, COUPLER, ROCKER, GROUND, FIRST)
    designs = wide_designs(mechanism, 0.3, 10, 5)
    far = agrees_with_general_path(mechanism, designs, 24, start=-1.5, stop=2.5)
    assert {0, CODES.index(Outcome.DEAD_POINT)} <= set(far.status[:, 0].tolist())
    designs["A.position"] = np.linspace(0.5, 1.5, 10)
    own = agrees_with_general_path(mechanism, designs, 24, stop=1.0)
    assert own.input.shape == (10, 25)
    assert own.general == 0
    none = planar.sweep(mechanism, {"BC.length": [0.01, 0.011]}, 24, start=-1.5)
    assert np.all(none.status == CODES.index(Outcome.CANNOT_BE_ASSEMBLED))


def test_sentences_are_made_when_they_are_read(monkeypatch):
    asked, solve = [], DesignRun.solve

    def counted(*arguments):
        asked.append(arguments)
        return solve(*arguments)

    monkeypatch.setattr(DesignRun, "solve", counted)
    found = planar.sweep(four_bar(CRANK, COUPLER, ROCKER, GROUND, FIRST), random_four_bars(100)[1], 200, rates=False)
    assert not asked
    dead, open_ = found.remarks[::-1]
    assert len(asked) == 2
    assert "dead point (the first: " in dead
    assert "cannot be assembled (the first: " in open_
    assert found.remarks == (open_, dead)
    assert len(asked) == 2


@pytest.mark.parametrize("ending, library", [("zarr", "zarr"), ("parquet", "pyarrow")])
def test_stores_tell_where_designs_end(tmp_path, ending, library):
    pytest.importorskip(library)
    mechanism, designs = four_bar(CRANK, COUPLER, ROCKER, GROUND, FIRST), random_four_bars(40)[1]
    wanted = planar.sweep(mechanism, designs, 30, "E", rates=False)
    for _ in range(2):
        found = planar.sweep(mechanism, designs, 30, "E", rates=False, block=16, store=tmp_path / f"sweep.{ending}")
        np.testing.assert_array_equal(np.asarray(found.dead_point), wanted.dead_point)
        assert found.remarks == wanted.remarks
