"""A mechanism as it stands at the first entry: its points as unknown places of the plane, and how they are tied.

Every link's axes are taken parallel to the world's there, so that a point of a link is a place x + i y, and what turns
later turns from there. A pin is one place then, and lengths and coordinates that are free say nothing of it.
"""

from __future__ import annotations

from cmath import phase
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from planar.document.dimensions import change_dimension, file_dimensions
from planar.foundation.geometry import Frame, Vector
from planar.model.link_shapes import LinkShape, PointReference, link_shape
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.guide_line import GuidedPair
from planar.synthesis.exact.relations.polynomials import AngleSum, Direction, Polynomial, Symbol, complex_row, point
from planar.synthesis.exact.relations.unknowns import NumberKind, SymbolTable, refuse

PIN_KINDS = (MeasureKind.LENGTH, MeasureKind.LENGTH)
KNOWN_KINDS = (PIN_KINDS, (*PIN_KINDS, MeasureKind.ANGLE))
WORLD = Frame(0.0, 0.0, 1.0, 0.0, AngleSum({}), True)
PATCH_ANGLE = 0.7
"""rad: directions that are sought are measured along this one, so that they have one length."""


class PlacedShape(LinkShape):
    """A link whose points are places, which `find` makes as they are asked for."""

    def __init__(self, find: Callable[[PointReference], Polynomial]):
        super().__init__({}, Vector(0.0, 0.0), Vector(1.0, 0.0))
        object.__setattr__(self, "find", find)

    def position(self, point_: PointReference) -> Vector:
        """x and y of a point."""
        return point(self.find(point_))  # type: ignore[attr-defined]


@dataclass(frozen=True)
class SlidingRow:
    """A pair with a displacement: the place `slider` of its second link, the `direction` of its line, and the vector
    along the line to its second point, None where the angle of the line in its link is given or sought."""

    pair: GuidedPair
    slider: Polynomial
    direction: Polynomial
    end: Polynomial | None

    @property
    def through(self) -> PointReference:
        """The point of the line from which displacements count, by name or coordinates."""
        return self.pair.line.through


class LinkAxes(NamedTuple):
    """The axes of a link at the first entry, as far as they are known: where the x-axis goes, and the origin."""

    direction: Polynomial | None
    origin: Polynomial | None


class Coordinates(NamedTuple):
    """A point of a link in the link's axes (m), and the names of the numbers that are sought of x and y, None where
    they are given."""

    value: complex
    x: str | None
    y: str | None

    @property
    def is_given(self) -> tuple[bool, bool]:
        """Whether x and y are given."""
        return self.x is None, self.y is None


