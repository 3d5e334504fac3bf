"""Every assembly of one block of links, those before it given, and whether that is proved to be all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from planar.assemblies.polynomial.certification import certify_solutions, is_available, is_regular
from planar.assemblies.polynomial.coefficient_family import coefficient_family
from planar.assemblies.polynomial.completeness import BlockRoots, Completeness
from planar.assemblies.polynomial.eigenvalue_solver import MAX_DIMENSION, eigenvalue_solutions
from planar.assemblies.polynomial.isotropic_form import (
    BlockPolynomials,
    IsotropicForm,
    constant_jacobian,
    isotropic_form,
)
from planar.assemblies.polynomial.path_tracker import (
    CoefficientHomotopy,
    GenericInstance,
    PathEnds,
    is_duplicate,
    is_finite_solution,
    normalize,
    refine_ends,
    solve_generic_instance,
    track_paths,
)
from planar.assemblies.solution_curves import SINGULAR_RATIO, STEP_LENGTH, is_on_curve, one_per_curve
from planar.equations.functions import EquationFunctions
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.angles import distances, wrap_angle
from planar.foundation.arrays import Array, BoolArray, ComplexArray
from planar.solving.assembly.block_assemblies import SAME_ASSEMBLY_TOLERANCE, BlockAssemblies
from planar.solving.newton import (
    CLOSED_TOLERANCE,
    ResidualFunction,
    block_residual_function,
    damped_newton,
    one_system,
    polish_root,
    refine_multiple_root,
    repeat_step,
)
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_PATHS = 1000
"""Bezout's number up to which paths are followed."""
MAX_GEARED_PATHS = 300
"""The same where gears tie angles: most paths then go to infinity, and slowly."""
MAX_CACHED_STRUCTURES = 100
"""Structures of one program that are kept: with gears each ratio makes one."""
REAL_TOLERANCE = 1e-9
"""A single solution that differs from its mirror image by less (of its size) is taken for real as it stands."""
NEARLY_REAL_TOLERANCE = 0.05
"""One that differs by less is tried on the real equations."""
DOUBLE_ROOT_TOLERANCE = 3e-7
"""Least singular value of the real Jacobian, of the greatest, below which two assemblies may meet."""
CORRECTION_STEPS = 12
"""Steps that put what else moves in its place on a way off along an open direction."""
DOUBLE_ROOT_RATIO, ROUNDING_SINGULAR_VALUE = 30.0, 1e-9
"""How much less open a direction has to be there; below what part of the greatest singular value it is open in full."""
ZERO_COEFFICIENT = 1e-13
"""Coefficients below this part of the greatest are none: the structure is one without them."""
SAME_SINGULAR_ROOT_DISTANCE = 1e-3
"""Assemblies that leave a direction open and are nearer to each other than this are one."""


class _BlockStructure(NamedTuple):
    """What is kept of a block's structure: the slope of equations that are linear; else its form, and an instance with
    all its solutions for each set of absent coefficients."""

    linear_jacobian: ca.Function | None
    form: IsotropicForm | None
    instances: dict[bytes, GenericInstance]


_STRUCTURES: WeakKeyDictionary[EquationFunctions, dict[tuple[int, bytes], _BlockStructure]] = WeakKeyDictionary()


def block_roots(setup: PreparedMechanism, stage: Block, z: Array, certify: bool = True) -> BlockRoots:
    """Every assembly of a block at the setup's inputs, all blocks before it standing at z (unknowns,)."""
    known = _block_structure(setup, stage)
    unknowns = slice_length(stage.unknowns)
    if not unknowns:
        none = np.zeros(1, dtype=bool)
        return BlockRoots(np.zeros((1, 0)), none, none, 1, 1, Completeness.PROVED, False, "nothing is open")
    if known.linear_jacobian is not None:
        return _linear_root(setup, stage, z, known.linear_jacobian, certify)
    if known.form is None:
        return _search_from_starts(setup, stage, z, "its equations are no polynomials of this kind")
    if known.form.bezout_number > (MAX_GEARED_PATHS if known.form.gears else MAX_PATHS):
        return _search_from_starts(setup, stage, z, f"there may be up to {known.form.bezout_number} complex ones")
    given = (z, setup.inputs.u, setup.inputs.p)
    found = _BlockRootSolver(setup, stage, given, known.form, known.instances).roots(certify)
    return found or _search_from_starts(setup, stage, z, "linkages of this structure have no single solutions")


