"""Wanted rows to the first order, and fits: against differences, closed forms, and scipy."""

import numpy as np
import pytest

import planar
from planar.derivatives.design_equations import design_equations
from planar.synthesis.catalogue import build_catalogue, draw_designs, follow_branches
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.fitting import moving_designs
from planar.synthesis.fitting.design_fit import DesignFit
from planar.synthesis.fitting.moving_designs import FitProblem, MovingDesigns
from planar.synthesis.task.starts import start_mechanisms

STARTS = [("four-bar", "E"), ("slider-crank", "E"), ("whitworth", "D"), ("klann-leg", "foot"), ("geared-five-bar", "P")]


def search(model, point, through=((0, 0), (0.1, 0.05), (0.2, 0.02)), **more):
    places = [[f"{x} m", f"{y} m"] for x, y in through]
    wanted = {"point": point, "through": places} | more
    task = planar.read_task({"planar": 1, "units": {"angle": "rad"}, "start": model, "wanted": [wanted]})
    return DesignSearch(task, next(start_mechanisms(task)))


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_designs_drawn_go_together_by_the_general_path(model, point):
    found = search(model, point)
    equations = found.equations[0]
    x, y = draw_designs(equations, found.free, 64, np.random.default_rng(1))
    assert len(x) > 12
    F, _ = equations.closure_at(x, y[:, None])
    assert np.abs(F).max(initial=0.0) < 1e-9


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_branches_keep_the_equations_and_rise(model, point):
    found = search(model, point)
    equations = found.equations[0]
    x, y = draw_designs(equations, found.free, 48, np.random.default_rng(2))
    unknowns, is_whole = follow_branches(equations, x, y)
    known = np.isfinite(unknowns).all(axis=2)
    F, _ = equations.closure_at(x, np.where(known[..., None], unknowns, 0.0))
    assert np.abs(F[known]).max(initial=0.0) < 1e-9
    for row, own in zip(unknowns, known, strict=True):
        assert (np.diff(row[own, -1]) > 0.0).all()
    turned = [np.ptp(row[own, -1]) for row, own in zip(unknowns[is_whole], known[is_whole], strict=True)]
    assert np.allclose(turned, 2.0 * np.pi, atol=5e-2)


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_rows_change_as_their_first_order_says(model, point):
    """A small change of the numbers, the unknowns moved with it: what is left of the rows falls with its square."""
    found = search(model, point)
    equations = found.equations[0]
    motion = planar.cycle(found.mechanism, 12)
    z, _ = equations.design.coordinates_at(motion)
    y = np.concatenate(
        [z[0], motion.inputs[found.mechanism.inputs[0].pair].position[:, None] / equations.input_scale], 1
    )
    y = y[1:4][None]
    x = (found.free.values / equations.scale)[None]
    from planar.synthesis.fitting.wanted_equations import tangents

    way = tangents(equations.jacobians(x, y))
    zeros = np.zeros((1, 0))
    line = equations.linearise(x, y, zeros, way)
    change = 1e-3 * np.random.default_rng(3).normal(size=x.shape)
    left = []
    for size in (1.0, 0.5):
        moved = y + line.own + np.einsum("cnyi,ci->cny", line.own_slopes, size * change)
        closed, is_closed = equations.close(x + size * change, moved, way, 8)
        assert is_closed.all()
        expected = line.residual + np.einsum("cnpi,ci->cnp", line.slopes, size * change)
        left.append(np.abs(equations.residuals(x + size * change, closed, zeros) - expected).max())
    assert left[0] < 1e-3
    assert left[1] < 0.3 * left[0] + 1e-13


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_a_path_of_the_start_is_found_back_from_changed_numbers(model, point):
    mechanism = planar.load(model)
    motion = planar.cycle(mechanism, 48)
    places = motion.point(point).position[:48:2]
    found = search(model, point, places.tolist())
    equations = found.equations[0]
    z, _ = equations.design.coordinates_at(planar.cycle(found.mechanism, 48))
    u = motion.inputs[mechanism.inputs[0].pair].position[:48:2, None] / equations.input_scale
    y = np.concatenate([z[0][:48:2], u], axis=1)
    factor = design_equations(mechanism).solver.unit / design_equations(found.mechanism).solver.unit
    x, y = found.moves.move(found.free.values / equations.scale, y, complex(factor), 0j)  # as large as the file says
    x = x * (1.0 + 0.01 * np.random.default_rng(4).normal(size=(6, len(x))))
    fit = DesignFit([equations], np.full(x.shape[1], -np.inf), np.full(x.shape[1], np.inf))
    best = fit.fit(x, [np.broadcast_to(y, (6, *y.shape)).copy()], [np.zeros((6, 0))], 2)
    assert np.sqrt(best.squares[0] / 24) < 1e-4
    off = np.linalg.norm(equations.values(best.numbers[:1], best.unknowns[0][:1])[0] * found.size - places, axis=1)
    assert off.max() < 1e-3 * found.size


