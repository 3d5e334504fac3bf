"""What the designs of a sweep share: compiled functions, size, output points."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, reduce
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np

from planar.batch.design_arrays import design_variables, values_of_design, with_design_values
from planar.batch.march.design_batch import DesignBatch
from planar.codegen.printed_formula import FormulaFunction
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.mechanism_numbers import pair_numbers, scaled_pair_numbers, shapes_of_links
from planar.foundation.arrays import BoolArray
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.foundation.recorded_formula import formula_of_results, greatest_of, least_of, record_formula
from planar.model.link_shapes import LinkPlace, LinkShape, PointMember, PointName, link_shape, place_in_link
from planar.model.mechanism import (
    Drive,
    Mechanism,
    NamedPoint,
    links_counting_turns,
    named_points,
    relative_motions,
    replace_inputs,
    running_input_index,
)
from planar.model.pairs import MeasureKind
from planar.model.pairs.base import Pair
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.checks import SHORT_ARM, residual_tolerance
from planar.solving.position import PositionSolver, solved_mechanism

Array = np.ndarray

KINEMATIC_SECTIONS = ("links", "pairs", "inputs")
"""Sections of the file whose numbers the equations take."""
MAX_KEPT_FORMULAS = 64
"""Formulas of designs, by the names of what they differ in, that are kept."""
JUDGED_ROWS = 3
"""Rows by which designs are judged, behind those of pairs and inputs: the margin, the sum and the reach."""
MAX_ROOTS = 16
"""Assemblies of the base from which those of its designs are looked for."""


class DesignRows(NamedTuple):
    """The numbers of designs: p (numbers, designs) of all pairs, and of the inputs the positions u and the rates u1 and
    u2 (inputs, designs), each in sizes or rad; the shapes of the links (m), whose coordinates are arrays (designs,)
    where designs differ; and which designs have finite numbers and no arm so short that rounding takes its digits
    (designs,).

    `tolerance`: what the residual check allows for these designs, as `PreparedMechanism.tolerance`, of the longest of
    any; `zero_rows`: the rows of p that are zero in the reference, None where they are not zero in every design.
    """

    p: Array
    u: Array
    u1: Array
    u2: Array
    shapes: Mapping[str, LinkShape]
    is_fit: BoolArray
    tolerance: float
    zero_rows: tuple[int, ...] | None

    def select(self, designs: Array) -> DesignRows:
        """The numbers of some of the designs, judged by the tolerance of all."""
        p, u, u1, u2 = (rows[:, designs] for rows in self[:4])
        shapes = {name: _map_shape(shape, lambda part: part[designs]) for name, shape in self.shapes.items()}
        return self._replace(p=p, u=u, u1=u1, u2=u2, shapes=shapes, is_fit=self.is_fit[designs])


class ReferenceDesign:
    """A mechanism one of whose inputs runs while the others stand still, before its designs change it; in time all
    run."""

    def __init__(self, mechanism: Mechanism, pair: str | None, is_timed: bool = False):
        names = [given.pair for given in mechanism.inputs]
        if not names:
            solved_mechanism(mechanism).check_motion()
        self.running_index = 0 if is_timed else running_input_index(mechanism, pair)
        self.pair = names[self.running_index]
        still = () if is_timed else tuple(Drive(name, None, 0.0, 0.0) for name in names if name != self.pair)
        self.mechanism = replace_inputs(mechanism, still)
        self.solver = PositionSolver(self.mechanism)
        self.unit, self.functions = self.solver.unit, self.solver.functions
        self.is_sliding = self.solver.is_sliding(self.pair)
        self.input_scale = np.array([self.unit if self.solver.is_sliding(name) else 1.0 for name in names])
        self.points = {each.name: each for each in named_points(mechanism)}
        self.motions = relative_motions(mechanism)
        self.counted_links = links_counting_turns(mechanism)

    @cached_property
    def candidates(self) -> BlockAssemblies:
        """The assemblies of the base's blocks."""
        return BlockAssemblies(self.solver)

    @property
    def can_be_compiled(self) -> bool:
        """Whether designs can run compiled: every block closes once, and no contact is kept closed by others."""
        watched = any(type(pair).contact_gap is not Pair.contact_gap for pair in self.mechanism.pairs)
        return self.functions.is_square and not watched

    @property
    def moving_points(self) -> dict[str, NamedPoint]:
        """The points that do not lie on the frame."""
        frame = self.mechanism.frame
        return {name: each for name, each in self.points.items() if frame not in dict(each.members)}

    def select_points(self, points: Sequence[str] | str | None) -> tuple[str, ...]:
        """The result names of points, given by those or as `link.point`; all that move where none are. BadInput."""
        if points is None:
            return tuple(self.moving_points)
        given = [points] if isinstance(points, str) else list(points)
        members = {f"{link}.{point}": name for name, each in self.points.items() for link, point in each.members}
        known = members | {name: name for name in self.points}
        for each in given:
            if each not in known:
                hint = suggest_name(str(each), known, "points")
                raise BadInput("points", f"there is no point {each!r:.60}{hint}")
        return tuple(dict.fromkeys(known[each] for each in given))

    def result_name(self, point: str) -> PointName:
        """The result name of a point. Raises BadInput."""
        return self.select_points(point)[0]

    def with_sketch_of(self, design: Mechanism, z: Array, u: Array) -> Mechanism:
        """A design whose sketch is the assembly of these unknowns, with every named point; as it is where these are not
        numbers."""
        if not np.isfinite(z).all():
            return design
        shapes = shapes_of_links(design)
        w = self.functions.coordinates(z, u, pair_numbers(design, shapes, self.unit)) * self.solver.scale
        frames = frames_from_coordinates(w.tolist(), self.solver.column, shapes, {})[0]
        points = [(name, *each.members[0]) for name, each in self.points.items()]
        places = [(name, frames[link].to_world(shapes[link].position(point))) for name, link, point in points]
        return replace(design, sketch=tuple((name, float(at.x), float(at.y)) for name, at in places))

    def point_member(self, name: PointName) -> PointMember:
        """The (link, point) by which a point is told: on the frame where it lies there."""
        if isinstance(name, LinkPlace):
            return name.link, name.at
        members = self.points[name].members
        return next((each for each in members if each[0] == self.mechanism.frame), members[0])

    def shapes(self, designs: Mechanism) -> dict[str, LinkShape]:
        """The shapes of the links of all designs at once (m): numbers where they agree, arrays where they do not."""
        own = {link.name: link for link in self.mechanism.links}
        with np.errstate(invalid="ignore", divide="ignore"):  # what cannot be placed is not a number, and judged later
            return {
                link.name: self.solver.shapes[link.name] if link is own[link.name] else link_shape(link)
                for link in designs.links
            }

    @cached_property
    def length_rows(self) -> list[int]:
        """The rows of p that are lengths."""
        kinds = [kind for pair in self.mechanism.pairs for kind in pair.number_kinds]
        return [k for k, kind in enumerate(kinds) if kind is MeasureKind.LENGTH]

    def design_batch(self, rows: DesignRows, members: Iterable[PointMember], rates: bool = False) -> DesignBatch:
        """Designs of these numbers at their inputs, with points to tell.

        `members`: (link, point) of each, none on the frame. The unknowns, and where the inputs go, are still to be set.
        """
        members, design_count = tuple(members), rows.p.shape[1]
        places = [part for link, point in members for part in place_in_link(rows.shapes[link], point)]
        q = stack_rows(places, design_count) / self.unit
        links = tuple(link for link, _ in members)
        z0, offsets = np.zeros((len(self.functions.equations.unknowns), design_count)), np.zeros((1, len(rows.u)))
        march = self.functions, self.mechanism, rows.p, q, z0, offsets, rows.u, rows.u1, rows.u2, links, rates
        return DesignBatch(*march, rows.tolerance, self.unit, self._zeros(rows.zero_rows, places, members))

    def _zeros(
        self, zero_rows: Sequence[int] | None, places: Sequence[Scalar | Array], members: Sequence[PointMember]
    ) -> frozenset[tuple[str, int]]:
        """Rows of p and q that are zero in all designs: those that are zero in the reference, or none.

        So all designs of a mechanism share their code, except those that give such a number a value.
        """
        base_places = [part for link, point in members for part in place_in_link(self.solver.shapes[link], point)]
        zero_places = [k for k, part in enumerate(base_places) if part == 0.0]
        # coordinates that no design changes are the reference's own numbers
        varying = [np.asarray(places[k]) for k in zero_places if places[k] is not base_places[k]]
        if zero_rows is None or any(place.any() for place in varying):
            return frozenset()
        return frozenset([*(("p", k) for k in zero_rows), *(("q", k) for k in zero_places)])

    @cached_property
    def zero_rows(self) -> tuple[int, ...]:
        """The rows of p that are zero in the reference."""
        return tuple(np.flatnonzero(pair_numbers(self.mechanism, self.solver.shapes, self.unit) == 0.0).tolist())

    def design_rows(self, values: Mapping[str, Array], count: int) -> DesignRows:
        """The numbers of `count` designs with these values (designs,) by name."""
        names = tuple(values)
        formula = self._formulas.get(names)
        if formula is None:
            if len(self._formulas) >= MAX_KEPT_FORMULAS:
                self._formulas.clear()
            formula = self._formulas[names] = DesignFormula(self, names)
        return formula.rows(values, count)

    @cached_property
    def _formulas(self) -> dict[tuple[str, ...], DesignFormula]:
        return {}

    def is_unfit(self, values: Mapping[str, Array], shapes: Mapping[str, LinkShape]) -> Array:
        """The designs that are looked at one by one (designs,): pairs may refuse them before anything moves, or they
        have a sketch of their own."""
        count = len(next(iter(values.values())))
        is_unfit = np.zeros(count, dtype=bool)
        can_misfit = any(type(pair).find_misfit is not Pair.find_misfit for pair in self.mechanism.pairs)
        known = design_variables(self.mechanism)
        for name, value in values.items():
            if known[name].path[0] == "sketch":
                is_unfit |= value != known[name].value
        of_pairs = {name: value for name, value in values.items() if known[name].path[0] == "pairs"}
        if can_misfit and (of_pairs or any(known[name].link for name in values)):
            for index in range(count):
                design_shapes = {name: shape_of_design(shape, index) for name, shape in shapes.items()}
                pairs = with_design_values(self.mechanism, values_of_design(of_pairs, index)).pairs
                is_unfit[index] |= any(pair.find_misfit(pairs, design_shapes, str) for pair in pairs)
        return is_unfit

    @cached_property
    def arms(self) -> tuple[tuple[str, str, str], ...]:
        """Two points of a link each, by which pairs hold it that the blocks before it, or its own, make use of."""
        return tuple(self._find_arms())

    def _find_arms(self) -> Iterator[tuple[str, str, str]]:
        column, known_from = self.solver.column, self.functions.equations.known_after_block
        names = [link.name for link in self.mechanism.links]
        known = {link: known_from[column[link, "angle"]] if (link, "angle") in column else -1 for link in names}
        for link in names:
            if known[link] < 0:
                continue  # what the input turns is turned exactly
            pinned = {
                point
                for pair in self.mechanism.pairs
                if all(known[other] <= known[link] for other in pair.bodies)  # later blocks ask for places alone
                for owner, point in pair.coincident_points()
                if owner == link
            }
            yield from ((link, *both) for both in combinations(sorted(pinned), 2))

    @cached_property
    def block_assemblies(self) -> tuple[tuple[Array, int], ...]:
        """For every block the assemblies (roots, unknowns) from which those of designs start, and how many assemblies a
        search finds."""
        starts_of_blocks = []
        nodes: list[tuple[float, Array]] = [(0.0, np.zeros(len(self.solver.equations.unknowns)))]
        for block in self.solver.equations.blocks:
            extensions = []
            for cost, z in nodes:
                assemblies, nearest = self.candidates.near_sketch(block, z, every=True)
                extended = [(cost + assembly.distance, assembly.z) for assembly in assemblies]
                extensions.append(extended or [(cost + 1e3, nearest)])
            longest = max(extensions, key=len)
            nearest_first = sorted((*longest, *extensions[0]), key=lambda node: node[0])
            starts = [z[block.unknowns] for _, z in nearest_first]
            apart = [
                z for k, z in enumerate(starts) if all(np.max(np.abs(z - o), initial=0.0) > 1e-6 for o in starts[:k])
            ]
            starts_of_blocks.append((np.array(apart[:MAX_ROOTS]), len(longest)))
            nodes = sorted(chain.from_iterable(extensions), key=lambda node: node[0])[:MAX_ROOTS]
        return tuple(starts_of_blocks)


