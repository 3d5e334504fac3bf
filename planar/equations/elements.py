"""Elements: the formulas of pairs, each derived once, from which the equations of any mechanism are assembled.

Two pairs whose formulas perform the same operations share an element, whatever their names and numbers are. A row of
an element is a sum of coordinates times constant factors and a *rest* that is not linear in the coordinates.

What casadi derived of elements and block types is kept with the package as texts. A line of the file has a fingerprint
of what the text was derived from, and the text. It is made by `python -m tests.known_types`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.codegen.printed_formula import PrintedFunction, compile_formula
from planar.equations.elimination import stack_expressions
from planar.equations.sparse_matrices import SparsePattern
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame
from planar.foundation.jets import Scalar
from planar.foundation.lazy_module import LazyModule
from planar.foundation.recorded_formula import RecordedFormula, RecordedNumber, record_formula
from planar.foundation.safe_files import read_package_text
from planar.model.pairs import Pair

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # most elements are known

KNOWN_TYPES_FILE = Path(__file__).with_name("known_types.txt")
FINGERPRINT_LENGTH = 24
PARTS_OF_FRAME = 5
"""x, y, cos, sin and angle of a frame are the arguments of a recorded formula."""
MAX_RECORDED_PAIRS = 2**14
PairFormula = Callable[[Sequence[Frame], Sequence[Scalar], Sequence[Scalar]], Sequence[Scalar]]
"""(frames of its bodies, numbers, own coordinates) -> values."""
MAX_ELEMENTS = 1024


def fingerprint(*parts: object) -> str:
    """What tells a type that is derived from these parts from others, in every process."""
    return sha256(repr(parts).encode()).hexdigest()[:FINGERPRINT_LENGTH]


@cache
def _texts() -> dict[str, str]:
    """All texts by their fingerprints."""
    return dict(line.split("\t", 1) for line in read_package_text(KNOWN_TYPES_FILE).splitlines())


def known_text(type_fingerprint: str) -> str | None:
    """The text of an element or block type; None for one that is not known."""
    return _texts().get(type_fingerprint)


def pair_formula(pair: Pair, is_input: bool) -> PairFormula:
    """The residual of a pair, or with `is_input` the position of its relative motion."""
    return (lambda *arguments: (pair.input_position(*arguments),)) if is_input else pair.residual


def recorded_pair_formula(
    pair: Pair, is_input: bool, is_moving: tuple[bool, ...], own_count: int, number_count: int
) -> RecordedFormula:
    """The operations of a pair's formula, of which bodies (bodies,) move; the others are the frame.

    Its arguments are the frames of the moving bodies, own coordinates, numbers.
    """
    try:
        hash(pair)
    except TypeError:  # made in Python, of lists
        return _record.__wrapped__(pair, is_input, is_moving, own_count, number_count)
    return _record(pair, is_input, is_moving, own_count, number_count)


@lru_cache(maxsize=MAX_RECORDED_PAIRS)
def _record(
    pair: Pair, is_input: bool, is_moving: tuple[bool, ...], own_count: int, number_count: int
) -> RecordedFormula:
    moving = [link for link, moves in zip(pair.bodies, is_moving, strict=True) if moves]
    own_start = PARTS_OF_FRAME * len(moving)
    own_end = own_start + own_count

    def recorded(arguments: Sequence[RecordedNumber]) -> Sequence[Scalar]:
        parts = (arguments[k : k + PARTS_OF_FRAME] for k in range(0, own_start, PARTS_OF_FRAME))
        frames = {link: Frame(x, y, c, s, angle) for link, (x, y, c, s, angle) in zip(moving, parts, strict=True)}
        bodies = [frames.get(link, GROUND) for link in pair.bodies]
        return pair_formula(pair, is_input)(bodies, arguments[own_end:], arguments[own_start:own_end])

    return record_formula(recorded, own_end + number_count)


class ElementKey(NamedTuple):
    """What an element is derived from: a formula of the frames of moving bodies, own coordinates of a pair, numbers."""

    formula: RecordedFormula
    body_count: int
    own_count: int
    number_count: int

    @property
    def fingerprint(self) -> str:
        """What tells the element from others in every process."""
        return fingerprint(self.formula.as_text(), *self[1:])


class ElementArguments(NamedTuple):
    """What an element's functions take, in this order: local coordinates (x, y, angle of every moving body, then own
    ones), cosines and sines of bodies' angles, and numbers, each by its index."""

    coordinates: tuple[int, ...]
    cosines: tuple[int, ...]
    sines: tuple[int, ...]
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Element:
    """One formula of a pair type: its linear part, its rest, and the derivatives of the rest."""

    fingerprint: str
    "what tells it from others in every process"
    body_count: int
    coordinate_count: int
    factors: tuple[Mapping[int, float], ...]
    "for every row the constant factors of local coordinates"
    nonlinear: tuple[frozenset[int], ...]
    "for every row the local coordinates on which its rest depends"
    arguments: ElementArguments
    "what the functions of the rest take"
    rest: RecordedFormula
    "(arguments) -> the rests (rows,)"
    slopes: RecordedFormula
    "(arguments) -> the rests (rows,), then their derivatives (slope entries,)"
    second_rates: RecordedFormula
    "(arguments, rates of local coordinates) -> the second rates of the rests (rows,), coordinates without any"

    def as_text(self) -> str:
        """All but the fingerprint in one line of JSON."""
        factors = [list(factors.items()) for factors in self.factors]
        formulas = [formula.as_text() for formula in (self.rest, self.slopes, self.second_rates)]
        nonlinear = [sorted(columns) for columns in self.nonlinear]
        return json.dumps([self.body_count, self.coordinate_count, factors, nonlinear, self.arguments, *formulas])

    @classmethod
    def from_text(cls, fingerprint: str, text: str) -> Element:
        """The element of `as_text`."""
        bodies, coordinates, factors, nonlinear, arguments, *formulas = json.loads(text)
        return cls(
            fingerprint,
            bodies,
            coordinates,
            tuple(map(dict, factors)),
            tuple(map(frozenset, nonlinear)),
            ElementArguments(*map(tuple, arguments)),
            *map(RecordedFormula.from_text, formulas),
        )

    @property
    def row_count(self) -> int:
        """How many rows the formula has."""
        return len(self.factors)

    @cached_property
    def slope_entries(self) -> list[tuple[int, int]]:
        """The rows and local coordinates of the derivatives of the rest."""
        return [(row, column) for row, columns in enumerate(self.nonlinear) for column in sorted(columns)]

    @cached_property
    def rest_function(self) -> PrintedFunction:
        """`rest` of arrays."""
        return self._compile(self.rest)

    @cached_property
    def slopes_function(self) -> PrintedFunction:
        """`slopes` of arrays."""
        return self._compile(self.slopes)

    @cached_property
    def second_rates_function(self) -> PrintedFunction:
        """`second_rates` of arrays."""
        return self._compile(self.second_rates, self.coordinate_count)

    def _compile(self, formula: RecordedFormula, more_arguments: int = 0) -> PrintedFunction:
        return compile_formula(formula, sum(map(len, self.arguments)) + more_arguments)


