"""Forces and motions of mechanisms of many links: sparse factors against dense matrices, and against free bodies."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planar
from benchmarks import chain
from planar.dynamics import equations_of_motion, equilibrium
from planar.dynamics.equilibrium import Equilibrium
from planar.dynamics.forces import Forces
from planar.dynamics.saddle_point import SaddlePattern, SaddleSystem
from planar.equations.sparse_matrices import SparseMatrices, SparsePattern
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Mechanism
from tests.builders import lift_document
from tests.rubbing import with_friction

EXACT = 1e-10


def row(links: int, **more: Any) -> dict[str, Any]:
    """A row of four-bars with a load on the last pin, and masses on cranks and rockers."""
    value, last = chain.document(links), (links - 2) // 2
    masses = [{"link": f"rocker{k}", "at": f"C{k}", "mass": 1.0, "inertia": 0.1} for k in range(1, last + 1)]
    masses.append({"link": "crank", "at": "B1", "mass": 2.0, "inertia": 0.1})
    loads = [{"point": f"C{last}", "force": [-100.0, 20.0]}]
    return {**value, "loads": loads, "masses": masses, "gravity": [0.0, -9.81], **more}


def lift(stages: int) -> dict[str, Any]:
    return {**lift_document(stages), "loads": [{"point": f"P{stages}", "force": [30.0, -100.0]}]}


def pistons(links: int) -> dict[str, Any]:
    """A row of four-bars whose rockers drive blocks on guides of the frame by connecting rods."""
    value = row(links)
    for k in range(1, (links - 2) // 2 + 1):
        block, guide = f"E{k}", f"way{k}"
        value["links"][f"rod{k}"] = {"ends": [f"C{k}", block], "length": 1.5}
        value["pairs"].append({"sliding": guide, "on": "frame", "block": block, "line": {"through": f"D{k}"}})
        value["sketch"][block] = [value["sketch"][f"C{k}"][0] + 1.4, 0.0]
        value["loads"].append({"point": block, "force": [-10.0 * k, 5.0]})
    return value


def train(wheels: int) -> dict[str, Any]:
    """Wheels in mesh one after the other, on pins of the frame; a torque acts on the last one."""
    links: dict[str, Any] = {"f": {"points": {f"A{k}": [0.2 * k, 0.0] for k in range(wheels)}}}
    links |= {f"w{k}": {"points": {f"A{k}": [0.0, 0.0]}} for k in range(wheels)}
    pairs: list[dict[str, Any]] = [{"turning": f"A{k}"} for k in range(wheels)]
    pairs += [{"gear": f"g{k}", "links": [f"w{k}", f"w{k + 1}"], "teeth": [20 + k, 30]} for k in range(wheels - 1)]
    return {
        "planar": 1,
        "frame": "f",
        "links": links,
        "pairs": pairs,
        "inputs": [{"pair": "A0", "position": 0.3, "velocity": 2.0}],
        "loads": [{"link": f"w{wheels - 1}", "torque": 3.0}, {"point": "A3", "force": [5.0, 1.0]}],
        "masses": [{"link": f"w{k}", "at": f"A{k}", "mass": 1.0, "inertia": 0.1} for k in range(wheels)],
    }


def doubled(links: int) -> dict[str, Any]:
    """A row of four-bars with a second bar beside the coupler of one of them, so that links are held more than once."""
    value = row(links)
    value["links"]["second bar"] = dict(value["links"][f"coupler{(links - 2) // 4}"])
    return value


def numbers(forces: Forces) -> dict[str, np.ndarray]:
    found = {f"effort {name}": np.asarray(effort) for name, effort in forces.inputs.items()}
    for name, reaction in forces.reactions.items():
        found[f"force {name}"], found[f"couple {name}"] = np.asarray(reaction.force), np.asarray(reaction.couple)
    return found


def both(monkeypatch: pytest.MonkeyPatch, moving: Any, **options: Any) -> tuple[Forces, Forces]:
    """The forces by sparse factors and by dense matrices."""
    made = []
    for limit in (0, 10**9):
        monkeypatch.setattr(equilibrium, "MAX_DENSE_UNKNOWNS", limit)
        made.append(planar.forces(moving, **options))
    return made[0], made[1]


def assert_alike(sparse: Forces, dense: Forces) -> None:
    assert sparse.undetermined == dense.undetermined
    assert sparse.bodies == dense.bodies
    first, second = numbers(sparse), numbers(dense)
    assert first.keys() == second.keys()
    scale = max(float(np.nanmax(np.abs(each), initial=0.0)) for each in second.values())
    for name, value in second.items():
        np.testing.assert_allclose(first[name], value, rtol=0.0, atol=EXACT * scale, err_msg=name)


DOCUMENTS = {"row": row(44), "lift": lift(12), "pistons": pistons(24), "train": train(30)}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_sparse_factors_give_the_forces_of_dense_matrices_which_balance_free_bodies(monkeypatch, name):
    state = planar.solve(planar.from_dict(DOCUMENTS[name]))
    sparse, dense = both(monkeypatch, state)
    assert_alike(sparse, dense)
    assert not sparse.undetermined
    assert len(sparse.bodies) == len(state.mechanism.links) - 1
    assert max(each for each in sparse.proof if each is not None) < EXACT


@pytest.mark.parametrize("name", ["row", "pistons"])
def test_positions_of_a_motion_have_the_same_forces_by_both(monkeypatch, name):
    motion = planar.cycle(planar.from_dict(DOCUMENTS[name]), 7)
    sparse, dense = both(monkeypatch, motion)
    assert_alike(sparse, dense)


def test_friction_is_the_same_by_both(monkeypatch):
    rng = np.random.default_rng(3)
    mechanism = planar.from_dict(row(22))
    rubbing = with_friction(replace(mechanism, pairs=mechanism.pairs[:3]), rng, 0.1).pairs
    state = planar.solve(replace(mechanism, pairs=rubbing + mechanism.pairs[3:]))
    sparse, dense = both(monkeypatch, state)
    assert_alike(sparse, dense)
    assert sparse.friction.keys() == dense.friction.keys() != set()
    for name, each in dense.friction.items():
        assert sparse.friction[name].effort == pytest.approx(each.effort, rel=1e-9)
    assert_alike(sparse.frictionless, dense.frictionless)


def test_links_held_more_than_once_are_named_alike_by_both(monkeypatch):
    sparse, dense = both(monkeypatch, planar.solve(planar.from_dict(doubled(30))))
    assert dense.undetermined
    assert_alike(sparse, dense)


def test_limits_of_a_motion_are_not_balanced_by_both(monkeypatch):
    """The driven slide of a lift that lies flat, or stands upright, cannot hold a load across it."""
    motion = planar.cycle(planar.from_dict(lift(12)), 6)
    sparse, dense = both(monkeypatch, motion)
    assert np.isnan(dense.inputs["s"]).any() and np.isfinite(dense.inputs["s"]).any()
    assert_alike(sparse, dense)


def test_equilibrium_of_sparse_matrices_is_that_of_dense_ones(monkeypatch):
    """Regular, singular and not finite positions at once: solutions, rows of the inverse and null spaces."""
    rng = np.random.default_rng(1)
    count, size = 4, 9
    dense = np.where(rng.random((size, size)) < 0.4, rng.normal(size=(count, size, size)), 0.0) + 2.0 * np.eye(size)
    dense[2, :, 4] = dense[2, :, 3]
    filled = np.nonzero(dense.any(axis=0).T)
    first = np.concatenate([[0], np.cumsum(np.bincount(filled[0], minlength=size))])
    matrices = SparseMatrices(SparsePattern((size, size), filled[1], first), dense[:, filled[1], filled[0]])
    full = Equilibrium(matrices)
    monkeypatch.setattr(equilibrium, "MAX_DENSE_UNKNOWNS", 0)
    sparse = Equilibrium(matrices)
    right = rng.normal(size=(count, size, 3))
    assert isinstance(sparse.matrix, SparseMatrices) and isinstance(full.matrix, np.ndarray)
    np.testing.assert_allclose(sparse.solve(right), full.solve(right), atol=1e-10)
    np.testing.assert_allclose(sparse.inverse, full.inverse, atol=1e-10)
    np.testing.assert_allclose(sparse.inverse_rows(slice(2, 5)), full.inverse[:, 2:5], atol=1e-10)
    np.testing.assert_allclose(sparse.matrix @ right, full.matrix @ right, atol=1e-12)
    spaces = [each.null_space @ each.null_space.transpose(0, 2, 1) for each in (sparse, full)]
    assert full.null_space.shape[2] == 1
    np.testing.assert_allclose(*spaces, atol=1e-10)


def test_a_saddle_system_has_the_shortest_steps_and_the_regularity_of_singular_values():
    rng = np.random.default_rng(2)
    rows, count = 6, 9
    constraints, root = rng.normal(size=(rows, count)), rng.normal(size=(count, count))
    square = root @ root.T + np.eye(count)

    def pattern(height: int) -> SparsePattern:
        return SparsePattern((height, count), np.tile(np.arange(height), count), np.arange(count + 1) * height)

    saddle = SaddlePattern(pattern(count), pattern(rows))
    system = SaddleSystem(saddle, square.T.ravel(), constraints.T.ravel())
    upper, lower = rng.normal(size=count), rng.normal(size=rows)
    x, multipliers = system.solve(upper, lower)
    np.testing.assert_allclose(square @ x + constraints.T @ multipliers, upper, atol=1e-11)
    np.testing.assert_allclose(constraints @ x, lower, atol=1e-11)
    free = np.linalg.svd(constraints)[2][rows:].T
    compliance = 1.0 / np.linalg.eigvalsh(free.T @ square @ free)[0]
    assert compliance <= system.greatest_compliance() <= 1.5 * compliance
    unit = SaddleSystem(saddle, np.eye(count).ravel(), constraints.T.ravel())
    np.testing.assert_allclose(unit.shortest(lower), np.linalg.pinv(constraints) @ lower, atol=1e-11)
    values = np.linalg.svd(constraints, compute_uv=False)
    assert unit.regularity() == pytest.approx(values[-1] / values[0], rel=0.1)


def simulated(monkeypatch: pytest.MonkeyPatch, mechanism: Mechanism, limit: int, **options: Any) -> Any:
    monkeypatch.setattr(equations_of_motion, "MAX_DENSE_UNKNOWNS", limit)
    return planar.simulate(mechanism, 0.15, 6, **options)


@pytest.mark.parametrize("value", [row(12), train(8)], ids=["row", "train"])
@pytest.mark.parametrize("is_driven", [False, True])
def test_a_simulation_is_the_same_by_sparse_factors_and_by_singular_values(monkeypatch, value, is_driven):
    mechanism = planar.from_dict(value)
    options = {"driven": [mechanism.inputs[0].pair]} if is_driven else {}
    sparse, dense = (simulated(monkeypatch, mechanism, limit, **options) for limit in (0, 10**9))
    assert sparse.motion.outcome is dense.motion.outcome is Outcome.SOLVED
    for name in ("kinetic", "potential", "work"):
        scale = np.abs(dense.kinetic).max()
        np.testing.assert_allclose(getattr(sparse, name), getattr(dense, name), rtol=1e-9, atol=1e-9 * scale)
    assert sparse.balance < 1e-9
    assert sparse.motion.residual < 1e-12


def test_a_simulation_of_many_links_keeps_its_energy():
    found = planar.simulate(planar.from_dict(row(60)), 0.1, 4)
    assert found.motion.outcome is Outcome.SOLVED
    assert found.balance < 1e-9


def test_what_moves_without_a_mass_is_refused_by_both(monkeypatch):
    value = row(12)
    mechanism = planar.from_dict({**value, "masses": [], "loads": [{"point": "C5", "force": [10.0, 0.0]}]})
    reasons = []
    for limit in (0, 10**9):
        with pytest.raises(NoAnswer) as refused:
            simulated(monkeypatch, mechanism, limit)
        reasons.append(str(refused.value))
    assert reasons[0] == reasons[1]