def _block_structure(setup: PreparedMechanism, stage: Block) -> _BlockStructure:
    kept = _STRUCTURES.setdefault(setup.functions, {})
    numbers = setup.inputs.p if setup.structure.counts else None
    key = (stage.block_index, b"" if numbers is None else numbers.tobytes())
    if key not in kept:
        if len(kept) >= MAX_CACHED_STRUCTURES:
            kept.clear()
        slope = constant_jacobian(setup.equations, stage)
        kept[key] = _BlockStructure(slope, None if slope else isotropic_form(setup.equations, stage, numbers), {})
    return kept[key]


def solve_by_eigenvalues(form: IsotropicForm, polynomials: BlockPolynomials) -> ComplexArray | None:
    """All complex solutions that Bezout's theorem allows (solutions, 2 many), as eigenvalues.

    None where they are too many for that, or do not all count once.
    """
    V = eigenvalue_solutions(form, polynomials) if form.dimension <= MAX_DIMENSION else None
    if V is None or not np.all(np.isfinite(V)):
        return None
    ends = refine_ends(CoefficientHomotopy(form, polynomials, polynomials), normalize(V), np.zeros(len(V), dtype=bool))
    return ends.V if ends.is_single.all() and not is_duplicate(ends.V).any() else None


def absent_coefficients(polynomials: BlockPolynomials) -> BoolArray:
    """Which coefficients a linkage's polynomials do not have."""
    coefficients = np.abs(polynomials.flat_coefficients[0])
    return coefficients < ZERO_COEFFICIENT * max(float(coefficients.max(initial=0.0)), 1.0)


def generic_instance(
    equations: ConstraintEquations, form: IsotropicForm, polynomials: BlockPolynomials
) -> GenericInstance:
    """A random linkage of the structure that a linkage's polynomials have, with all its solutions that count once."""
    return solve_generic_instance(
        form, coefficient_family(equations, form, absent_coefficients(polynomials)).draw_member
    )


class _ComplexSolutions(NamedTuple):
    """All complex solutions that were found: those that count once, those where several meet or that go on, whether
    every path came to an end, how many there are at finite places, and how they were found."""

    single: ComplexArray
    multiple: ComplexArray
    all_paths_ended: bool
    expected: int
    method: str


def complex_assemblies(
    setup: PreparedMechanism, stage: Block, given: tuple[Array, Array, Array]
) -> ComplexArray | None:
    """All complex solutions of a block (solutions, unknowns) where z, u and p are `given`, those at infinity left out.

    None where it is no block of polynomials without gears, may have more than `MAX_PATHS`, or where some do not count
    once or are not reached.
    """
    known = _block_structure(setup, stage)
    form = known.form
    if form is None or form.gears or form.is_redundant or form.bezout_number > MAX_PATHS:
        return None
    found = _BlockRootSolver(setup, stage, given, form, known.instances).complex_solutions()
    if found is None or not found.all_paths_ended or np.any(is_finite_solution(found.multiple, 1e-4)):
        return None
    return form.complex_unknowns(found.single[is_finite_solution(found.single)])


