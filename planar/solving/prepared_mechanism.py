"""A mechanism prepared for solving: its structure, its compiled functions, its numbers, its residual check."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from planar.equations.acceptance import AcceptanceFunctions, Scales, acceptance_functions
from planar.equations.coordinates import FRAME_PARTS, coordinate_columns, frames_from_coordinates
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions, equation_functions
from planar.equations.mechanism_numbers import pair_numbers, shapes_of_links, size_from_extents
from planar.equations.residuals import pair_residuals, split_pair_numbers, wrapped_residual
from planar.equations.sparse_matrices import SparseMatrices
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.errors import join_names as several
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import At, Link, Point, shape_extent
from planar.model.mechanism import (
    LARGEST_NUMBER,
    SMALLEST_NUMBER,
    Input,
    Mechanism,
    check_mechanism,
    find_law_problem,
    links_counting_turns,
    named_points,
    pair_misfits,
    relative_motions,
)
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount
from planar.solving.checks import ResidualCheck, column_norms, residual_tolerance, stack_motion

if TYPE_CHECKING:
    from planar.solving.stops import MetStop, PairStops

ZERO_POSITION = 1e-14
"""rad or sizes: a position of an input that was solved for and is nearer to zero is there."""


class PointLocations(NamedTuple):
    """The places of named points: each by the first of its links to be placed, (block, link, point), and the points of
    each link with their names. The block is that after which the link stands, -1 where inputs alone place it."""

    first_link: dict[str, tuple[int, str, str]]
    points_of: dict[str, list[tuple[str, str]]]


class MechanismStructure:
    """What mechanisms share that differ in numbers alone: names, pairs, functions, points. Raises BadInput where a
    mechanism names what it does not have."""

    def __init__(self, mechanism: Mechanism):
        check_mechanism(mechanism)
        self.mechanism = mechanism
        self.functions: EquationFunctions = equation_functions(mechanism)
        self.equations = self.functions.equations
        self.column = coordinate_columns(self.equations.coordinates)
        self.pairs: dict[str, Pair] = {pair.name: pair for pair in mechanism.pairs}
        self.relative_motions = relative_motions(mechanism)
        self.is_length = np.array([c.kind is MeasureKind.LENGTH for c in self.equations.coordinates], dtype=bool)
        self.input_slides = tuple(
            self.relative_motions[given.pair].input_kind is MeasureKind.LENGTH for given in mechanism.inputs
        )
        self.counts = bool(links_counting_turns(mechanism))

    @cached_property
    def acceptance(self) -> AcceptanceFunctions | None:
        """What computes and judges positions block after block, for the structures that have it."""
        functions = acceptance_functions(self.mechanism)
        return functions if functions.is_available else None

    @cached_property
    def residual_check(self) -> ResidualCheck:
        """What judges positions by the pairs' own formulas."""
        return ResidualCheck(self.mechanism, self.column, self.equations.open_rows)

    @cached_property
    def point_locations(self) -> PointLocations:
        """The places of named points."""
        names = [link.name for link in self.mechanism.links]
        known_after = self.equations.known_after_block
        columns = {link: [self.column.get((link, part)) for part in FRAME_PARTS] for link in names}
        blocks = {link: max((known_after[c] for c in columns[link] if c is not None), default=-1) for link in names}
        first: dict[str, tuple[int, str, str]] = {}
        points_of: dict[str, list[tuple[str, str]]] = {link: [] for link in names}
        for named in named_points(self.mechanism):
            first[named.name] = min((blocks[link], link, point) for link, point in named.members)
            for link, point in named.members:
                points_of[link].append((point, named.name))
        return PointLocations(first, points_of)


def mechanism_structure(mechanism: Mechanism) -> MechanismStructure:
    """The structure of a mechanism, cached for others of the same. Raises BadInput."""
    problem = find_law_problem(mechanism)
    if problem:
        raise BadInput(*problem)
    links = tuple((link.name, link.names) for link in mechanism.links)
    try:
        inputs = tuple(given.pair for given in mechanism.inputs)
        return _cached_structure(mechanism.frame, links, mechanism.pairs, inputs, mechanism.closes_within is not None)
    except TypeError:  # made in Python, of lists
        return MechanismStructure(mechanism)


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_structure(
    frame: str,
    links: tuple[tuple[str, tuple[str, ...]], ...],
    pairs: tuple[Pair, ...],
    inputs: tuple[str, ...],
    with_misfit: bool,
) -> MechanismStructure:
    bare = tuple(Link(name, tuple(Point(point, At(0.0, 0.0)) for point in points)) for name, points in links)
    drives = tuple(Input(pair, 0.0) for pair in inputs)
    return MechanismStructure(Mechanism("", frame, bare, pairs, drives, closes_within=0.0 if with_misfit else None))


