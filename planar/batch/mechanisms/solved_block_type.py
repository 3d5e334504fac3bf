"""Block types with the formulas that solve them, derived once each."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from itertools import product
from typing import NamedTuple

from planar.batch.mechanisms.block_formulas import FormulaBuilder
from planar.batch.mechanisms.block_type import SKETCH_SUMS, BlockEquations, BlockSignature
from planar.codegen.block_formula import BlockFormula
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.pairs import Pair

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
        """(given links and inputs, numbers with statistics) -> for each way to assemble the group its inner
        links' x, y, cos and sin, then what is left open, how far from where two ways meet, and the distance."""
        if self._start_formula is None:
            work = FormulaBuilder(self)
            first = len(self.measures) + 2 * len(self.angle_measures)
            stats = [
                [work.add_input("p", first + SKETCH_SUMS * k + i) for i in range(SKETCH_SUMS)]
                for k in range(len(self.inner_links))
            ]
            wanted: list[int] = []
            for signs in product((1.0, -1.0), repeat=self.sign_count):
                way = work.closed_form_assembly([work.instructions.add_constant(sign) for sign in signs])
                poses = work.poses(way)
                wanted += [each for pose in poses for each in pose]
                wanted += work.acceptance_values(way, work.residuals(way, poses))
                wanted.append(work.sketch_distance(poses, stats))
            self._start_formula = work.make_formula(wanted)
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


class NewtonFormulas(NamedTuple):
    """(given links and inputs, numbers, unknowns: the cosine and sine of angles, or a length and nothing) -> `step`: by
    how much Newton's method goes back, and the square of how regular the slope is; `told` and `moving`: rows of the
    inner links, without and with rates, and what is left open."""

    step: BlockFormula
    poses: BlockFormula
    poses_and_rates: BlockFormula