class _BlockRootSolver:
    """One block where z, u and p are given."""

    def __init__(
        self,
        setup: PreparedMechanism,
        stage: Block,
        given: tuple[Array, Array, Array],
        form: IsotropicForm,
        instances: dict[bytes, GenericInstance],
    ):
        self.setup, self.stage, self.z, self.form, self.instances = setup, stage, given[0], form, instances
        self.given = given
        self.polynomials: BlockPolynomials = self.form.polynomials(*self.given)
        self.residual_function: ResidualFunction = block_residual_function(setup.functions, stage, *self.given)

    def complex_solutions(self) -> _ComplexSolutions | None:
        """All of them; None where not even a random linkage of the structure has any that count once."""
        return self._solve_by_eigenvalues() or self._solve_by_paths()

    def roots(self, certify: bool) -> BlockRoots | None:
        """See `roots`; None where not even a random linkage of the structure has solutions that count once."""
        found = self.complex_solutions()
        if found is None:
            return None
        single = found.single[is_finite_solution(found.single)]
        real, curve = self._real_roots(found, single)
        proofs, proved, said = np.zeros(len(real), dtype=bool), False, found.method
        if certify and self.form.is_redundant:
            said += "; it holds more than it needs, which no box proves"
        elif certify and self.form.gears and not self.form.gears.is_exact:
            said += "; a ratio of its gears is no float, so that no box proves them"
        elif certify and not is_available():
            said += "; python-flint is not there to certify them"
        elif certify:
            proofs, proved = self._certify_roots(found, real)
            said += "; each proved to be the only one in a box of its own" if proved else ""
        finite = len(single) + int(np.sum(is_finite_solution(found.multiple, 1e-4)))
        # paths end on a curve at complex places, so that of real curves only starts tell
        whole = Completeness.NUMERICALLY if found.all_paths_ended and not curve else Completeness.NOT
        double, complete = (
            _is_double_root(self.residual_function, real) & ~proofs,
            Completeness.PROVED if proved else whole,
        )
        return BlockRoots(real, double, proofs, found.expected, finite, complete, curve, said)

    def _solve_by_eigenvalues(self) -> _ComplexSolutions | None:
        """By eigenvalues, where there are as many single solutions as Bezout's number."""
        V = solve_by_eigenvalues(self.form, self.polynomials)
        if V is None:
            return None
        finite = int(np.sum(is_finite_solution(V)))
        away = f", {len(V) - finite} of them at infinity" if finite < len(V) else ""
        said = f"all {len(V)} complex solutions that Bezout's theorem allows, as eigenvalues{away}"
        return _ComplexSolutions(V, V[:0], True, finite, said)

    def _solve_by_paths(self) -> _ComplexSolutions | None:
        """By paths from a random instance of the structure."""
        instance = self._instance()
        if not len(instance.V):
            return None
        between = CoefficientHomotopy(self.form, instance.begin, self.polynomials)
        ends = track_paths(between, instance.V)
        for near in (1e-6, 1e-8):
            again = ~ends.is_near_end | _is_shared_end(ends)
            if not again.any():
                break
            closer = track_paths(between, instance.V[again], near)
            for whole, part in zip(ends, closer, strict=True):
                whole[again] = part
        # where several meet they arrive at one place by right
        several = _is_shared_end(ends) & (ends.regularity < SINGULAR_RATIO)
        single = ends.is_single & ~several
        lost = int(np.sum(~ends.is_near_end | (_is_shared_end(ends) & ~several)))
        said = f"{len(instance.V)} paths from a random linkage of this structure, which has {instance.finite} solutions"
        if lost:
            said += f"; {lost} came to no end"
        return _ComplexSolutions(ends.V[single], ends.V[~single], not lost, instance.finite, said)

    def _instance(self) -> GenericInstance:
        key = absent_coefficients(self.polynomials).tobytes()
        if key not in self.instances:
            self.instances[key] = generic_instance(self.setup.equations, self.form, self.polynomials)
        return self.instances[key]

    def _real_roots(self, found: _ComplexSolutions, single: ComplexArray) -> tuple[Array, bool]:
        """The assemblies among the solutions (roots, unknowns), sorted, and whether there is a curve of them."""
        X, Y = single[:, : self.form.entry_count], single[:, self.form.entry_count :]
        X, Y = X / X[:, :1], Y / Y[:, :1]
        off = np.max(np.abs(X - Y.conj()) / np.maximum(1.0, np.abs(X)), axis=1, initial=0.0)
        near = self.form.nearest_real_unknowns(X, Y, self.given)
        sure = [polish_root(self.residual_function, each) for each in near[off < REAL_TOLERANCE]]
        tried = self._converged_roots(near[(off >= REAL_TOLERANCE) & (off < NEARLY_REAL_TOLERANCE)])
        several = found.multiple[is_finite_solution(found.multiple, 1e-6)]
        met = self._converged_roots(
            self.form.nearest_real_unknowns(
                several[:, : self.form.entry_count], several[:, self.form.entry_count :], self.given
            )
        )
        # of those that meet the first stands for all: the one nearest to where the Jacobian is singular
        met.sort(key=lambda root: float(_least_singular_ratio(self.residual_function, root[None])[0]))
        kept: list[Array] = list(met)
        curves: list[Array] = []
        if len(found.multiple):
            kept, curves = _isolated_and_curves(self.setup, self.stage, self.z, self.residual_function, met)
        every = [self.form.wrap_angles(each) for each in (*sure, *tried, *kept, *curves)]
        distinct: list[Array] = []
        weak: list[bool] = []
        for number, each in enumerate(every):
            # beside a root that counts once there is an exact one; what else stays open by more than rounding is none
            exact = number < len(sure) and not self.form.is_redundant
            if not self._is_root(each, CLOSED_TOLERANCE if exact else self.setup.tolerance):
                continue
            open_ = bool(_least_singular_ratio(self.residual_function, each[None])[0] < SINGULAR_RATIO)
            # where several meet each is found to a root of round-off only
            room = [SAME_SINGULAR_ROOT_DISTANCE if open_ and other else SAME_ASSEMBLY_TOLERANCE for other in weak]
            if not any(self._is_same_root(each, other, within) for other, within in zip(distinct, room, strict=True)):
                distinct.append(each)
                weak.append(open_ and number >= len(sure))  # of single solutions each stands for itself
        distinct.sort(key=_rounded)
        return np.array(distinct).reshape(-1, slice_length(self.stage.unknowns)), bool(curves)

    def _converged_roots(self, near: Array) -> list[Array]:
        """Where Newton's method on the real equations leads to from near by, if there."""
        if not len(near):
            return []
        ended_ = damped_newton(self.residual_function, near)
        return [
            refine_multiple_root(self.residual_function, each, SAME_SINGULAR_ROOT_DISTANCE)
            for each in ended_.unknowns[ended_.converged]
        ]

    def _is_root(self, root: Array, within: float) -> bool:
        """Whether all rows are met, those too that a redundant block has more."""
        return bool(np.max(np.abs(self.residual_function(root[None])[0]), initial=0.0) <= within)

    def _is_same_root(self, one: Array, other: Array, within: float = SAME_ASSEMBLY_TOLERANCE) -> bool:
        is_angle = np.isin(np.arange(one.size), list(self.form.angles))
        return bool(np.all(distances(is_angle, one, other) < within))

    def _certify_roots(self, found: _ComplexSolutions, real: Array) -> tuple[BoolArray, bool]:
        """Which assemblies are proved, and whether it is proved that there are no others."""
        proof = certify_solutions(self.form, self.given, found.single)
        many = self.form.entry_count
        proofs = np.zeros(len(real), dtype=bool)
        of = found.single[proof.real]
        for near in self.form.nearest_real_unknowns(of[:, :many], of[:, many:], self.given):
            proofs |= np.array([self._is_same_root(each, near) for each in real], dtype=bool)
        whole = len(found.single) == self.form.bezout_number and bool(np.all(proof.proved & proof.decided))
        return proofs, whole and int(proof.real.sum()) == len(real)