class LazyFrames:
    """Frames of links and own coordinates of pairs of solved positions, computed when they are first read.

    `coordinate_rates` are the value and the rates of w (coordinates,), lengths in sizes, or (rows, coordinates) of a
    motion.
    """

    def __init__(self, setup: PreparedMechanism, coordinate_rates: Iterable[Array]):
        self.column, self.shapes, self.pairs, self.scale = setup.column, setup.shapes, setup.pairs, setup.scale
        self.coordinate_rates = coordinate_rates

    @cached_property
    def frames_and_own(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """The frames of all links and the own coordinates of all pairs, as jets (m, rad, s)."""
        scaled = [rates * self.scale for rates in self.coordinate_rates]
        columns = [rates.T if rates.ndim > 1 else rates.tolist() for rates in scaled]
        jets = [Jet(*rates) for rates in zip(*columns, strict=True)]
        return frames_from_coordinates(jets, self.column, self.shapes, self.pairs)


class LazyFrameMapping(Mapping[str, Any]):
    """The frames (index 0) or the own coordinates (index 1) of `LazyFrames`, by name."""

    def __init__(self, source: LazyFrames, index: int):
        self.source, self.index = source, index

    def __getitem__(self, name: str) -> Any:
        return self.source.frames_and_own[self.index][name]

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {**self, **other}

    def __iter__(self) -> Iterator[str]:
        return iter((self.source.shapes, self.source.pairs)[self.index])

    def __len__(self) -> int:
        return len((self.source.shapes, self.source.pairs)[self.index])


def lazy_frames(
    setup: PreparedMechanism, coordinate_rates: Iterable[Array]
) -> tuple[LazyFrameMapping, LazyFrameMapping]:
    """Frames of links and own coordinates of pairs; see `LazyFrames`."""
    source = LazyFrames(setup, coordinate_rates)
    return LazyFrameMapping(source, 0), LazyFrameMapping(source, 1)


class PositionInputs(NamedTuple):
    """The numbers of one position: inputs u with their rates (scaled), and the numbers p of the pairs."""

    u: Array
    u1: Array
    u2: Array
    p: Array


class PreparedMechanism:
    """What does not change from one position of a mechanism to the next, and what the file's own inputs are."""

    def __init__(self, mechanism: Mechanism):
        self.structure = mechanism_structure(mechanism)
        self.mechanism = mechanism
        self.shapes = shapes_of_links(mechanism)
        self.functions, self.equations = self.structure.functions, self.structure.equations
        self.column, self.pairs = self.structure.column, self.structure.pairs
        self.relative_motions = self.structure.relative_motions
        for pair, problem in pair_misfits(mechanism.pairs, self.shapes, mechanism.units):
            raise BadInput(pair.name, problem)
        for name, shape in self.shapes.items():
            for point, place in shape.points.items():
                if not all(value == 0.0 or SMALLEST_NUMBER <= abs(value) < LARGEST_NUMBER for value in place):
                    limits = f"from {SMALLEST_NUMBER:g} to {LARGEST_NUMBER:.0e} m"
                    raise BadInput(f"{name}.{point}", f"a place is 0, or {limits}, not [{place.x:g}, {place.y:g}]")
        extents = {name: shape_extent(shape) for name, shape in self.shapes.items()}
        self.unit = size_from_extents(mechanism, extents, self.structure.input_slides)
        self.input_scale = np.where(self.structure.input_slides, self.unit, 1.0)
        "the units of the inputs (inputs,), m or rad"
        self.scale = np.where(self.structure.is_length, self.unit, 1.0)
        self.reach = {name: extent / self.unit for name, extent in extents.items()}
        "the greatest distance between two points of each link (sizes)"
        self.has_extent = any(self.reach.values())
        "whether the unit is a length of some link, and no slide's travel"
        numbers = pair_numbers(mechanism, self.shapes, self.unit)
        kinds = [kind for pair in mechanism.pairs for kind in pair.number_kinds]
        reach = np.abs(numbers[[kind is MeasureKind.LENGTH for kind in kinds]]).max(initial=0.0)
        self.tolerance = float(residual_tolerance(len(mechanism.links), reach))
        "what the residual check lets pass: round-off of the residual, in lengths of the size"
        if self.equations.open_rows:
            # the square of each misfit counts as the stiffness of its pair, beside the greatest
            stiffness = dict(mechanism.pair_stiffness)
            owners = [self.structure.residual_check.row_pairs[row] for row in self.equations.open_rows]
            weights = np.array([stiffness.get(self.pairs[name].entry_name(), 1.0) for name in owners])
            numbers = np.append(numbers, weights / weights.max())
        self.inputs = self._position_inputs(mechanism, numbers)

    def with_inputs_of(self, mechanism: Mechanism) -> Self:
        """The same for a mechanism that differs from this one in its inputs' numbers alone."""
        if not self.keeps_its_numbers(mechanism):
            other = type(self)(mechanism)
            other.__dict__["stops"] = self.stops
            return other.with_functions(self.functions) if self.is_deflated else other
        other = copy(self)
        other.mechanism = mechanism
        other.inputs = self._position_inputs(mechanism, self.inputs.p)
        return other

    def keeps_its_numbers(self, mechanism: Mechanism) -> bool:
        """Whether its size and all numbers but the inputs' are those of a mechanism with other inputs, too."""
        return self.has_extent and all(given.law is None for given in mechanism.inputs)

    def with_functions(self, program: EquationFunctions) -> Self:
        """The same with more constraints, which hold wherever its own do on the motion; see `solving.deflation`."""
        other = copy(self)
        other.__dict__.pop("acceptance_scales", None)
        other.functions, other.equations = program, program.equations
        return other

    @cached_property
    def stops(self) -> PairStops | None:
        """The stops of its pairs, if it has any."""
        if not self.mechanism.stops:
            return None
        from planar.solving.stops import PairStops  # few mechanisms have stops

        return PairStops(self.mechanism, self.unit)

    def stop_positions(self, z: Array, u: Array) -> Array:
        """The positions of the pairs that have stops (stops,), rad or m; of rows of unknowns (stops, rows)."""
        if self.stops is None:
            return np.zeros(0)
        w = self.functions.coordinates(z, u, self.inputs.p) * self.scale
        frames, own = frames_from_coordinates(list(w.T), self.column, self.shapes, self.pairs)
        return self.stops.positions(self.shapes, frames, own)

    def stops_at(self, z: Array, u: Array) -> tuple[MetStop, ...]:
        """The stops that pairs meet at unknowns and inputs."""
        return self.stops.met_at(self.stop_positions(z, u)) if self.stops else ()

    def refuse_misfit(self, what: str) -> None:
        """Raise BadInput where pairs may stay open by a misfit: `what` is told of pairs that close alone."""
        if self.equations.open_rows:
            raise BadInput(
                "closes_within", f"{what} of a linkage that closes within a misfit only; give it lengths that agree"
            )

    def pair_misfits(self, z: Array, u: Array) -> dict[str, Array]:
        """By how much each pair that may stay open does (samples,): m, angles as arcs at the mechanism's size."""
        w = self.functions.coordinates(z, u, self.inputs.p)
        misfits: dict[str, Array] = {}
        for row, column in zip(self.equations.open_rows, self.equations.misfit_columns, strict=True):
            name = self.structure.residual_check.row_pairs[row]
            misfits[name] = np.hypot(misfits.get(name, 0.0), w[:, column] * self.unit)
        return misfits

    def is_least_misfit(self, z: Array, u: Array) -> Array:
        """At which stationary positions (samples,) the misfit is the least of all beside: whether its second derivative
        is positive along all moves that keep what has to close."""
        from planar.equations.symbolic_equations import HELD  # few pairs may stay open

        e = self.equations
        slopes = self.functions.jacobians(z, u, self.inputs.p)[0]
        columns = [k for k, column in enumerate(e.unknowns) if column in e.row_variables]
        rows = [e.row_variables.index(e.unknowns[k]) for k in columns]
        held = [k for k, variable in enumerate(e.row_variables) if variable == HELD]
        curvature = slopes[:, rows][:, :, columns]
        if held:
            across = np.linalg.svd(slopes[:, held][:, :, columns])[2][:, len(held) :]
            curvature = across @ curvature @ across.transpose(0, 2, 1)
        return np.linalg.eigvalsh(curvature).min(axis=1, initial=1.0) > 0.0

    @property
    def is_deflated(self) -> bool:
        """Whether it has more constraints than those of its pairs and inputs."""
        return self.functions is not self.structure.functions

    def _position_inputs(self, mechanism: Mechanism, p: Array) -> PositionInputs:
        """The inputs of a mechanism with the numbers p of its pairs."""
        u, u1, u2 = np.array([*self.scaled_inputs(mechanism)], dtype=float).reshape(3, -1)
        return PositionInputs(u, u1, u2, p)

    def scaled_inputs(self, mechanism: Mechanism) -> Iterator[list[float]]:
        """Positions, velocities and accelerations of a mechanism's inputs, lengths in sizes."""
        sizes = self.input_scale.tolist()
        yield [given.position / size for given, size in zip(mechanism.inputs, sizes, strict=True)]
        yield [given.velocity / size for given, size in zip(mechanism.inputs, sizes, strict=True)]
        yield [given.acceleration / size for given, size in zip(mechanism.inputs, sizes, strict=True)]

    @property
    def acceptance(self) -> AcceptanceFunctions | None:
        """What computes and judges positions block after block, for the structures that have it."""
        return None if self.is_deflated else self.structure.acceptance

    @cached_property
    def acceptance_scales(self) -> Scales:
        """The numbers by which positions are judged, with `row_scale` and `min_column_scale`."""
        e = self.equations
        row_scale, min_column_scale = np.ones(len(e.rows)), np.ones(len(e.unknowns))
        for block in e.blocks:
            # of links that have but one point each, the least extent of a link beside
            beside = (self.reach[link] for pair in block.pairs for link in self.pairs[pair].links)
            reach = max((self.reach[link] for link in block.links), default=0.0) or min(
                filter(None, beside), default=1.0
            )
            row_scale[block.rows] = [reach if row.kind is MeasureKind.LENGTH else 1.0 for row in e.rows[block.rows]]
            coordinates = (e.coordinates[column] for column in e.unknowns[block.unknowns])
            min_column_scale[block.unknowns] = [
                1.0 / reach if c.kind is MeasureKind.LENGTH else self.reach.get(c.owner, reach) / reach or 1.0
                for c in coordinates
            ]
        return Scales(self.inputs.p, row_scale, min_column_scale)

    @property
    def row_scale(self) -> Array:
        """What every row of a Jacobian is divided by (rows,): lengths by the reach of their block's links (sizes)."""
        return self.acceptance_scales.row_scale

    @property
    def min_column_scale(self) -> Array:
        """What the column of every unknown could be at best in its block, rows divided so (unknowns,)."""
        return self.acceptance_scales.column_floor

    def block_regularity(self, z: Array, u: Array | None = None) -> Array:
        """How regular the Jacobian of each block is (blocks,) at unknowns z and inputs u, or the file's own."""
        u = self.inputs.u if u is None else u
        return self.jacobian_regularity(self.functions.jacobians(z[None], u[None], self.inputs.p)[0][0])

    def jacobian_regularity(self, jacobian: Array | SparseMatrices) -> Array:
        """The least singular value of each block of a Jacobian (..., blocks), each column divided by what its links
        could reach at best.

        Zero at a dead point or a change point; lengths are divided by the reach of the block's links, so that neither
        their size nor that of the mechanism matters. `jacobian` is (..., rows, unknowns).
        """
        least_values: Array = np.ones((*jacobian.shape[:-2], len(self.equations.blocks)))
        for index, block in enumerate(self.equations.blocks):
            block_jacobian = jacobian[..., block.rows, block.unknowns] / self.row_scale[block.rows, None]
            sizes = column_norms(block_jacobian, self.min_column_scale[block.unknowns])
            rows, columns = block_jacobian.shape[-2:]
            if rows < columns:
                least_values[..., index] = 0.0
            elif columns:
                values = np.linalg.svd(block_jacobian / sizes[..., None, :], compute_uv=False)
                least_values[..., index] = values[..., -1] / np.maximum(1.0, values[..., 0])
        return least_values

    @property
    def row_pairs(self) -> list[str]:
        """The pair of every row of `residuals`."""
        e, check = self.equations, self.structure.residual_check
        more = [check.row_pairs[row] for row in e.open_rows] + [row.pair for row in e.rows]
        return check.row_pairs + (more if e.open_rows else [])

    def residuals(self, z: Array, u: Array) -> Array:
        """What every constraint leaves open (rows, samples); z (samples, unknowns), u (samples, inputs).

        Of pairs that may stay open first nothing, then how far what they leave open is from their misfits, and how far
        these are from being the least.
        """
        w = self.functions.coordinates(z, u, self.inputs.p)
        constraint_residuals = self.coordinate_residuals(w, u)
        if not self.equations.open_rows:
            return constraint_residuals
        with np.errstate(invalid="ignore"):  # what is not a number counts as open, and is refused as such
            misfit_errors = np.abs(self._misfits(w) - w[:, list(self.equations.misfit_columns)])
        y = np.hstack([z, u])
        imbalance = np.abs(self.functions.kinematics(y, 0.0 * y, 0.0 * y, self.inputs.p).F)
        return np.vstack([constraint_residuals, misfit_errors.T, imbalance.T])

    def coordinate_residuals(self, w: Array, u: Array) -> Array:
        """The residuals of the pairs and inputs alone (rows, samples), from all coordinates w (samples, coordinates)
        and inputs u (samples, inputs)."""
        return self.structure.residual_check.residuals(stack_motion([w], [u]), self.inputs.p)

    def _misfits(self, w: Array) -> Array:
        """What each row that may stay open leaves open (..., rows) at coordinates w (..., coordinates), by the pairs'
        own formulas."""
        frames, own = frames_from_coordinates(w.T, self.column, self.shapes, self.pairs)
        numbers = split_pair_numbers(self.mechanism.pairs, self.inputs.p.tolist())
        rows = list(pair_residuals(self.mechanism.pairs, frames, numbers, own))
        misfits = [wrapped_residual(rows[k][1], rows[k][0].kind) for k in self.equations.open_rows]
        return np.array(np.broadcast_arrays(*misfits)).T

    def coordinates(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Scalar]]) -> Array:
        """w (..., coordinates) where the links' frames and the pairs' own coordinates are, jets or numbers (m, rad)."""
        parts = {(link, name): getattr(frame, name) for link, frame in frames.items() for name in ("x", "y", "angle")}
        for pair, coordinates in own.items():
            kinds = self.pairs[pair].coordinate_kinds
            parts |= {(pair, name): value for (name, _), value in zip(kinds, coordinates, strict=True)}
        values = (parts.get(coordinate[:2], 0.0) for coordinate in self.equations.coordinates)
        positions = [value.parts[0] if isinstance(value, Jet) else value for value in values]
        w: Array = np.array(np.broadcast_arrays(*positions), dtype=float).T / self.scale
        if self.equations.open_rows:
            w[..., list(self.equations.misfit_columns)] = self._misfits(w)
        return w

    def max_residuals(self, z: Array, u: Array) -> Array:
        """What the worst constraint leaves open at every sample (samples,)."""
        return self.residuals(z, u).max(axis=0, initial=0.0)

    def max_residual(self, z: Array, u: Array) -> float:
        """The same at one position, z (unknowns,) and u (inputs,)."""
        return float(self.max_residuals(z[None], u[None])[0])

    def worst_residual(self, z: Array) -> tuple[float, str]:
        """The same at the mechanism's own inputs, z (unknowns,), and the pair of that constraint."""
        residuals = self.residuals(z[None], self.inputs.u[None])[:, 0]
        return (float(residuals.max()), self.row_pairs[int(np.argmax(residuals))]) if residuals.size else (0.0, "")

    def describe_position(self) -> str:
        """The file's own position in words: at A = 60 deg."""
        return f"at {self.describe_inputs(self.inputs.u)}" if self.mechanism.inputs else "as drawn"

    def describe_inputs(self, u: Array) -> str:
        """A position of the inputs in words: A = 60 deg."""
        return several(
            [self.describe_input(given.pair, value) for given, value in zip(self.mechanism.inputs, u, strict=True)]
        )

    def describe_input(self, pair: str, position: float) -> str:
        """A position of one input (rad, sizes) in words; what rounding leaves of zero as 0."""
        kind, by = ("length", self.unit) if self.is_sliding(pair) else ("angle", 1.0)
        position = 0.0 if abs(position) < ZERO_POSITION else position
        return f"{pair} = {amount(position * by, kind, self.mechanism.units)}"

    def is_sliding(self, pair: str) -> bool:
        """Whether the relative motion at a pair is a length."""
        return self.relative_motions[pair].input_kind is MeasureKind.LENGTH
