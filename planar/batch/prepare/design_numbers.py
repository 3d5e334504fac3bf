"""What a compiled run takes of a design: expressions in the numbers in which designs may differ."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from functools import reduce

import casadi as ca
import numpy as np

from planar.batch.design_arrays import with_design_values
from planar.batch.design_ends import stop_ranges
from planar.batch.march.kernel import KernelEquations, Operand, kernel_equations
from planar.batch.march.stops import LEAST_RANGES, SURE_DISTANCE, TURN, stop_limits
from planar.batch.reference_design import ReferenceDesign
from planar.document.dimensions import Dimension, input_numbers, link_lengths
from planar.equations.mechanism_numbers import equation_structure, scaled_pair_numbers
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import Distances, Link, LinkShape, PointMember
from planar.model.mechanism import LARGEST_INPUT_POSITION, Input, Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.solving.checks import SHORT_ARM, residual_tolerance

Array = np.ndarray

LARGEST_REACH = 1e3
"""Sizes of the file's design of a pair's length: where one is greater, rounding may take digits of what is small."""
OPEN_TRIANGLE = 1e-8
"""Of the square of the longest side's square: so far from closing rounding does not bring a triangle."""


def compiled_variables(mechanism: Mechanism) -> dict[str, Dimension]:
    """What a compiled run takes of all that designs may differ in: lengths of links, and the inputs' own numbers."""
    lengths = link_lengths(mechanism, (link.name for link in mechanism.links))
    return {each.name: each for each in (*lengths, *input_numbers(mechanism))}


