"""Block types: links that are solved together from others whose poses are known, with all their formulas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from itertools import product
from typing import NamedTuple

import casadi as ca

from planar.codegen.instructions import CosSin, check_length, expand_angle_sums
from planar.codegen.tape import BlockFormula, FormulaInput
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.generic_evaluation import inline_function
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.rates import UnknownRates, block_jacobian, first_and_second_rates
from planar.equations.residuals import closing_error, input_residuals, pair_residuals, scalars, split_pair_numbers
from planar.equations.symbolic_equations import Block, ConstraintEquations, build_equations, slice_length
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values
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
    """A pair of a kind: its type, its bodies (inner links from 0 on, given ones -1, -2, ...), whether it is driven."""

    type: type[Pair]
    bodies: tuple[int, ...]
    driven: bool


class BlockSignature(NamedTuple):
    """What makes a kind: how many links are inner and given, and the pairs in their order."""

    inner_count: int
    given_count: int
    pairs: tuple[BlockPair, ...]


class _SymbolicPair:
    """A pair between the links of a kind: the formulas of its type with bodies of its own."""

    def __init__(self, name: str, joint: BlockPair, like: Pair):
        self.name, self.bodies, self.sample = name, tuple(_body_name(body) for body in joint.bodies), like
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


class BlockEquations:
    """One kind of groups: its equations, with those of their groups that are in closed form.

    What it takes, in slots: the given links, the inputs, then the inner links. In numbers: p of the pairs, the cosine
    and sine of those that are angles, then a sign for each group that can be assembled in two ways; where it starts,
    in their place the sums of the points in the sketch, see `_sketch_sums` of the initial assembly.
    """

    def __init__(self, signature: BlockSignature, samples: Sequence[Pair]):
        self.signature = signature
        pairs = tuple(
            _SymbolicPair(f"p{k}", *each) for k, each in enumerate(zip(signature.pairs, samples, strict=True))
        )
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
        self.sign_count = sum(each is not None and isinstance(each, ClosedForm) for each in self.closed_forms)
        "how many groups in it can be assembled in two ways"
        self.is_square = e.is_square and not any(pair.sample.counts_turns for pair in pairs)
        "whether it can be solved without the whole"

    @property
    def unknown_is_angle(self) -> tuple[bool, ...]:
        """Of every unknown whether it is an angle."""
        e = self.equations
        return tuple(e.coordinates[column].kind is not Measure.LENGTH for column in e.unknowns)


class LinearForm(NamedTuple):
    """A group of lengths that has one assembly: as `ClosedForm`, without a sign."""

    values: tuple[tuple[ca.SX], ...]
    coalescence: ca.SX


def linear_form(e: ConstraintEquations, stage: Block) -> LinearForm | None:
    """The only assembly of a group of one or two lengths whose constraints are linear in them; None for others."""
    many = slice_length(stage.unknowns)
    lengths = all(e.coordinates[column].kind is Measure.LENGTH for column in e.unknowns[stage.unknowns])
    if stage.is_free or many != slice_length(stage.rows) or many > 2 or not lengths:
        return None
    rows, own = e.F[stage.rows], e.z[stage.unknowns]
    slope = ca.densify(ca.jacobian(rows, own))
    if any(e.rows[row].kind is Measure.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    if ca.jacobian_sparsity(slope, own).nnz():
        return None
    found = -solve_by_determinants(slope, ca.substitute(rows, own, ca.SX.zeros(many)))
    if many == 1:
        return LinearForm(((found,),), ca.SX(0.0))
    det = slope[0, 0] * slope[1, 1] - slope[0, 1] * slope[1, 0]
    bend = 1.0 - det * det / (ca.sumsqr(slope[:, 0]) * ca.sumsqr(slope[:, 1]))
    return LinearForm(tuple((found[k],) for k in range(many)), bend)


NAN_PROBE = 1e-300
"""Times what is a number it is nothing beside round-off; times what is none it is none."""


FAR_AWAY = 1e300
"""A squared distance, and more than what is left open where there is a way."""


class SymbolicAssembly(NamedTuple):
    """A way to assemble a kind: the numbers of the values that stand for its unknowns, and of its bends."""

    z: list[int]
    cos_sin: dict[int, CosSin]
    bends: list[int]


class _StartWay(NamedTuple):
    """Values of one assembly mode by their numbers: its outputs, its squared distance to the sketch, its residual, and
    its distance measure from a dead point."""

    outputs: list[int]
    distance: int
    left: int
    clear: int


class FormulaBuilder:
    """The formulas of a kind, put into one listing."""

    def __init__(self, block_equations: BlockEquations):
        self.block_equations, self.equations = block_equations, block_equations.equations
        self.instructions: InstructionList[FormulaInput] = InstructionList()
        e, given, measures = self.equations, len(block_equations.given_links), block_equations.measures
        self.symbols = [e.u, e.p, ca.SX.sym("u1", e.u.numel()), ca.SX.sym("u2", e.u.numel())]
        self.u: list[int] = []
        self.cos_sin: dict[int, CosSin] = {}
        for k in range(e.u.numel()):
            slot, part = (k // 3, k % 3) if k < 3 * given else (given + k - 3 * given, 0)
            self.u.append(self.add_input("angle", slot) if part == 2 else self.add_input("row", slot, part))
            if part == 2 or e.input_kinds[k] is not Measure.LENGTH:
                self.cos_sin[self.u[-1]] = CosSin(self.add_input("row", slot, COS), self.add_input("row", slot, SIN))
        self.p = [self.add_input("p", k) for k in range(len(measures))]
        for place, k in enumerate(block_equations.angle_measures):
            both = (self.add_input("p", len(measures) + 2 * place + part) for part in (0, 1))
            self.cos_sin[self.p[k]] = CosSin(*both)
        rows = [(k // 3, X1 + k % 3, X2 + k % 3) if k < 3 * given else (given + k - 3 * given, X1, X2)
                for k in range(e.u.numel())]  # fmt: skip
        self.u1 = [self.add_input("row", slot, first) for slot, first, _ in rows]
        self.u2 = [self.add_input("row", slot, second) for slot, _, second in rows]

    def add_input(self, source: str, place: int, part: int = 0) -> int:
        """A value from outside; those of "angle" and "unknown" are stood for by their cos and sin."""
        return self.instructions.add_input(FormulaInput(source, place, part))

    def add_unknown(self) -> int:
        """A value that no other is, stood for by its cos and sin, or by what it is put together from."""
        return self.add_input("unknown", len(self.instructions.instructions))

    def _inline(
        self, of: Sequence[ca.SX], outputs: list[ca.SX], z: list[int], more: Sequence[list[int]] = ()
    ) -> list[int]:
        """The values of expressions in z, u, p, u1, u2 and further symbols."""
        whole = ca.densify(ca.vertcat(*outputs))
        function = ca.Function("part", [self.equations.z, *self.symbols, *of], [whole], {"cse": True})
        arguments = [z, self.u, self.p, self.u1, self.u2, *more]
        return inline_function(self.instructions, function, arguments)[0]

    def closed_form_assembly(self, signs: Sequence[int], polished: bool = False) -> SymbolicAssembly:
        """The unknowns, group after group, by their closed forms; polished by a step of Newton's method."""
        e, way = self.equations, len(self.instructions.instructions)
        z = [self.add_input("unknown", way, k) for k in range(e.z.numel())]
        turned, bends, left = {}, [], iter(signs)
        for stage, form in zip(self.block_equations.blocks, self.block_equations.closed_forms, strict=True):
            assert form is not None
            flat = [*(part for found in form.values for part in found), form.coalescence]
            if isinstance(form, ClosedForm):
                values = iter(self._inline([form.sign], flat, z, [[next(left)]]))
            else:
                values = iter(self._inline((), flat, z))
            own = range(stage.unknowns.start, stage.unknowns.stop)
            parts = {k: [next(values) for _ in found] for k, found in zip(own, form.values, strict=True)}
            bends.append(next(values))
            if polished:
                parts = self._polish(stage, z, parts)
            for k, found in parts.items():
                if len(found) == 2:
                    self.cos_sin[z[k]] = turned[k] = CosSin(*found)
                else:
                    z[k] = found[0]
        return SymbolicAssembly(z, turned, bends)

    def newton_formula(self, rates: bool | None) -> BlockFormula:
        """One of the formulas of `NewtonFormulas`: None for the step, else what is told."""
        e, kind = self.equations, self.block_equations
        z, turned = [], {}
        for k, is_angle in enumerate(kind.unknown_is_angle):
            z.append(self.add_unknown() if is_angle else self.add_input("z", k, 0))
            if is_angle:
                turned[k] = self.cos_sin[z[k]] = CosSin(self.add_input("z", k, 0), self.add_input("z", k, 1))
        if rates is None:
            step, square, *lengths = solve_with_volume(ca.densify(ca.jacobian(e.F, e.z)), e.F)
            strength = square / lengths[0] if lengths else square
            return self.make_formula(self._inline((), [step, strength], z))
        way = SymbolicAssembly(z, turned, [])
        poses = rows = self.poses(way)
        if rates:
            rows = [[*pose, *more] for pose, more in zip(poses, self.rates(way), strict=True)]
        left, _ = self.acceptance_values(way, self.residuals(way, poses))
        return self.make_formula([*(each for pose in rows for each in pose), left])

    def _polish(self, stage: Block, z: list[int], parts: dict[int, list[int]]) -> dict[int, list[int]]:
        """The unknowns of a group after a step of Newton's method, angles turned by the rational rotation."""
        e, add, one = self.equations, self.instructions.add, self.instructions.add_constant(1.0)
        near = list(z)
        for k, found in parts.items():
            if len(found) == 2:
                c, s = found
                size = add("sqrt", add("add", add("mul", c, c), add("mul", s, s)))
                parts[k] = [add("div", c, size), add("div", s, size)]
                near[k] = self.add_unknown()
                self.cos_sin[near[k]] = CosSin(*parts[k])
            else:
                near[k] = found[0]
        slope = block_jacobian(e, stage.rows, stage.unknowns)
        step = self._inline((), [solve_by_determinants(slope, e.F[stage.rows])], near)
        polished = {}
        for (k, own), back in zip(parts.items(), step, strict=True):
            if len(own) == 1:
                polished[k] = [add("sub", own[0], back)]
                continue
            c, s = own
            half = add("mul", self.instructions.add_constant(-0.5), back)
            square = add("mul", half, half)
            scale = add("div", one, add("add", one, square))
            cos, sin = add("mul", add("sub", one, square), scale), add("mul", add("add", half, half), scale)
            polished[k] = [
                add("sub", add("mul", c, cos), add("mul", s, sin)),
                add("add", add("mul", s, cos), add("mul", c, sin)),
            ]
        return polished

    def _inner_frames(self) -> tuple[dict[str, Frame], dict[str, tuple[ca.SX, ...]]]:
        """Frames of the inner links and own coordinates of the pairs, in the unknowns."""
        e, kind = self.equations, self.block_equations
        column = coordinate_columns(e.coordinates)
        return frames_from_coordinates(
            ca.vertsplit(e.w), column, kind.inner_links, {pair.name: pair for pair in kind.mechanism.pairs}
        )

    def poses(self, way: SymbolicAssembly) -> list[list[int]]:
        """x, y, cos and sin of every inner link."""
        frames, _ = self._inner_frames()
        parts = [part for name in self.block_equations.inner_links for part in frames[name][:4]]
        values = self._inline((), [ca.SX(part) for part in parts], way.z)
        return [values[4 * k : 4 * k + 4] for k in range(len(self.block_equations.inner_links))]

    def residuals(self, way: SymbolicAssembly, poses: list[list[int]]) -> list[int]:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos; of cos and sin of an unknown, how far from the circle.
        """
        e, kind = self.equations, self.block_equations
        places = ca.SX.sym("places", 3 * len(kind.inner_links))
        poses_given: list[int] = []
        for x, y, c, s in poses:
            poses_given += [x, y, self.add_unknown()]
            self.cos_sin[poses_given[-1]] = CosSin(c, s)
        names = (*kind.given_links, *kind.inner_links)
        split = [*ca.vertsplit(e.u)[: 3 * len(kind.given_links)], *ca.vertsplit(places)]
        frames = {name: frame_at(*split[3 * k : 3 * k + 3]) for k, name in enumerate(names)} | {"frame": GROUND}
        _, own = self._inner_frames()
        pairs = kind.mechanism.pairs
        numbers = split_pair_numbers(pairs, e.p)
        driven = [pair for pair, joint in zip(pairs, kind.signature.pairs, strict=True) if joint.driven]
        rows = [
            *pair_residuals(pairs, frames, numbers, own),
            *input_residuals(driven, frames, numbers, own, scalars(e.u)[3 * len(kind.given_links) :]),
        ]
        open_ = [closing_error(value, row.kind) for row, value in rows]
        values = self._inline((places,), [ca.SX(each) for each in open_], way.z, (poses_given,))
        add = self.instructions.add
        for c, s in way.cos_sin.values():
            square = add("add", add("mul", c, c), add("mul", s, s))
            values.append(add("sub", square, self.instructions.add_constant(1.0)))
        return values

    def acceptance_values(self, way: SymbolicAssembly, residuals: list[int]) -> list[int]:
        """What is left open at most, and the least of how far from where two ways meet."""
        add = self.instructions.add
        left = whole = self.instructions.add_constant(0.0)
        for gap in residuals:
            own = add("abs", gap)
            left, whole = add("maxnum", left, own), add("add", whole, own)
        # what is no number stays so in a sum, but not in the greatest
        left = add("add", left, add("mul", self.instructions.add_constant(NAN_PROBE), whole))
        clear = self.instructions.add_constant(1.0)
        for k, bend in enumerate(way.bends):
            own = add("sub", self.instructions.add_constant(1.0), bend)
            clear = add("minnum", clear, own) if k else own
        return [left, clear]

    def rates(self, way: SymbolicAssembly) -> list[list[int]]:
        """x', y', angle', then the second ones of every inner link."""
        e, (u1, u2) = self.equations, self.symbols[2:]
        z1, z2 = UnknownRates(e, solve_by_determinants).first_and_second(u1, u2)
        y, y1, y2 = e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2)
        w = e.w[: 3 * len(self.block_equations.inner_links)]
        both = ca.vertcat(*first_and_second_rates(w, y, y1, y2))
        values = self._inline((), [both], way.z)
        many = 3 * len(self.block_equations.inner_links)
        return [values[3 * k : 3 * k + 3] + values[many + 3 * k : many + 3 * k + 3] for k in range(many // 3)]

    def sketch_distance(self, poses: list[list[int]], sketch_sums: list[list[int]]) -> int:
        """The squared distance of the links' points to the sketch, from the sums of its points, see `BlockType`."""
        add, mul = self.instructions.add, partial(self.instructions.add, "mul")
        whole = self.instructions.add_constant(0.0)
        for (x, y, c, s), (many, px, py, tx, ty, along, across, squares) in zip(poses, sketch_sums, strict=True):
            square = add("add", mul(x, x), mul(y, y))
            turned = add("sub", mul(c, px), mul(s, py)), add("add", mul(s, px), mul(c, py))
            mixed = add("add", mul(x, add("sub", turned[0], tx)), mul(y, add("sub", turned[1], ty)))
            mixed = add("sub", mixed, add("add", mul(c, along), mul(s, across)))
            own = add("add", add("add", mul(many, square), add("add", mixed, mixed)), squares)
            whole = add("add", whole, own)
        return whole

    def nearest_way(self, ways: Sequence[_StartWay]) -> list[int]:
        """The outputs of the assembly mode nearest to the sketch, its squared distance, the next squared distance, and
        the least distance measure of any mode from a dead point. A mode that cannot be assembled is `FAR_AWAY`."""
        add = self.instructions.add
        far = self.instructions.add_constant(FAR_AWAY)
        distances = []
        for way in ways:
            is_joined = add("less", way.left, far)
            distances.append(
                add("add", add("where", is_joined, way.distance), add("where", add("not", is_joined), far))
            )
        outputs, nearest, second, clear = ways[0].outputs, distances[0], far, add("abs", ways[0].clear)
        for way, distance in zip(ways[1:], distances[1:], strict=True):
            is_nearer = add("less", distance, nearest)
            stays = add("not", is_nearer)
            outputs = [
                add("add", add("where", is_nearer, new), add("where", stays, old))
                for new, old in zip(way.outputs, outputs, strict=True)
            ]
            second = add("minnum", second, add("maxnum", nearest, distance))
            nearest = add("minnum", nearest, distance)
            clear = add("minnum", clear, add("abs", way.clear))
        return [*outputs, nearest, second, clear]

    def make_formula(self, wanted: list[int]) -> BlockFormula:
        """The formula of wanted values. Raises UnsupportedOperation where an angle stands outside cos and sin, or it is
        long."""
        made, numbers = expand_angle_sums(self.instructions, wanted, self.cos_sin)
        leaves: dict[int, FormulaInput] = {}
        order = required_values(made, numbers)
        check_length(len(order))
        for number in order:
            key = made.instructions[number].key
            if key is not None:
                if key.source in ("angle", "unknown"):
                    raise UnsupportedOperation("an angle stands outside cos and sin")
                leaves[number] = key
        return BlockFormula(made, tuple(numbers), leaves)


MAX_SIGNS = 2
"""Signs of a kind in closed form at most."""
MAX_BLOCK_TYPES = 1024
"""Kinds that are kept."""


class BlockType(BlockEquations):
    """One kind of groups with its formulas: `direct` ones are in closed form, Newton's method follows others."""

    def __init__(self, signature: BlockSignature, samples: Sequence[Pair]):
        super().__init__(signature, samples)
        self.has_closed_form = (
            self.is_square and self.sign_count <= MAX_SIGNS and all(each is not None for each in self.closed_forms)
        )
        if self.has_closed_form:
            try:
                self.start_formula, self.run_formula(False)
            except UnsupportedOperation:
                self.has_closed_form = False
        self.has_newton_formulas = False
        "whether Newton's method can follow it, where it is not in closed form"
        if self.is_square and not self.has_closed_form:
            with suppress(UnsupportedOperation):
                self.has_newton_formulas = self.newton_formulas is not None

    @property
    def start_formula(self) -> BlockFormula:
        """(given links and inputs, numbers with sums of the sketch) -> of the way to assemble the block that is nearest
        to the sketch its inner links' x, y, cos and sin, then its signs, its squared distance and that of the next,
        what is left open, and how far from where two ways meet any is."""
        if self._start_formula is None:
            work = FormulaBuilder(self)
            first = len(self.measures) + 2 * len(self.angle_measures)
            sums = [
                [work.add_input("p", first + SKETCH_SUMS * k + i) for i in range(SKETCH_SUMS)]
                for k in range(len(self.inner_links))
            ]
            ways = []
            for signs in product((1.0, -1.0), repeat=self.sign_count):
                own = [work.instructions.add_constant(sign) for sign in signs]
                way = work.closed_form_assembly(own)
                poses = work.poses(way)
                left, clear = work.acceptance_values(way, work.residuals(way, poses))
                outputs = [*(number for pose in poses for number in pose), *own, left]
                ways.append(_StartWay(outputs, work.sketch_distance(poses, sums), left, clear))
            *outputs, left, nearest, second, least_clear = work.nearest_way(ways)
            self._start_formula = work.make_formula([*outputs, nearest, second, left, least_clear])
        return self._start_formula

    _start_formula: BlockFormula | None = None

    @property
    def newton_formulas(self) -> NewtonFormulas:
        """The formulas by which Newton's method follows a kind that is not in closed form. Raises
        UnsupportedOperation."""
        if self._newton_formulas is None:
            self._newton_formulas = NewtonFormulas(
                *(FormulaBuilder(self).newton_formula(what) for what in (None, False, True))
            )
        return self._newton_formulas

    _newton_formulas: NewtonFormulas | None = None

    def run_formula(self, rates: bool, polished: bool = False) -> BlockFormula:
        """(given links and inputs, numbers) -> rows of the inner links, then what is left open, and how far from where
        two ways to assemble it meet."""
        if (rates, polished) not in self._run_formulas:
            work = FormulaBuilder(self)
            signs = [
                work.add_input("p", len(self.measures) + 2 * len(self.angle_measures) + k)
                for k in range(self.sign_count)
            ]
            way = work.closed_form_assembly(signs, polished)
            poses = rows = work.poses(way)
            if rates:
                rows = [[*pose, *more] for pose, more in zip(poses, work.rates(way), strict=True)]
            wanted = [each for pose in rows for each in pose]
            self._run_formulas[rates, polished] = work.make_formula(
                [*wanted, *work.acceptance_values(way, work.residuals(way, poses))]
            )
        return self._run_formulas[rates, polished]

    @property
    def _run_formulas(self) -> dict[tuple[bool, bool], BlockFormula]:
        return self.__dict__.setdefault("_runs", {})


@lru_cache(maxsize=MAX_BLOCK_TYPES)
def find_block_type(signature: BlockSignature) -> BlockType:
    """The kind of a signature; equal ones are one."""
    return BlockType(signature, [_sample_pair(joint.type) for joint in signature.pairs])


@lru_cache
def _sample_pair(type_: type[Pair]) -> Pair:
    return type_.samples()[0].pair


def write_formula(inputs: Sequence[Sequence[FormulaInput]], write: Callable[..., Sequence[ca.SX]]) -> BlockFormula:
    """The formula of what is written of groups of inputs, each a column."""
    listing: InstructionList[FormulaInput] = InstructionList()
    symbols = [ca.SX.sym(f"of{k}", len(own)) for k, own in enumerate(inputs)]
    function = ca.Function("written", symbols, [ca.densify(ca.vertcat(*write(*symbols)))], {"cse": True})
    (wanted,) = inline_function(listing, function, [[listing.add_input(each) for each in own] for own in inputs])
    leaves = {k: key for k in required_values(listing, wanted) if (key := listing.instructions[k].key) is not None}
    return BlockFormula(listing, tuple(wanted), leaves)


class NewtonFormulas(NamedTuple):
    """(given links and inputs, numbers, unknowns: the cosine and sine of angles, or a length and nothing) -> `step`: by
    how much Newton's method goes back, and the square of how regular the slope is; `told` and `moving`: rows of the
    inner links, without and with rates, and what is left open."""

    step: BlockFormula
    poses: BlockFormula
    poses_and_rates: BlockFormula
