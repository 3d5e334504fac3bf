"""Signs of determinants, by which a step is told from one to the assembly beside: of blocks of any size."""

import casadi as ca
import numpy as np
import pytest

import planar
from planar.equations.acceptance import InputSamples
from planar.equations.block_motion import reduce_to_triangle, regularity_bound
from planar.solving.position import PositionSolver


@pytest.mark.parametrize("size", [3, 5, 8])
def test_a_triangle_keeps_lengths_and_the_sign_of_the_determinant(size):
    rng, symbol = np.random.default_rng(size), ca.SX.sym("A", size, size)
    function = ca.Function("triangle", [symbol], [ca.densify(each) for each in reduce_to_triangle(symbol)])
    for _ in range(20):
        matrix = rng.normal(size=(size, size))
        matrix[rng.random((size, size)) < 0.3] = 0.0
        determinant = np.linalg.det(matrix)
        if abs(determinant) > 1e-6:
            triangle, sign = (each.full() for each in function(matrix))
            assert np.sign(determinant) == sign
            np.testing.assert_allclose(triangle.T @ triangle, matrix.T @ matrix, atol=1e-12)
            assert not np.tril(triangle, -1).any()


def all_but_a_parallelogram(seed):
    """Arms of nearly one length on pins nearly as far apart as the head's, driven through a floating link: a block of
    six unknowns, whose assemblies lie in pairs beside each other."""
    rng = np.random.default_rng(seed)
    off = rng.uniform(-1e-3, 1e-3, 4)
    o, p = np.array([off[0], off[1]]), np.array([-0.05, off[2]])
    turned = rng.uniform(0.5, 2.5)
    a = o + 0.4 * np.array([np.cos(turned), np.sin(turned)])
    b = a + (p - o) + rng.normal(0.0, 3e-4, 2)
    g, h = o + 0.6 * (a - o), 0.5 * (a + b) + rng.normal(0.0, 0.02, 2)
    q, angle = rng.uniform(-0.5, 0.5, 2), rng.uniform(0.0, 6.0)
    c = q + 0.08 * np.array([np.cos(angle), np.sin(angle)])
    e, f = h + rng.normal(0.0, 0.25, 2), g + rng.normal(0.0, 0.25, 2)

    def length(one, other):
        return float(np.hypot(*(other - one)))

    def inside(one, other, at):
        x = (other - one) / length(one, other)
        return [float((at - one) @ x), float(x[0] * (at - one)[1] - x[1] * (at - one)[0])]

    return planar.from_dict(
        {
            "planar": 1,
            "name": "all but a parallelogram, driven from afar",
            "frame": "base",
            "links": {
                "base": {"points": {"O": o.tolist(), "P": p.tolist(), "Q": q.tolist()}},
                "crank": {"ends": ["Q", "C"], "length": 0.08},
                "floating": {"ends": ["C", "E"], "length": length(c, e), "points": {"F": inside(c, e, f)}},
                "rod": {"ends": ["E", "H"], "length": length(e, h)},
                "other rod": {"ends": ["F", "G"], "length": length(f, g)},
                "arm": {"ends": ["O", "A"], "length": 0.4, "points": {"G": inside(o, a, g)}},
                "head": {"ends": ["A", "B"], "length": length(a, b), "points": {"H": inside(a, b, h)}},
                "stay": {"ends": ["P", "B"], "length": length(p, b)},
            },
            "pairs": [{"turning": name} for name in "OPQABCEFGH"],
            "inputs": [{"pair": "Q", "position": f"{angle} rad", "velocity": "1 rad/s"}],
            "sketch": {n: at.tolist() for n, at in {"A": a, "B": b, "C": c, "E": e, "F": f, "G": g, "H": h}.items()},
        }
    )


def test_assemblies_beside_each_other_have_other_signs_in_a_block_of_six_unknowns():
    tried = 0
    for seed in (3, 4, 9):
        mechanism = all_but_a_parallelogram(seed)
        solver, start = PositionSolver(mechanism), mechanism.inputs[0].position
        e, p = solver.equations, solver.inputs.p
        assert e.z.numel() == 6
        motion = planar.cycle(mechanism, 2000, start, start + 2.0 * np.pi)
        assert motion.outcome is planar.Outcome.DEAD_POINT
        coordinates = [e.coordinates[column] for column in e.unknowns]
        z = np.array([motion.frames[each.owner].angle.parts[0] for each in coordinates]).T
        at = motion.inputs["Q"].position[:, None]
        assert solver.acceptance is not None

        def sign(z, u, judged=solver.acceptance, s=solver):
            found = judged.judge(
                z[None], InputSamples(u[None], 0.0 * u[None] + 1.0, 0.0 * u[None]), s.acceptance_scales
            )
            return np.sign(found.distances[0, -1])

        signs = [sign(*each) for each in zip(z[:-1:40], at[:-1:40], strict=True)]
        assert len(set(signs)) == 1
        for before in (2, 5, 20):
            # beside the dead point the other assembly lies as far from it, to the other side
            guess = 2.0 * z[-1] - z[-1 - before]
            other = solver.functions.correct_samples(guess[None], at[-1 - before][None], p)[0]
            if np.abs(other - guess).max() < 0.5 * np.abs(other - z[-1 - before]).max():
                assert sign(other, at[-1 - before]) == -signs[0]
                tried += 1
    assert tried > 4


@pytest.mark.parametrize(
    "matrix",
    [
        np.zeros((2, 2)),
        [[0.0, 1.0, 2.0], [0.0, 0.5, -1.0], [0.0, 3.0, 1.0]],
        [[1.0, 2.0, 0.5], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]],
        [[1.0, 1.0, 1.0, 2.0], [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]],
    ],
)
def test_a_matrix_that_loses_a_column_on_the_way_is_singular_and_not_unknown(matrix):
    """A bound that is no number would be passed over where the least of all blocks is taken."""
    entries = np.asarray(matrix)
    block = ca.SX.sym("block", *entries.shape)
    bound = regularity_bound(block, ca.SX.ones(len(entries)), ca.SX.ones(len(entries)) * 1e-9)
    assert float(ca.Function("bound", [block], [bound])(entries)) == pytest.approx(0.0, abs=1e-12)
