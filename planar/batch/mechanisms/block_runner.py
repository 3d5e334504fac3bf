"""Runners of the blocks of many linkages: numpy, or machine code where that is there."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planar.batch.march.choice import available_backends
from planar.batch.mechanisms import newton_march
from planar.batch.mechanisms.newton_march import NewtonRun
from planar.batch.mechanisms.solved_block_type import BlockType
from planar.codegen import block_formula
from planar.codegen.block_formula import BlockFormula, KernelLayout

Array = np.ndarray


class BlockRunner(Protocol):
    """Runs blocks (many,), whose places index (many, slots) in state (slots, rows, steps) it fills.

    `lanes`: of what number steps are a multiple. `runs_in_order`: whether blocks run one after the other, so that one
    may take what another of the same batch gives. `can_give_extremes`: whether layouts may ask for extremes alone.
    """

    lanes: int
    runs_in_order: bool
    can_give_extremes: bool

    def run_formula(self, formula: BlockFormula, layout: KernelLayout, state: Array, index: Array, p: Array) -> Array:
        """Blocks in closed form, of numbers p (many, numbers): what the layout gives outside the slots."""

    def run_newton(
        self, block_type: BlockType, state: Array, index: Array, p: Array, start: Array, rates: bool
    ) -> NewtonRun:
        """Blocks that Newton's method follows, from unknowns start (many, unknowns)."""


class NumpyBlockRunner:
    """See `BlockRunner`."""

    lanes, runs_in_order, can_give_extremes = 1, False, False
    run_formula = staticmethod(block_formula.run_formula)
    run_newton = staticmethod(newton_march.run_newton)


def find_block_runner(backend: str) -> BlockRunner:
    """The fastest that a backend's name allows. Raises BadInput."""
    if available_backends(backend)[0] == "native":
        from planar.batch.mechanisms.llvm_block_runner import LLVMBlockRunner

        return LLVMBlockRunner()
    return NumpyBlockRunner()
