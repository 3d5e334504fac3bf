"""Block types: links that are solved together from others whose poses are known, with all their formulas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache, partial
from itertools import product
from typing import NamedTuple, TypeVar

import casadi as ca

from planar.batch.march.kernel import closing_errors
from planar.codegen.instructions import CosSin, check_length, expand_angle_sums
from planar.codegen.tape import BlockFormula, FormulaInput
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.generic_evaluation import inline_function
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.rates import UnknownRates, block_jacobian, first_and_second_rates
from planar.equations.symbolic_equations import Block, ConstraintEquations, build_equations, slice_length
from planar.foundation.geometry import GROUND, frame_at
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.model.link_shapes import Link
from planar.model.mechanism import Input, Mechanism
from planar.model.pairs import MeasureKind as Measure
from planar.model.pairs import Pair

FRAME_BODY = -99
"""The body of a signature that is the mechanism's frame."""
X, Y, COS, SIN, X1, Y1, TURN1, X2, Y2, TURN2 = range(10)
"""Rows of a slot: where a link is, then its rates. Of an input X is its position, X1 and X2 its rates."""
POSE_ROWS = 4
"""Rows of a slot that are a link's place: x, y, cos and sin."""
SKETCH_SUMS = 8
"""Numbers of a link's points in the sketch: how many, their sums in the link and in the world, and mixed ones."""


class BlockPair(NamedTuple):
    """A pair of a block type: its pair type, its bodies (inner links 0, 1, ..., given ones -1, -2, ...), and whether it
    is driven."""

    type: type[Pair]
    bodies: tuple[int, ...]
    driven: bool


class BlockSignature(NamedTuple):
    """What defines a block type: the counts of inner and given links, and the pairs in their order."""

    inner_count: int
    given_count: int
    pairs: tuple[BlockPair, ...]


class _SymbolicPair:
    """A pair between the links of a block type: the formulas of its pair type with other bodies."""

    def __init__(self, name: str, joint: BlockPair):
        like = _sample_pair(joint.type)
        self.name, self.bodies = name, tuple(_body_name(body) for body in joint.bodies)
        self.residual_kinds, self.number_kinds = like.residual_kinds, like.number_kinds
        self.coordinate_kinds, self.input_kind = like.coordinate_kinds, like.input_kind
        self.residual, self.input_position = like.residual, like.input_position

    def entry_name(self) -> str:
        return self.name

    @classmethod
    def relative_motions(cls, group: Sequence[_SymbolicPair]) -> tuple[_SymbolicPair, ...]:
        return tuple(group)


def _body_name(body: int) -> str:
    return "frame" if body == FRAME_BODY else f"inner{body}" if body >= 0 else f"given{-1 - body}"


MAX_SIGNS = 2
"""Maximum number of signs of a block type in closed form."""
MAX_BLOCK_TYPES = 1024
"""Number of block types that are kept."""