class PlacedElement(NamedTuple):
    """An element between links of a mechanism: which coordinates and numbers of it stand for its own, and its rows."""

    element: Element
    coordinates: tuple[int, ...]
    "indices in (w, u)"
    numbers: tuple[int, ...]
    "indices in p"
    rows: range


def derive_element(key: ElementKey) -> Element:
    """The element of a formula."""
    return _ElementDerivation(key).element(key.fingerprint)


class _ElementDerivation:
    """The rests of a formula as expressions, and their derivatives."""

    def __init__(self, key: ElementKey):
        formula, bodies, own_count, number_count = key
        self._body_count, self._coordinate_count = bodies, 3 * bodies + own_count
        self._coordinates = [ca.SX.sym(f"q{k}") for k in range(self._coordinate_count)]
        self._cosines = [ca.SX.sym(f"c{body}") for body in range(bodies)]
        self._sines = [ca.SX.sym(f"s{body}") for body in range(bodies)]
        self._numbers = [ca.SX.sym(f"n{k}") for k in range(number_count)]
        arguments: list[ca.SX] = []
        for k in range(bodies):
            x, y, angle = self._coordinates[3 * k : 3 * k + 3]
            arguments += [x, y, self._cosines[k], self._sines[k], angle]
        arguments += [*self._coordinates[3 * bodies :], *self._numbers]
        assert len(arguments) == PARTS_OF_FRAME * bodies + own_count + number_count
        self._factors: list[dict[int, float]] = []
        self._nonlinear: list[set[int]] = []
        self._rest: list[ca.SX] = []
        everything = stack_expressions([*self._coordinates, *self._cosines, *self._sines])
        for value in map(ca.SX, formula.evaluate(arguments)):
            slopes = ca.jacobian(value, everything)
            factors, nonlinear = {}, set()
            for place, column in enumerate(slopes.sparsity().get_triplet()[1]):
                slope = slopes.nz[place]
                if column < self._coordinate_count and slope.is_constant():
                    factors[column] = float(slope)
                else:
                    body = (column - self._coordinate_count) % max(bodies, 1)
                    nonlinear.add(column if column < self._coordinate_count else 3 * body + 2)
            linear = stack_expressions(self._coordinates[column] for column in factors)
            self._factors.append(factors)
            self._nonlinear.append(nonlinear)
            self._rest.append(ca.substitute(value, linear, ca.SX.zeros(len(factors))) if factors else value)

    def element(self, fingerprint: str) -> Element:
        """All that an element consists of."""
        entries = [(row, column) for row, columns in enumerate(self._nonlinear) for column in sorted(columns)]
        slopes = [self._derivative(self._rest[row], column) for row, column in entries]
        groups = self._coordinates, self._cosines, self._sines, self._numbers
        symbols = {symbol.name() for symbol in ca.symvar(stack_expressions([*self._rest, *slopes]))}
        arguments = ElementArguments(
            *(tuple(k for k, symbol in enumerate(group) if symbol.name() in symbols) for group in groups)
        )
        column = stack_expressions(group[k] for group, indices in zip(groups, arguments, strict=True) for k in indices)
        rates = ca.SX.sym("rate", self._coordinate_count)
        second = [ca.SX(0.0) for _ in self._rest]
        for (row, place), slope in zip(entries, slopes, strict=True):
            for other in self._nonlinear[row]:
                second[row] = second[row] + rates[place] * rates[other] * self._derivative(slope, other)
        return Element(
            fingerprint,
            self._body_count,
            self._coordinate_count,
            tuple(self._factors),
            tuple(map(frozenset, self._nonlinear)),
            arguments,
            _recorded([column], self._rest),
            _recorded([column], [*self._rest, *slopes]),
            _recorded([column, rates], second),
        )

    def _derivative(self, value: ca.SX, column: int) -> ca.SX:
        """The derivative by a local coordinate; cos and sin of an angle change with it."""
        slope = ca.jacobian(value, self._coordinates[column])
        body, part = divmod(column, 3)
        if part == 2 and body < self._body_count:
            cosine, sine = self._cosines[body], self._sines[body]
            slope = slope - sine * ca.jacobian(value, cosine) + cosine * ca.jacobian(value, sine)
        return slope


