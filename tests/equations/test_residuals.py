"""The residuals of pairs and inputs, by whatever they are differentiated."""

import casadi as ca
import numpy as np

import planar
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import equation_functions
from planar.equations.mechanism_numbers import pair_numbers, shapes_of_links
from planar.equations.residuals import residuals, split_pair_numbers


def test_residuals_are_open_for_the_numbers_of_the_pairs():
    """Their derivatives by p, as expressions, are the differences of the same residuals of floats."""
    mechanism = planar.load("slider-crank")
    e = equation_functions(mechanism).equations
    columns, pairs = coordinate_columns(e.coordinates), {pair.name: pair for pair in mechanism.pairs}

    def stacked(w, p, u):
        frames, own = frames_from_coordinates(w, columns, [link.name for link in mechanism.links], pairs)
        return [value for _, value in residuals(mechanism, frames, split_pair_numbers(mechanism.pairs, p), own, u)]

    rng = np.random.default_rng(0)
    w, p = rng.uniform(0.5, 1.5, e.w.numel()), pair_numbers(mechanism, shapes_of_links(mechanism), 1.0)
    symbols = ca.SX.sym("p", len(p))
    rows = ca.vertcat(*stacked(w.tolist(), symbols, [0.3]))
    by_p = ca.Function("by_p", [symbols], [ca.jacobian(rows, symbols)])(p).full()
    for k in range(len(p)):
        step = np.zeros(len(p))
        step[k] = 1e-6
        ahead, behind = (np.array(stacked(w.tolist(), (p + s).tolist(), [0.3])) for s in (step, -step))
        np.testing.assert_allclose(by_p[:, k], (ahead - behind) / 2e-6, atol=1e-8)