class BlockType:
    """One type of block: its equations, in closed form where there is one, and the formulas that solve it.

    Slots are the given links, the inputs, then the inner links. Numbers are p of the pairs, the cosine and sine of
    those that are angles, then a sign for each group of equations that has two assembly modes; at the start, in place
    of the signs, the sums of the points in the sketch, see `_sketch_sums` of the initial assembly.
    """

    def __init__(self, signature: BlockSignature):
        self.signature = signature
        pairs = tuple(_SymbolicPair(f"p{k}", pair) for k, pair in enumerate(signature.pairs))
        self.given_links = tuple(_body_name(-1 - k) for k in range(signature.given_count))
        inner = tuple(_body_name(k) for k in range(signature.inner_count))
        self.inner_links = inner
        inputs = tuple(Input(p.name, 0.0) for p, joint in zip(pairs, signature.pairs, strict=True) if joint.driven)
        names = ("frame", *inner, *self.given_links)
        links = tuple(Link(name) for name in names)
        self.mechanism = Mechanism("", "frame", links, pairs, inputs)  # type: ignore[arg-type]  # pairs as equations ask for them
        self.equations: ConstraintEquations = build_equations(self.mechanism, self.given_links)
        e = self.equations
        self.input_count = len(inputs)
        self.slot_count = len(self.given_links) + self.input_count + len(inner)
        self.measures = tuple(measure for pair in pairs for measure in pair.number_kinds)
        self.angle_measures = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.ANGLE)
        self.length_measures = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.LENGTH)
        self.blocks = tuple(stage for stage in e.blocks if slice_length(stage.rows) or slice_length(stage.unknowns))
        self.closed_forms = [find_closed_form(e, stage) or linear_form(e, stage) for stage in self.blocks]
        self.sign_count = sum(isinstance(form, ClosedForm) for form in self.closed_forms)
        "how many groups of its equations have two assembly modes"
        self.is_square = e.is_square

        self.has_closed_form = (
            self.is_square and self.sign_count <= MAX_SIGNS and all(form is not None for form in self.closed_forms)
        )
        "whether all unknowns are in closed form, by formulas that can be compiled"
        self.has_newton_formulas = False
        "whether Newton's method can follow it, where it is not in closed form"
        self._run_formulas: dict[tuple[bool, bool], BlockFormula] = {}
        if self.has_closed_form:
            try:
                self.start_formula, self.run_formula(False)
            except UnsupportedOperation:
                self.has_closed_form = False
        if self.is_square and not self.has_closed_form:
            with suppress(UnsupportedOperation):
                self.has_newton_formulas = self.newton_formulas is not None

    @property
    def unknown_is_angle(self) -> tuple[bool, ...]:
        """Of every unknown whether it is an angle."""
        e = self.equations
        return tuple(e.coordinates[column].kind is not Measure.LENGTH for column in e.unknowns)

    @property
    def number_count(self) -> int:
        """How many numbers of its pairs it takes, with the cosine and sine of angles."""
        return len(self.measures) + 2 * len(self.angle_measures)

    @cached_property
    def start_formula(self) -> BlockFormula:
        """(given links and inputs, numbers with sums of the sketch) -> of the assembly mode nearest to the sketch x, y,
        cos and sin of the inner links, then its signs, its squared distance, that of the next mode, its residual, and
        the least distance measure of any mode from a dead point."""
        work = FormulaBuilder(self)
        sums = [
            [work.add_input("p", self.number_count + SKETCH_SUMS * k + i) for i in range(SKETCH_SUMS)]
            for k in range(len(self.inner_links))
        ]
        modes = []
        for signs in product((1.0, -1.0), repeat=self.sign_count):
            sign_numbers = [work.instructions.add_constant(sign) for sign in signs]
            assembly = work.closed_form_assembly(sign_numbers)
            poses = work.poses(assembly)
            residual, clear = work.acceptance_values(assembly, poses)
            outputs = [*(number for pose in poses for number in pose), *sign_numbers, residual]
            modes.append(_StartMode(outputs, work.sketch_distance(poses, sums), residual, clear))
        *outputs, residual, nearest, second, least_clear = work.nearest_mode(modes)
        return work.make_formula([*outputs, nearest, second, residual, least_clear])

    @cached_property
    def newton_formulas(self) -> NewtonFormulas:
        """The formulas by which Newton's method follows a type that is not in closed form. Raises
        UnsupportedOperation."""
        return NewtonFormulas(*(FormulaBuilder(self).newton_formula(rates) for rates in (None, False, True)))

    def run_formula(self, rates: bool, polished: bool = False) -> BlockFormula:
        """(given links and inputs, numbers) -> rows of the inner links, then the residual and the distance measure from
        a dead point."""
        if (rates, polished) not in self._run_formulas:
            work = FormulaBuilder(self)
            signs = [work.add_input("p", self.number_count + k) for k in range(self.sign_count)]
            assembly = work.closed_form_assembly(signs, polished)
            poses = work.poses(assembly)
            outputs = [*work.link_rows(assembly, poses, rates), *work.acceptance_values(assembly, poses)]
            self._run_formulas[rates, polished] = work.make_formula(outputs)
        return self._run_formulas[rates, polished]


class LinearForm(NamedTuple):
    """A group of lengths that has one assembly: as `ClosedForm`, without a sign."""

    values: tuple[tuple[ca.SX], ...]
    coalescence: ca.SX