def _recorded(arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> RecordedFormula:
    from planar.equations.casadi_functions import recorded_function  # most elements are known

    return recorded_function(ca.Function("formula", arguments, [ca.densify(stack_expressions(results))]))


@lru_cache(maxsize=MAX_ELEMENTS)
def element_of_key(key: ElementKey) -> Element:
    """The element of a formula; pairs of the same formula share it."""
    text = known_text(key.fingerprint)
    return derive_element(key) if text is None else Element.from_text(key.fingerprint, text)


class ElementPlacement:
    """Finds the elements of pairs: `frame_columns` are the coordinates x, y, angle of every link that moves,
    `own_columns` and `number_columns` those of every pair."""

    def __init__(
        self,
        frame_columns: Mapping[str, Sequence[int]],
        own_columns: Mapping[str, Sequence[int]],
        number_columns: Mapping[str, Sequence[int]],
    ):
        self._frame_columns, self._own_columns, self._number_columns = frame_columns, own_columns, number_columns

    def residual_of(self, pair: Pair, first_row: int) -> PlacedElement:
        """The element of a pair's residual; its rows begin with a row."""
        return self._place(pair, False, range(first_row, first_row + len(pair.residual_kinds)))

    def input_position_of(self, pair: Pair, row: int) -> PlacedElement:
        """The element of the position of a relative motion."""
        return self._place(pair, True, range(row, row + 1))

    def _place(self, pair: Pair, is_input: bool, rows: range) -> PlacedElement:
        is_moving = tuple(link in self._frame_columns for link in pair.bodies)
        own_columns, numbers = self._own_columns.get(pair.name, ()), self._number_columns.get(pair.name, ())
        formula = recorded_pair_formula(pair, is_input, is_moving, len(own_columns), len(numbers))
        key = ElementKey(formula, sum(is_moving), len(own_columns), len(numbers))
        columns = [column for link in pair.bodies for column in self._frame_columns.get(link, ())]
        return PlacedElement(element_of_key(key), (*columns, *own_columns), tuple(numbers), rows)


class ElementGroup(NamedTuple):
    """The places of one element. Indices (places, ...): `coordinates` in w, `numbers` in p, `rows` of the formulas."""

    element: Element
    coordinates: IntArray
    numbers: IntArray
    rows: IntArray

    def evaluate(self, w: Array, p: Array) -> tuple[Array, Array]:
        """The values (n, places, rows) and their derivatives (n, places, rows, local coordinates).

        At coordinates w (n, coordinates), with cos and sin made from the angles, and numbers p (n, numbers), or (1,
        numbers) for all.
        """
        element, taken = self.element, self.element.arguments
        coordinates = w[:, self.coordinates]
        angles = coordinates[..., 2 : 3 * element.body_count : 3]
        arguments = [
            *(coordinates[..., k] for k in taken.coordinates),
            *(np.cos(angles[..., k]) for k in taken.cosines),
            *(np.sin(angles[..., k]) for k in taken.sines),
            *(p[:, self.numbers[:, k]] for k in taken.numbers),
        ]
        with np.errstate(all="ignore"):  # what is not defined is not a number
            rests = element.slopes_function(*arguments)
        slopes: Array = np.zeros((*coordinates.shape[:2], element.row_count, element.coordinate_count))
        for row, factors in enumerate(element.factors):
            for column, factor in factors.items():
                slopes[..., row, column] = factor
        values = (slopes @ coordinates[..., None])[..., 0]  # the linear parts
        for row, rest in enumerate(rests[: element.row_count]):
            values[..., row] += rest
        for (row, column), slope in zip(element.slope_entries, rests[element.row_count :], strict=True):
            slopes[..., row, column] += slope
        return values, slopes


def group_elements(placed_elements: Iterable[PlacedElement]) -> list[ElementGroup]:
    """The groups of placed elements."""
    members: dict[Element, list[PlacedElement]] = {}
    for placed in placed_elements:
        members.setdefault(placed.element, []).append(placed)
    return [
        ElementGroup(
            element,
            np.array([placed.coordinates for placed in group], dtype=int),
            np.array([placed.numbers for placed in group], dtype=int).reshape(len(group), -1),
            np.array([placed.rows for placed in group], dtype=int),
        )
        for element, group in members.items()
    ]


def pattern_of_groups(
    groups: Sequence[ElementGroup], row_count: int, coordinate_count: int
) -> tuple[SparsePattern, list[IntArray]]:
    """Where the entries of dF/dq stand, and of every group which of them its slopes are (elements, rows, local
    coordinates); a link may be two bodies of a pair, whose slopes are then added up."""
    shape = row_count, coordinate_count
    places = [(group.coordinates[:, None, :] * row_count + group.rows[:, :, None]).ravel() for group in groups]
    entries, indices = np.unique(np.concatenate([np.zeros(0, dtype=int), *places]), return_inverse=True)
    columns, rows = np.divmod(entries, max(shape[0], 1))
    first = np.searchsorted(columns, np.arange(shape[1] + 1))
    stops = np.cumsum([len(part) for part in places], dtype=int)
    entries_of_groups: list[IntArray] = [
        indices[end - len(part) : end].reshape(*group.rows.shape, group.coordinates.shape[1])
        for end, part, group in zip(stops, places, groups, strict=True)
    ]
    return SparsePattern(shape, rows, first), entries_of_groups