class DesignFormula:
    """The numbers of the designs of a mechanism that differ in the numbers of these names."""

    def __init__(self, reference: ReferenceDesign, names: Sequence[str]):
        known = design_variables(reference.mechanism)
        self.names = tuple(name for name in names if known[name].path[0] in KINEMATIC_SECTIONS)
        self.reference = reference
        shapes = reference.shapes(
            with_design_values(reference.mechanism, {name: known[name].value for name in self.names})
        )
        self.changed_links = [link for link, shape in shapes.items() if shape is not reference.solver.shapes[link]]
        self.pair_number_count = sum(len(pair.number_kinds) for pair in reference.mechanism.pairs)
        input_count = len(reference.mechanism.inputs)
        self.sections = [self.pair_number_count + k * input_count for k in range(4)]
        "where the rows of u, u1 and u2 begin among those of `_rows`, and where they end"
        self.varying_zero_rows = list(reference.zero_rows)
        "the rows of p that are zero in the reference and may not be in a design"
        self.function: FormulaFunction | None = None
        "of the rows that are computed; None where a pair has numbers that are measured in floats alone"
        self.coordinates: list[float | int] = []
        "of the points of changed links: a constant, or the number of an argument, and behind these of a computed row"
        if all(pair.measures_symbols for pair in reference.mechanism.pairs):
            self._record()

    def _record(self) -> None:
        formula = record_formula(self._rows, len(self.names))
        point_row = self.sections[-1] + JUDGED_ROWS
        computed = list(formula.results[:point_row])
        is_zero = [(made.operation, made.number) == ("const", 0.0) for made in formula.instructions]
        self.varying_zero_rows = [row for row in self.varying_zero_rows if not is_zero[computed[row]]]
        for number in formula.results[point_row:]:
            operation, _, constant, argument = formula.instructions[number]
            if operation == "const":
                self.coordinates.append(float(constant))
            elif argument is not None:
                self.coordinates.append(argument)
            else:
                self.coordinates.append(len(self.names) + len(computed))
                computed.append(number)
        self.function = FormulaFunction(
            formula_of_results(formula, computed), [1] * len(self.names), [(1, len(computed))]
        )

    def _rows(self, values: Sequence[Scalar]) -> list[Scalar]:
        """The rows of designs with these values of the named numbers, in any arithmetic: p; positions, velocities and
        accelerations of the inputs; a margin that is negative where an arm is short; the sum of all these rows and of
        the points, which is finite where they are; the greatest length of a pair, in sizes; and x and y of the points
        of the changed links."""
        reference = self.reference
        design = with_design_values(reference.mechanism, dict(zip(self.names, values, strict=True)))
        shapes = reference.shapes(design)
        rows = [number for pair in design.pairs for number in scaled_pair_numbers(pair, shapes, reference.unit)]
        rows += [given.position / scale for given, scale in zip(design.inputs, reference.input_scale, strict=True)]
        running = design.inputs[reference.running_index]
        for rate in (running.velocity, running.acceleration):
            rows += [0.0] * len(design.inputs)
            rows[reference.running_index - len(design.inputs)] = rate / reference.input_scale[reference.running_index]
        points = [point for shape in shapes.values() for point in shape.points.values()]
        squared_size = reduce(greatest_of, [point.dot(point) for point in points], reference.unit**2)
        margin: Scalar = 0.0
        for link, first, second in reference.arms:
            arm = shapes[link].points[second] - shapes[link].points[first]
            square = arm.dot(arm)
            # an arm of no length at all turns nothing
            margin = least_of(margin, greatest_of(square - SHORT_ARM**2 * squared_size, -square))
        coordinates = [part for link in self.changed_links for point in shapes[link].points.values() for part in point]
        lengths = [abs(rows[k]) for k in reference.length_rows]
        reach = reduce(greatest_of, lengths, 0.0)
        return [*rows, margin, sum([*rows, *coordinates]), reach, *coordinates]

    def rows(self, values: Mapping[str, Array], count: int) -> DesignRows:
        """The rows of designs with these values (designs,) by name."""
        arguments = [values[name] for name in self.names]
        point_row = self.sections[-1] + JUDGED_ROWS
        with np.errstate(all="ignore"):  # what cannot be placed is not a number
            if self.function is None:
                every = self._rows(arguments)
                rows, coordinates = stack_rows(every[:point_row], count), iter(every[point_row:])
            else:
                rows = self.function.evaluate_entries(count, *(argument[None] for argument in arguments))
                known = [*arguments, *rows]
                coordinates = iter(known[part] if isinstance(part, int) else part for part in self.coordinates)
        rows = np.ascontiguousarray(rows)
        sections = zip([0, *self.sections], self.sections, strict=False)
        p, u, u1, u2 = (rows[first:last] for first, last in sections)
        margin, total, reach = rows[self.sections[-1] : point_row]
        shapes = dict(self.reference.solver.shapes)
        for link in self.changed_links:
            shape = shapes[link]
            points = {name: Vector(next(coordinates), next(coordinates)) for name in shape.points}
            shapes[link] = LinkShape(points, shape.origin, shape.axis)
        tolerance = residual_tolerance(len(self.reference.mechanism.links), np.fmax.reduce(reach, initial=0.0))
        zero_rows = None if any(p[k].any() for k in self.varying_zero_rows) else self.reference.zero_rows
        return DesignRows(p, u, u1, u2, shapes, (margin >= 0.0) & np.isfinite(total), float(tolerance), zero_rows)


@lru_cache(maxsize=16)
def reference_design(mechanism: Mechanism, pair: str | None, is_timed: bool = False) -> ReferenceDesign:
    """The base of a mechanism's designs; kept, since a worker solves many blocks of one sweep."""
    return ReferenceDesign(mechanism, pair, is_timed)


def stack_rows(rows: Sequence[Array | Scalar], design_count: int) -> Array:
    """Rows of numbers, or of arrays of one for each design, as one array (rows, designs)."""
    stacked = np.empty((len(rows), design_count))
    for k, row in enumerate(rows):
        stacked[k] = row
    return stacked


def shape_of_design(shape: LinkShape, index: int) -> LinkShape:
    """The shape of one design, out of that of all."""
    return _map_shape(shape, lambda part: float(part[index]))


def _map_shape(shape: LinkShape, select: Callable[[Array], Scalar]) -> LinkShape:
    """The shape of some designs, out of that of all."""

    def of_designs(value: Vector) -> Vector:
        return Vector(*(select(part) if isinstance(part, np.ndarray) else part for part in value))

    points = {name: of_designs(place) for name, place in shape.points.items()}
    return LinkShape(points, of_designs(shape.origin), of_designs(shape.axis))