class DesignNumbers:
    """The numbers of a design as expressions (casadi SX) in `symbols`.

    `own_values` are the symbols' values of the file's own design: first all that designs may differ in, of which
    `index` has the names; then the sketch, where the file's inputs are, and the size.

    `numbers` are these by the operands of `march.kernel`, lengths in sizes:

    - "p" of pairs, "q" of the wanted points (by their `members`, link and point), "u1" and "u2" rates of inputs;
    - "u", "uc", "us" of the inputs at the design's own positions, "d", "dc", "ds" of how far these are from the file's;
    - "at" of the sketched points in the axes of their links (`sketched_links`), "sketch" where they are shown;
    - "stop" of stops, those of the file, whatever a design has;
    - "tolerance" of the residual check; "unit", the size in m;
    - "margin", below zero where an arm is so short, or a length so great, that rounding takes digits, and where the
      inputs are not where they may be;
    - "opening", above zero where a point has distances from two others that surely do not close a triangle.

    `points` (x and y of all points of all links) have to be finite, and so have the numbers.
    """

    def __init__(
        self,
        reference: ReferenceDesign,
        members: Sequence[PointMember],
        may_shift: Container[int],
        zeros: Container[str] = (),
    ):
        """`may_shift`: the inputs (by number) that may stand, or start, elsewhere than the file's own; `zeros`: names
        of lengths that are nothing in all designs."""
        mechanism, variables = reference.mechanism, compiled_variables(reference.mechanism)
        still = {name: 0.0 for name in variables if name in zeros}
        variables = {name: each for name, each in variables.items() if name not in still}
        candidates = reference.candidates
        self._functions, self._structure = reference.functions, equation_structure(mechanism)
        self.index = {name: k for k, name in enumerate(variables)}
        sketched = [
            (block.block_index, name)
            for block in reference.functions.equations.blocks
            for name in candidates.sketched_by_level.get(block.block_index, ())
        ]
        sketched_members = [candidates.first_link[name][1:] for _, name in sketched]
        self.sketched_blocks = tuple(block for block, _ in sketched)
        self.sketched_links = tuple(link for link, _ in sketched_members)
        shown = [part for _, name in sketched for part in candidates.sketch[name]]
        own = [float(given.position) for given in mechanism.inputs]
        self.own_values = np.array([*(each.value for each in variables.values()), *shown, *own, reference.unit])
        self.symbols = ca.SX.sym("v", len(self.own_values))
        parts = ca.vertsplit(self.symbols)
        design = with_design_values(mechanism, still | dict(zip(variables, parts, strict=False)))
        self.unit, rest = parts[-1], parts[len(variables) : -1]
        sketch, here = rest[: len(shown)], rest[len(shown) :]
        self.shapes: Mapping[str, LinkShape] = reference.shapes(design)
        p = [each for pair in mechanism.pairs for each in scaled_pair_numbers(pair, self.shapes, self.unit)]
        kinds = [kind for pair in mechanism.pairs for kind in pair.number_kinds]
        self.numbers: dict[Operand, ca.SX] = {}
        self._add("p", p)
        self._add("q", self._local_coordinates(members))
        self._stop_pairs, stops = _stop_numbers(reference)
        self._add("stop", stops)
        margins = [
            *self._arm_margins(reference),
            *self._add_inputs(reference, list(zip(design.inputs, here, strict=True)), may_shift),
        ]
        triangles = list(self._triangles(design.links))
        margins += [each for sides, _ in triangles for each in sides]
        self._add("opening", [reduce(ca.fmax, (opening for _, opening in triangles), ca.SX(-1.0))])
        self._add("at", self._local_coordinates(sketched_members))
        self._add("sketch", sketch)
        lengths = [ca.fabs(each) for each, kind in zip(p, kinds, strict=True) if kind is MeasureKind.LENGTH]
        reach = reduce(ca.fmax, lengths, ca.SX(1.0))
        margins.append(LARGEST_REACH - reach)
        self._add("tolerance", [float(residual_tolerance(len(mechanism.links), 1.0)) * reach])
        self._add("unit", [self.unit])
        self._add("margin", [reduce(ca.fmin, margins, ca.SX(0.0))])
        self.order: tuple[Operand, ...] = (*self.numbers, *(("value", k) for k in range(len(self.own_values))))
        "how a run has the numbers, with the values behind them"
        self.points = [part for shape in self.shapes.values() for at in shape.points.values() for part in at]

    def equations(self, points: str) -> KernelEquations:
        """The equations without the numbers of pairs, and of points ("q", or "at" in their place), that are nothing in
        all designs. Raises UnsupportedOperation."""
        kinds = {"p": "p", points: "q"}
        zeros = frozenset(
            (kinds[kind], k) for (kind, k), value in self.numbers.items() if kind in kinds and value.is_zero()
        )
        return kernel_equations(self._functions, self._structure, zeros, self._stop_pairs if points == "q" else ())

    def _add(self, kind: str, values: Sequence[ca.SX | float]) -> None:
        self.numbers |= {(kind, k): ca.SX(value) for k, value in enumerate(values)}

    def _local_coordinates(self, members: Sequence[PointMember]) -> list[ca.SX]:
        """x and y of points, each of a link, in its axes."""
        return [part / self.unit for link, point in members for part in self.shapes[link].position(point)]

    def _add_inputs(
        self, reference: ReferenceDesign, inputs: Sequence[tuple[Input, ca.SX]], may_shift: Container[int]
    ) -> Iterator[ca.SX]:
        """Where the inputs are, beside where the file has them, and how fast they go; what is not below zero where
        they are where they may be."""
        for k, (given, here) in enumerate(inputs):
            runs, slides = k == reference.running_index, reference.solver.is_sliding(given.pair)
            scale = self.unit if slides else 1.0
            position, shift = ca.SX(given.position), given.position - here
            for kind, where in (("u", position), ("d", shift)):
                self.numbers[kind, k] = where / scale
                if not slides:
                    self.numbers[kind + "c", k], self.numbers[kind + "s", k] = ca.cos(where), ca.sin(where)
            for kind, rate in (("u1", given.velocity), ("u2", given.acceleration)):
                self.numbers[kind, k] = ca.SX(rate / scale if runs else 0.0)
            yield LARGEST_INPUT_POSITION - ca.fabs(self.numbers["u", k])
            if k not in may_shift:
                yield -ca.fabs(shift)

    def _triangles(self, links: Sequence[Link]) -> Iterator[tuple[tuple[ca.SX, ca.SX], ca.SX]]:
        """Of every point that is given by distances: these; how far from closing, above zero where they surely do not.

        Four times the base's square times the height's are the product of the sides' sum and the three differences of
        two sides and the third (Heron), which is below zero where one side is longer than both others.
        """
        for link in links:
            at = self.shapes[link.name].points
            for _, place in link.points:
                if isinstance(place, Distances):
                    a, b, way = place.from_first, place.from_second, at[place.second] - at[place.first]
                    square = way.dot(way)
                    along = a * a - b * b + square
                    longest = ca.fmax(ca.fmax(a * a, b * b), square)
                    yield (a, b), along * along - 4.0 * a * a * square - OPEN_TRIANGLE * longest * longest

    def _arm_margins(self, reference: ReferenceDesign) -> Iterator[ca.SX]:
        """Of every arm on which a link turns by what is solved: not below zero where it is nothing, or long enough."""
        size = self.unit * self.unit
        for shape in self.shapes.values():
            for at in shape.points.values():
                size = ca.fmax(size, at.dot(at))
        for link, first, second in reference.arms:
            way = self.shapes[link].points[second] - self.shapes[link].points[first]
            arm = way.dot(way)
            yield ca.fmax(arm - SHORT_ARM**2 * size, -arm)


def _stop_numbers(reference: ReferenceDesign) -> tuple[tuple[Pair, ...], list[float]]:
    """The pairs with stops, and their numbers. Raises UnsupportedOperation where these do not tell where they are."""
    if not reference.mechanism.stops:
        return (), []
    pairs, periodic, low, high = stop_ranges(reference, reference.mechanism, 1)
    width, open_ = (high - low)[:, 0], np.full(1, np.inf)
    if np.any(np.where(periodic, (width < LEAST_RANGES[0]) | (width > TURN + SURE_DISTANCE), width < LEAST_RANGES[1])):
        raise UnsupportedOperation("a pair has stops that are too near to each other, or more than a turn apart")
    return tuple(pairs), stop_limits(pairs, periodic.tolist(), low, high, (-open_, open_)).numbers[:, 0].tolist()