def _is_shared_end(ends: PathEnds) -> BoolArray:
    """Which single solutions several paths came to: one of them took another's."""
    met = np.zeros(len(ends.V), dtype=bool)
    met[ends.is_single] = is_duplicate(ends.V[ends.is_single])
    return met


def _rounded(root: Array) -> list[float]:
    """What roots are sorted by."""
    found: list[float] = np.round(root, 7).tolist()
    return found


def _search_from_starts(setup: PreparedMechanism, stage: Block, z: Array, why: str) -> BlockRoots:
    """What starts all over the circles lead to."""
    closing = block_residual_function(setup.functions, stage, z, setup.inputs.u, setup.inputs.p)
    isolated, curves = _isolated_and_curves(setup, stage, z, closing)
    real = np.array([*isolated, *curves]).reshape(-1, slice_length(stage.unknowns))
    if not setup.structure.counts:
        real = np.where(setup.equations.unknown_is_angle[stage.unknowns], wrap_angle(real), real)
    real = np.array(sorted(real, key=_rounded)).reshape(real.shape)
    none = np.zeros(len(real), dtype=bool)
    said = f"searched by starts only: {why}"
    return BlockRoots(real, _is_double_root(closing, real), none, None, len(real), Completeness.NOT, bool(curves), said)


def _isolated_and_curves(
    setup: PreparedMechanism, stage: Block, z: Array, closing: ResidualFunction, met: Sequence[Array] = ()
) -> tuple[list[Array], list[Array]]:
    """Assemblies that stand alone, and one of every curve: of those given and of where starts all over lead to."""
    there = [*met, *(each.z[stage.unknowns] for each in BlockAssemblies(setup).from_all_starts(stage, z))]
    going = [is_on_curve(closing, each) for each in there]
    on_curves = [each for each, on in zip(there, going, strict=True) if on]
    isolated = [each for each, on in zip(there, going, strict=True) if not on]
    return isolated, one_per_curve(closing, on_curves, setup.equations.unknown_is_angle[stage.unknowns])