@pytest.mark.parametrize(("model", "point"), [("four-bar", "E"), ("slider-crank", "E"), ("geared-five-bar", "P")])
def test_the_second_order_brings_designs_farther_in_as_many_steps(model, point, monkeypatch):
    places = planar.cycle(planar.load(model), 48).point(point).position[3:43:4]
    found = search(model, point, places.tolist())
    catalogue = found.catalogue(600, 5)
    starts = found._fit_starts(catalogue, found.matches(catalogue, 12))
    x, y = np.array([each.numbers for each in starts]), np.array([each.unknowns[0] for each in starts])
    scale = found.equations[0].scale
    problem = FitProblem(found.equations, found.free.lower / scale, found.free.upper / scale)
    squares = []
    for curved in (moving_designs.CURVED, np.inf):
        monkeypatch.setattr(moving_designs, "CURVED", curved)
        state = MovingDesigns(problem, x, [y.copy()], [np.zeros((len(x), 0))], None)
        state.run(25)
        squares.append(np.log10(state.squares[np.argsort(state.order)] + 1e-24))
    assert np.median(squares[0] - squares[1]) < -1e-3


def test_bounds_are_kept():
    mechanism = planar.load("four-bar")
    places = planar.cycle(mechanism, 24).point("E").position[:24]
    wanted = [{"point": "E", "through": [[f"{x} m", f"{y} m"] for x, y in places]}]
    limits = {"AB.length": ["20 mm", "27 mm"], "BC.length": ["50 mm", "60 mm"]}
    task = planar.read_task({"planar": 1, "start": "four-bar", "wanted": wanted, "within": limits})
    own = DesignSearch(task, next(start_mechanisms(task)))
    catalogue = build_catalogue(own.equations, own.free, 600)
    for each in own.fit(catalogue, own.matches(catalogue, 12), 6):
        assert 0.02 - 1e-12 <= each.numbers["AB.length"] <= 0.027 + 1e-12
        assert 0.05 - 1e-12 <= each.numbers["BC.length"] <= 0.06 + 1e-12


def test_a_design_of_the_catalogue_is_matched_to_its_own_path_wherever_it_lies():
    own = search("four-bar", "E")
    catalogue = build_catalogue(own.equations, own.free, 300)
    for design in np.flatnonzero(catalogue.is_whole)[:4]:
        curve = catalogue.values[0][design]
        curve = curve[np.isfinite(curve[:, 0])] * own.size
        turned = curve @ np.array([[0.6, 0.8], [-0.8, 0.6]]) * 2.0 + 0.3
        moved = search("four-bar", "E", turned[:-1:6].tolist(), closed=True)
        again = build_catalogue(moved.equations, moved.free, 300)
        best = moved.matches(again, 3)[0]
        assert best.design == design
        assert best.distance < 0.03


def test_the_scale_of_a_design_is_that_of_its_mechanism():
    own = search("four-bar", "E")
    assert own.ratio == pytest.approx(design_equations(own.mechanism).solver.unit / own.size)