def linear_form(e: ConstraintEquations, stage: Block) -> LinearForm | None:
    """The only assembly of a group of one or two lengths whose constraints are linear in them; None for others."""
    count = slice_length(stage.unknowns)
    lengths = all(e.coordinates[column].kind is Measure.LENGTH for column in e.unknowns[stage.unknowns])
    if stage.is_free or count != slice_length(stage.rows) or count > 2 or not lengths:
        return None
    rows, unknowns = e.F[stage.rows], e.z[stage.unknowns]
    jacobian = ca.densify(ca.jacobian(rows, unknowns))
    if any(e.rows[row].kind is Measure.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    if ca.jacobian_sparsity(jacobian, unknowns).nnz():
        return None
    values = -solve_by_determinants(jacobian, ca.substitute(rows, unknowns, ca.SX.zeros(count)))
    if count == 1:
        return LinearForm(((values,),), ca.SX(0.0))
    det = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
    coalescence = 1.0 - det * det / (ca.sumsqr(jacobian[:, 0]) * ca.sumsqr(jacobian[:, 1]))
    return LinearForm(tuple((values[k],) for k in range(count)), coalescence)


NAN_PROBE = 1e-300
"""A number times it is negligible beside round-off; NaN and infinity times it are not."""


FAR_AWAY = 1e300
"""A squared distance, greater than any residual of an assembly."""


class SymbolicAssembly(NamedTuple):
    """An assembly of a block type: the numbers of the values that stand for its unknowns, and of its coalescences."""

    z: list[int]
    cos_sin: dict[int, CosSin]
    coalescences: list[int]


Value = TypeVar("Value", int, str)


def rotate(
    add: Callable[[str, Value, Value], Value], constant: Callable[[float], Value], c: Value, s: Value, angle: Value
) -> tuple[Value, Value]:
    """The cos and sin of an angle moved on by another one: by the rational rotation, the same to third order.

    `add` writes an operation, and `constant` a number.
    """
    half = add("mul", constant(0.5), angle)
    square = add("mul", half, half)
    scale = add("div", constant(1.0), add("add", constant(1.0), square))
    cos, sin = add("mul", add("sub", constant(1.0), square), scale), add("mul", angle, scale)
    return (
        add("sub", add("mul", c, cos), add("mul", s, sin)),
        add("add", add("mul", s, cos), add("mul", c, sin)),
    )


class _StartMode(NamedTuple):
    """Values of one assembly mode by their numbers: its outputs, its squared distance to the sketch, its residual, and
    its distance measure from a dead point."""

    outputs: list[int]
    distance: int
    residual: int
    clear: int


class FormulaBuilder:
    """Writes the formulas of a block type into one list of instructions."""

    def __init__(self, block_type: BlockType):
        self.block_type, self.equations = block_type, block_type.equations
        self.instructions: InstructionList[FormulaInput] = InstructionList()
        e, given, measures = self.equations, len(block_type.given_links), block_type.measures
        self.symbols = [e.u, e.p, ca.SX.sym("u1", e.u.numel()), ca.SX.sym("u2", e.u.numel())]
        self.u: list[int] = []
        self.cos_sin: dict[int, CosSin] = {}
        for k in range(e.u.numel()):
            slot, part = (k // 3, k % 3) if k < 3 * given else (given + k - 3 * given, 0)
            self.u.append(self.add_input("angle", slot) if part == 2 else self.add_input("row", slot, part))
            if part == 2 or e.input_kinds[k] is not Measure.LENGTH:
                self.cos_sin[self.u[-1]] = CosSin(self.add_input("row", slot, COS), self.add_input("row", slot, SIN))
        self.p = [self.add_input("p", k) for k in range(len(measures))]
        for place, k in enumerate(block_type.angle_measures):
            both = (self.add_input("p", len(measures) + 2 * place + part) for part in (0, 1))
            self.cos_sin[self.p[k]] = CosSin(*both)
        rows = [(k // 3, X1 + k % 3, X2 + k % 3) if k < 3 * given else (given + k - 3 * given, X1, X2)
                for k in range(e.u.numel())]  # fmt: skip
        self.u1 = [self.add_input("row", slot, first) for slot, first, _ in rows]
        self.u2 = [self.add_input("row", slot, second) for slot, _, second in rows]
        pairs = {pair.name: pair for pair in block_type.mechanism.pairs}
        self.inner_frames, self.pair_coordinates = frames_from_coordinates(
            ca.vertsplit(e.w), coordinate_columns(e.coordinates), block_type.inner_links, pairs
        )
        "of the inner links, and of pairs by name, in the unknowns"

    def add_input(self, source: str, place: int, part: int = 0) -> int:
        """Add an input; "angle" and "unknown" are represented by their cos and sin."""
        return self.instructions.add_input(FormulaInput(source, place, part))

    def add_unknown(self) -> int:
        """Add a new value, represented by its cos and sin, or by its parts."""
        return self.add_input("unknown", len(self.instructions.instructions))

    def _inline(self, outputs: list[ca.SX], z: list[int], further: Sequence[tuple[ca.SX, list[int]]] = ()) -> list[int]:
        """The values of expressions in z, u, p, u1, u2 and further symbols, each with its numbers."""
        column = ca.densify(ca.vertcat(*outputs))
        symbols, numbers = [symbol for symbol, _ in further], [values for _, values in further]
        function = ca.Function("part", [self.equations.z, *self.symbols, *symbols], [column], {"cse": True})
        return inline_function(self.instructions, function, [z, self.u, self.p, self.u1, self.u2, *numbers])[0]

    def closed_form_assembly(self, signs: Sequence[int], polished: bool = False) -> SymbolicAssembly:
        """The unknowns, group after group, by their closed forms; polished by a step of Newton's method."""
        e, first = self.equations, len(self.instructions.instructions)
        z = [self.add_input("unknown", first, k) for k in range(e.z.numel())]
        cos_sin, coalescences, unused_signs = {}, [], iter(signs)
        for stage, form in zip(self.block_type.blocks, self.block_type.closed_forms, strict=True):
            assert form is not None
            outputs = [*(part for value in form.values for part in value), form.coalescence]
            sign = [(form.sign, [next(unused_signs)])] if isinstance(form, ClosedForm) else []
            values = iter(self._inline(outputs, z, sign))
            columns = range(stage.unknowns.start, stage.unknowns.stop)
            parts = {k: [next(values) for _ in value] for k, value in zip(columns, form.values, strict=True)}
            coalescences.append(next(values))
            if polished:
                parts = self._polish(stage, z, parts)
            for k, value in parts.items():
                if len(value) == 2:
                    self.cos_sin[z[k]] = cos_sin[k] = CosSin(*value)
                else:
                    z[k] = value[0]
        return SymbolicAssembly(z, cos_sin, coalescences)

    def newton_formula(self, rates: bool | None) -> BlockFormula:
        """One of the formulas of `NewtonFormulas`: None for the step, else the rows of links without or with rates."""
        e, kind = self.equations, self.block_type
        z, cos_sin = [], {}
        for k, is_angle in enumerate(kind.unknown_is_angle):
            z.append(self.add_unknown() if is_angle else self.add_input("z", k, 0))
            if is_angle:
                cos_sin[k] = self.cos_sin[z[k]] = CosSin(self.add_input("z", k, 0), self.add_input("z", k, 1))
        if rates is None:
            step, square, *lengths = solve_with_volume(ca.densify(ca.jacobian(e.F, e.z)), e.F)
            strength = square / lengths[0] if lengths else square
            return self.make_formula(self._inline([step, strength], z))
        assembly = SymbolicAssembly(z, cos_sin, [])
        poses = self.poses(assembly)
        residual, _ = self.acceptance_values(assembly, poses)
        return self.make_formula([*self.link_rows(assembly, poses, rates), residual])

    def link_rows(self, assembly: SymbolicAssembly, poses: list[list[int]], rates: bool) -> list[int]:
        """The rows of the inner links: their poses, each followed by its rates if they are wanted: x', y', angle', then
        the second ones."""
        if not rates:
            return [number for pose in poses for number in pose]
        e, (u1, u2), count = self.equations, self.symbols[2:], 3 * len(poses)
        z1, z2 = UnknownRates(e, solve_by_determinants).first_and_second(u1, u2)
        w1, w2 = first_and_second_rates(e.w[:count], e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))
        values = self._inline([w1, w2], assembly.z)
        rows: list[int] = []
        for k, pose in enumerate(poses):
            rows += [*pose, *values[3 * k : 3 * k + 3], *values[count + 3 * k : count + 3 * k + 3]]
        return rows

    def _polish(self, stage: Block, z: list[int], parts: dict[int, list[int]]) -> dict[int, list[int]]:
        """The unknowns of a group after a step of Newton's method, angles rotated by the rational rotation."""
        e, add = self.equations, self.instructions.add
        near = list(z)
        for k, value in parts.items():
            if len(value) == 2:
                c, s = value
                size = add("sqrt", add("add", add("mul", c, c), add("mul", s, s)))
                parts[k] = [add("div", c, size), add("div", s, size)]
                near[k] = self.add_unknown()
                self.cos_sin[near[k]] = CosSin(*parts[k])
            else:
                near[k] = value[0]
        jacobian = block_jacobian(e, stage.rows, stage.unknowns)
        steps = self._inline([solve_by_determinants(jacobian, e.F[stage.rows])], near)
        return {
            k: [add("sub", value[0], step)]
            if len(value) == 1
            else [*rotate(add, self.instructions.add_constant, value[0], value[1], add("neg", step))]
            for (k, value), step in zip(parts.items(), steps, strict=True)
        }

    def poses(self, assembly: SymbolicAssembly) -> list[list[int]]:
        """x, y, cos and sin of every inner link."""
        parts = [ca.SX(part) for frame in self.inner_frames.values() for part in frame[:POSE_ROWS]]
        values = self._inline(parts, assembly.z)
        return [values[first : first + POSE_ROWS] for first in range(0, len(values), POSE_ROWS)]

    def _residuals(self, assembly: SymbolicAssembly, poses: list[list[int]]) -> list[int]:
        """The residual of every constraint by the formulas of the pairs, independent of the elimination.

        Of an angle that closes modulo a turn |sin| + 1 - cos; of cos and sin of an unknown, how far from the circle.
        """
        e, kind = self.equations, self.block_type
        places = ca.SX.sym("places", 3 * len(kind.inner_links))
        place_numbers: list[int] = []
        for x, y, c, s in poses:
            place_numbers += [x, y, self.add_unknown()]
            self.cos_sin[place_numbers[-1]] = CosSin(c, s)
        first_input = 3 * len(kind.given_links)
        split = [*ca.vertsplit(e.u)[:first_input], *ca.vertsplit(places)]
        names = (*kind.given_links, *kind.inner_links)
        frames = {name: frame_at(*split[3 * k : 3 * k + 3]) for k, name in enumerate(names)} | {"frame": GROUND}
        errors = closing_errors(e, kind.mechanism, frames, self.pair_coordinates, first_input)
        values = self._inline([errors], assembly.z, [(places, place_numbers)])
        add = self.instructions.add
        for c, s in assembly.cos_sin.values():
            square = add("add", add("mul", c, c), add("mul", s, s))
            values.append(add("sub", square, self.instructions.add_constant(1.0)))
        return values

    def acceptance_values(self, assembly: SymbolicAssembly, poses: list[list[int]]) -> list[int]:
        """The largest residual, and the least distance measure from a dead point."""
        add = self.instructions.add
        largest = total = self.instructions.add_constant(0.0)
        for residual in self._residuals(assembly, poses):
            size = add("abs", residual)
            largest, total = add("maxnum", largest, size), add("add", total, size)
        # NaN stays in a sum, but not in the largest
        largest = add("add", largest, add("mul", self.instructions.add_constant(NAN_PROBE), total))
        clear = self.instructions.add_constant(1.0)
        for k, coalescence in enumerate(assembly.coalescences):
            distance = add("sub", self.instructions.add_constant(1.0), coalescence)
            clear = add("minnum", clear, distance) if k else distance
        return [largest, clear]

    def sketch_distance(self, poses: list[list[int]], sketch_sums: list[list[int]]) -> int:
        """The squared distance of the links' points to the sketch, from the sums of its points, see `BlockType`."""
        add, mul = self.instructions.add, partial(self.instructions.add, "mul")
        total = self.instructions.add_constant(0.0)
        for (x, y, c, s), (count, px, py, tx, ty, along, across, squares) in zip(poses, sketch_sums, strict=True):
            square = add("add", mul(x, x), mul(y, y))
            rotated = add("sub", mul(c, px), mul(s, py)), add("add", mul(s, px), mul(c, py))
            mixed = add("add", mul(x, add("sub", rotated[0], tx)), mul(y, add("sub", rotated[1], ty)))
            mixed = add("sub", mixed, add("add", mul(c, along), mul(s, across)))
            link_sum = add("add", add("add", mul(count, square), add("add", mixed, mixed)), squares)
            total = add("add", total, link_sum)
        return total

    def nearest_mode(self, modes: Sequence[_StartMode]) -> list[int]:
        """The outputs of the assembly mode nearest to the sketch, its squared distance, the next squared distance, and
        the least distance measure of any mode from a dead point. A mode that cannot be assembled is `FAR_AWAY`."""
        add = self.instructions.add
        far = self.instructions.add_constant(FAR_AWAY)
        distances = []
        for mode in modes:
            is_joined = add("less", mode.residual, far)
            distances.append(
                add("add", add("where", is_joined, mode.distance), add("where", add("not", is_joined), far))
            )
        outputs, nearest, second, clear = modes[0].outputs, distances[0], far, add("abs", modes[0].clear)
        for mode, distance in zip(modes[1:], distances[1:], strict=True):
            is_nearer = add("less", distance, nearest)
            stays = add("not", is_nearer)
            outputs = [
                add("add", add("where", is_nearer, new), add("where", stays, old))
                for new, old in zip(mode.outputs, outputs, strict=True)
            ]
            second = add("minnum", second, add("maxnum", nearest, distance))
            nearest = add("minnum", nearest, distance)
            clear = add("minnum", clear, add("abs", mode.clear))
        return [*outputs, nearest, second, clear]

    def make_formula(self, wanted: list[int]) -> BlockFormula:
        """The formula of wanted values. Raises UnsupportedOperation where an angle stands outside cos and sin, or it is
        long."""
        formula = BlockFormula(*expand_angle_sums(self.instructions, wanted, self.cos_sin))
        check_length(len(formula.order))
        if any(leaf.source in ("angle", "unknown") for leaf in formula.inputs.values()):
            raise UnsupportedOperation("an angle stands outside cos and sin")
        return formula


@lru_cache(maxsize=MAX_BLOCK_TYPES)
def find_block_type(signature: BlockSignature) -> BlockType:
    """The block type of a signature; equal signatures have the same."""
    return BlockType(signature)


@lru_cache
def _sample_pair(type_: type[Pair]) -> Pair:
    return type_.samples()[0].pair


def write_formula(inputs: Sequence[Sequence[FormulaInput]], write: Callable[..., Sequence[ca.SX]]) -> BlockFormula:
    """The formula of what `write` returns for groups of inputs, each a column."""
    listing: InstructionList[FormulaInput] = InstructionList()
    symbols = [ca.SX.sym(f"of{k}", len(group)) for k, group in enumerate(inputs)]
    function = ca.Function("written", symbols, [ca.densify(ca.vertcat(*write(*symbols)))], {"cse": True})
    (outputs,) = inline_function(listing, function, [[listing.add_input(leaf) for leaf in group] for group in inputs])
    return BlockFormula(listing, outputs)


class NewtonFormulas(NamedTuple):
    """Functions of given links and inputs, numbers, and unknowns (the cosine and sine of angles, or a length and 0).

    `step`: the step of Newton's method to subtract, and the square of the regularity of the Jacobian; `poses` and
    `poses_and_rates`: rows of the inner links, and the largest residual.
    """

    step: BlockFormula
    poses: BlockFormula
    poses_and_rates: BlockFormula
