"""Derivatives of positions, velocities and accelerations beside differences of positions solved to fifty digits."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import planar
from planar.derivatives.design_equations import design_equations
from planar.derivatives.kinematic_slopes import kinematic_results
from planar.equations.casadi_functions import OPERATIONS, evaluate_function
from tests.draws import covering
from tests.known import MODELS

flint = pytest.importorskip("flint")

DIGITS, STEP = 60, "1e-20"
ROUNDS = 6
"""Of a correction with a Jacobian in double precision, each of which brings some ten digits."""
FUNCTIONS = OPERATIONS | {
    ca.OP_FABS: abs,
    ca.OP_SQRT: lambda a: a.sqrt(),
    ca.OP_ATAN2: flint.arb.atan2,
}
CASES = {
    "four-bar": ("E", (0.3, 0.9, 1.3)),
    "slider-crank": ("stroke", (0.4, 1.9, 3.6, 5.0)),
    "whitworth": ("R", (0.2, 1.4, 2.9, 4.4)),
    "geared-five-bar": ("C", (0.5, 1.7, 3.1, 5.2)),
    "klann-leg": ("foot", (0.1, 1.2, 2.6, 4.0)),
    "double-butterfly": ("E", (-0.02, 0.0, 0.02)),
    "scotch-yoke": ("stroke", (0.3, 2.0, 4.1)),
    "stephenson-3-five-bar": ("C", (0.4, 2.2, 4.3)),
    "oscillating-cylinder": ("piston", (0.7, 3.0)),
}
"""A point or a pair, and positions of the input, some of them by how far it goes on from the file's."""


@pytest.fixture(autouse=True)
def digits():
    before = flint.ctx.dps
    flint.ctx.dps = DIGITS
    yield
    flint.ctx.dps = before


def exactly(values) -> list:
    return [flint.arb(float(each)) for each in np.ravel(values)]


class DigitSolver:
    """The equations of a state's three levels, solved to many digits at numbers near its own."""

    def __init__(self, state, of):
        design = design_equations(state.mechanism)
        unknowns, (t,) = design.coordinates_at(state)
        self.t, self.names = exactly(t), design.names
        x = ca.vertcat(design.z, design.z1, design.z2)
        G = ca.vertcat(design.F, *design.rates(design.F))
        self.equations = ca.Function("G", [x, design.t], [ca.densify(G)])
        self.x = exactly(np.concatenate([each[0] for each in unknowns]))
        jacobian = ca.Function("J", [x, design.t], [ca.densify(ca.jacobian(G, x))])
        self.inverse = np.linalg.inv(np.array(jacobian(np.concatenate([each[0] for each in unknowns]), t)))
        results = kinematic_results(design.motion, state._point_members, of)
        self.results = [result.name for result in results]
        values = [ca.densify(ca.vertcat(*result.parts)) for result in results]
        self.values = ca.Function("r", [x, design.t], values)

    def solve(self, t) -> list[list]:
        """All results, part by part, at numbers t."""
        x = list(self.x)
        for _ in range(ROUNDS):
            (left,) = self._evaluate(self.equations, x, t)
            for i, row in enumerate(self.inverse):
                move = sum((flint.arb(float(a)) * b for a, b in zip(row, left, strict=True)), flint.arb(0))
                x[i] = (x[i] - move).mid()
        assert all(abs(float(each.mid())) < 1e-45 for each in self._evaluate(self.equations, x, t)[0])
        return self._evaluate(self.values, x, t)

    def _evaluate(self, function, x, t) -> list[list]:
        return evaluate_function(function, [x, t], flint.arb, lambda code, of: FUNCTIONS[code](*of))

    def slopes(self, number: str) -> dict[str, np.ndarray]:
        """Central differences of all results in a number."""
        at, step = self.names.index(number), flint.arb(STEP)
        ends = []
        for way in (-1, 1):
            t = list(self.t)
            t[at] = t[at] + way * step
            ends.append(self.solve(t))
        return {
            name: np.array([float(((b - a) / (2 * step)).mid()) for a, b in zip(*each, strict=True)])
            for name, *each in zip(self.results, *ends, strict=True)
        }


@pytest.mark.parametrize(
    ("stem", "position"),
    covering([(stem, k) for stem, (_, ways) in CASES.items() for k in range(len(ways))], frozenset),
    ids=str,
)
def test_slopes_are_those_of_differences_of_fifty_digits(stem, position):
    mechanism, (of, ways) = MODELS[stem], CASES[stem]
    drive = mechanism.inputs[0]
    state = planar.solve(mechanism.with_values({f"{drive.pair}.position": drive.position + 0.3 * ways[position]}))
    solver = DigitSolver(state, of)
    found = planar.sensitivity(state, of)
    numbers = [name for name in solver.names if name not in found.tied and not name.startswith("gravity")]
    for number in numbers[:: max(1, len(numbers) // 4)]:
        exact = solver.slopes(number)
        for result, slopes in found.slopes.items():
            size = max(float(np.abs(each).max()) for each in slopes.values() if np.isfinite(each).all())
            np.testing.assert_allclose(
                np.ravel(slopes[number]), exact[result], rtol=1e-9, atol=1e-10 * size, err_msg=f"{result} {number}"
            )