def _linear_root(setup: PreparedMechanism, stage: Block, z: Array, slope: ca.Function, certify: bool) -> BlockRoots:
    """The one assembly of a block whose equations are linear."""
    given = (z, setup.inputs.u, setup.inputs.p)
    closing = block_residual_function(setup.functions, stage, z, *given[1:])
    unknowns, rows = slice_length(stage.unknowns), slice_length(stage.rows)
    said = "its equations are linear"
    left, there = closing(np.zeros((1, unknowns)))
    values = np.linalg.svd(there[0], compute_uv=False)
    root = polish_root(closing, -np.linalg.lstsq(there[0], left[0], rcond=1e-12)[0])
    one = np.ones(1, dtype=bool)
    if np.max(np.abs(closing(root[None])[0])) > CLOSED_TOLERANCE:
        none = np.zeros((0, unknowns))
        return BlockRoots(none, one[:0], one[:0], 0, 0, Completeness.NUMERICALLY, False, f"{said}, and at odds")
    if values[-1] <= 1e-12 * values[0]:
        return BlockRoots(root[None], one, ~one, 0, 0, Completeness.NUMERICALLY, True, f"{said}, and leave it free")
    proved = certify and rows == unknowns and is_available() and is_regular(slope, given)
    whole = Completeness.PROVED if proved else Completeness.NUMERICALLY
    return BlockRoots(root[None], ~one, one & proved, 1, 1, whole, False, said)


def _least_singular_ratio(closing: ResidualFunction, real: Array) -> Array:
    """The least singular value of a block's Jacobian, of the greatest (roots,): none where a direction is open."""
    if not real.size:
        return np.ones(len(real))
    values = np.linalg.svd(closing(real)[1], compute_uv=False)
    return values[:, -1] / np.maximum(values[:, 0], 1e-300)


def _is_double_root(closing: ResidualFunction, real: Array) -> BoolArray:
    """Where two assemblies or more meet (roots,): a direction is open there, and a way off along it is not.

    Beside a curve of assemblies it is open, or all but open, all along; there they lie apart.
    """
    double = _least_singular_ratio(closing, real) < DOUBLE_ROOT_TOLERANCE
    for k in np.flatnonzero(double):
        slope = closing(real[k][None])[1][0]
        values, way = np.linalg.svd(slope)[1:]
        others, off = np.linalg.pinv(slope, rcond=SINGULAR_RATIO), real[k] + STEP_LENGTH * way[-1]
        off = repeat_step(one_system(closing), others, off, CORRECTION_STEPS)  # in the other directions only
        weakest = _least_singular_ratio(closing, off[None])[0]
        double[k] = weakest > DOUBLE_ROOT_RATIO * max(values[-1] / values[0], ROUNDING_SINGULAR_VALUE)
    return double