class ReferencePose:
    """The places of one mechanism; `free` are the names of the numbers that are sought."""

    def __init__(self, mechanism: Mechanism, free: Iterable[str]):
        self.mechanism, self.free = mechanism, frozenset(free)
        self.table = SymbolTable()
        self.numbers = file_dimensions(mechanism)
        self.conditions: list[Polynomial] = []
        self.places: dict[tuple[str, str], Polynomial] = {}
        "of links' points, before what ties them is put in"
        self.values: dict[int, Polynomial] = {}
        "what stands for symbols that are eliminated"
        self.axes: dict[str, LinkAxes] = {}
        "of moving links, where rows tie them"
        self.links = {each.name: each for each in mechanism.links}
        self.directions: dict[str, Direction] = {}
        "the line of a pair that has one"
        self.patched: set[str] = set()
        "pairs whose line's direction has a length of its own"
        self.pairs = [self._with_direction(pair) for pair in mechanism.pairs]
        for pair in self.pairs:
            if tuple(pair.residual_kinds) not in KNOWN_KINDS or len(pair.coordinate_kinds) > 1:
                raise refuse(f"{pair.name!r} is neither a pin nor a slide")
        for pair in self.pairs:
            if not pair.coordinate_kinds:
                (row,) = self.pair_rows(pair, dict.fromkeys(pair.bodies, WORLD), ())[0]
                self.tie(row)
        self.slides = [self._sliding_row(pair) for pair in self.pairs if pair.coordinate_kinds]

    # points

    def shape(self, link: str) -> PlacedShape:
        """A link with places for points."""
        return PlacedShape(lambda name: self.place(link, name))

    def place(self, link: str, name: PointReference) -> Polynomial:
        """x + i y of a point, as far as it is known."""
        if not isinstance(name, str):
            raise refuse(f"a pin of {link!r} is a place without a name")
        if (link, name) not in self.places:
            fixed = link == self.mechanism.frame
            self.places[link, name] = self._fixed_place(name) if fixed else self.table.add().value
        return self.places[link, name].substitute(self.values)

    def _fixed_place(self, name: str) -> Polynomial:
        at = self.coordinates(self.mechanism.frame, name)
        if all(at.is_given):
            return self.table.add_given(NumberKind.PLACE, at.value).value
        found = self.table.add_unknown().value
        if any(at.is_given):
            off = found - self.table.add_given(NumberKind.PLACE, at.value).value
            self.conditions.append(off + off.conjugate if at.is_given[0] else off - off.conjugate)
        return found

    def coordinates(self, link: str, name: PointReference, pair: Pair | None = None) -> Coordinates:
        """A point of a link, or what the line of a pair goes through, in the link's axes. Raises BadInput where a
        number that is sought is no coordinate of it."""
        index = [each.name for each in self.mechanism.links].index(link)
        places = [("links", index)]
        if pair is not None:
            places.append(("pairs", [each.name for each in self.mechanism.pairs].index(pair.name)))

        def position(mechanism: Mechanism) -> complex:
            spot = name
            if pair is not None:
                line, original = (each.pairs[places[1][1]].line for each in (mechanism, self.mechanism))  # type: ignore[attr-defined]
                spot = line.to if name == original.to else line.through
            at = link_shape(mechanism.links[index]).position(spot)
            return complex(at.x, at.y)

        start, names = position(self.mechanism), dict[complex, str]()
        for each in self.numbers.values():
            if each.name in self.free and each.address[:2] in places:
                step = position(change_dimension(self.mechanism, each, each.value + 1.0)) - start
                step = complex(round(step.real, 9), round(step.imag, 9))
                if step not in (0.0, 1.0, 1.0j) or step in names:
                    raise refuse(f"{name!r} of {link!r} is not written by its coordinates, and {each.name!r} is free")
                if step:
                    names[step] = each.name
        return Coordinates(start, names.get(1.0 + 0.0j), names.get(1.0j))

    # pairs

    def _with_direction(self, pair: Pair) -> Pair:
        """The pair with a symbol for the direction of its line, if it has one."""
        if not isinstance(pair, GuidedPair):
            return pair
        turn = self.line_turn(pair) if pair.links[0] == self.mechanism.frame else None
        symbol = self.table.add() if turn is None else self.table.add_given(NumberKind.TURN, turn)
        self.directions[pair.name] = Direction(symbol)
        line = pair.line._replace(to=None, angle=self.directions[pair.name])  # type: ignore[arg-type]
        return replace(pair, line=line)

    def is_known(self, value: Polynomial) -> bool:
        """Whether all of it is given or sought."""
        symbols = [number.symbol for number in self.table.given] + self.table.unknowns
        return value.substitute(self.values).symbols <= {k for symbol in symbols for k in symbol}

    def seek_direction(self, pair: str, is_unit: bool) -> None:
        """Seek the direction of a line where it is neither given nor tied: of length one, or of one length along a
        direction, which leaves its sign open and has no second solution."""
        way = self.directions[pair].symbol
        if self.is_known(way.value):
            return
        self.table.unknowns.append(way)
        if is_unit:
            self.conditions.append(way.value * way.value.conjugate - 1.0)
            return
        self.patched.add(pair)
        along = way.value * self.table.add_given(NumberKind.TURN, PATCH_ANGLE).value.conjugate
        self.conditions.append(along + along.conjugate - 2.0)

    def line_turn(self, pair: GuidedPair) -> float | None:
        """The angle of a pair's line in the axes of its link (rad); None where a number of it is sought."""
        if pair.line.to is None:
            return None if f"{pair.name}.line.angle" in self.free else pair.line.angle
        ends = [self.coordinates(pair.links[0], end, pair) for end in (pair.line.through, pair.line.to)]
        return phase(ends[1].value - ends[0].value) if all(map(all, (end.is_given for end in ends))) else None

    def pair_rows(
        self, pair: Pair, frames: dict[str, Frame], own: Sequence[Polynomial]
    ) -> tuple[list[Polynomial], list[AngleSum]]:
        """The row x + i y of a pair where its links have these frames, and what its row between angles adds up."""
        shapes: list[Any] = [self.shape(link) for link in pair.bodies]
        if own:  # its line goes through where its point is at the first entry, so that it slides from there
            through = self.place(pair.bodies[1], pair.point_on_line()[0][1])  # type: ignore[index]
            shapes[0] = PlacedShape(lambda _: through)
        numbers = pair.measure(shapes)
        rows = pair.residual([frames[link] for link in pair.bodies], numbers, own)
        turns = [each if isinstance(each, AngleSum) else AngleSum({}) for each in rows[2:]]
        return [complex_row(rows[0], rows[1])], turns

    def _sliding_row(self, pair: Pair) -> SlidingRow:
        if not isinstance(pair, GuidedPair):
            raise refuse(f"{pair.name!r} does not slide along a line")
        original = next(each for each in self.mechanism.pairs if each.name == pair.name)
        line, link = original.line, pair.links[0]  # type: ignore[attr-defined]
        end = None
        if line.to is not None and self.line_turn(original) is None:  # type: ignore[arg-type]
            end = self.place(link, line.to) - self.place(link, line.through)
        slider = self.place(pair.links[1], pair.point)
        return SlidingRow(original, slider, self.directions[pair.name].symbol.value, end)  # type: ignore[arg-type]

    # ties

    def tie(self, row: Polynomial) -> None:
        """Keep a complex row at zero: by eliminating a place that stands in it alone, or as two conditions."""
        row = row.substitute(self.values)
        known = {each.symbol.own for each in self.table.given}
        sought = {each.own for each in self.table.unknowns}
        moving = [k for k in sorted(row.symbols) if k % 2 == 0 and k not in known]
        for k in sorted(moving, key=lambda each: each in sought):
            powers = row.by_powers(k)
            factor = powers.get(1, Polynomial({})).constant()
            if len(powers) <= 2 and 2 not in powers and factor:
                value = powers.get(0, Polynomial({})) * (-1.0 / factor)
                new = {k: value, k + 1: value.conjugate}
                self.values = {key: each.substitute(new) for key, each in self.values.items()} | new
                self.table.unknowns = [each for each in self.table.unknowns if each.own != k]
                self.conditions = [each.substitute(new) for each in self.conditions]
                return
        if row.symbols:
            self.conditions += [row, row.conjugate]

    def finish(self) -> None:
        """What is left of the places of moving links is sought."""
        known = {each.symbol.own for each in self.table.given} | {each.own for each in self.table.unknowns}
        for place in self.places.values():
            for k in sorted({each & ~1 for each in place.substitute(self.values).symbols} - known):
                known.add(k)
                self.table.unknowns.append(Symbol(k, k + 1))
        self.conditions = [each.substitute(self.values) for each in self.conditions]
