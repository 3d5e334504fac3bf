"""One block of a sweep in time: all inputs of every design at once, by their laws or at their rates."""

from __future__ import annotations

import numpy as np

from planar.batch.block import DesignBlock, SolvedDesigns
from planar.batch.design_arrays import design_variables, values_of_design, with_design_values
from planar.batch.general_path import OUTCOMES, solve_timed_design
from planar.batch.initial_assembly import find_assemblies, given_assemblies
from planar.batch.march.runs import run_designs
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.llvm_compile import allocate_aligned
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.turns import take_turn
from planar.model.link_shapes import place_in_link
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism
from planar.solving.runs.continuous_run import input_law_rates

Array = np.ndarray


def solve_timed_block(block: DesignBlock, duration: float) -> SolvedDesigns:
    """As `solve_design_block`, in time (s); `input` are the times (steps + 1,).

    Designs whose inputs move alike go side by side where only positions are wanted, or where all inputs keep their
    speed; all others, and those that come to a dead point, by the general path.
    """
    with take_turn():
        return _TimedBlockSolver(block, duration).solve()


def input_motions(mechanism: Mechanism, values: dict[str, Array], time: Array) -> Array:
    """Positions, first and second rates of the inputs (3, inputs, steps + 1, designs) of designs at times (steps + 1,)
    (SI)."""
    many = len(next(iter(values.values())))
    known = design_variables(mechanism)
    of_inputs = {name: value for name, value in values.items() if known[name].path[0] == "inputs"}

    def motion(index: int) -> list[Array]:
        design = with_design_values(mechanism, values_of_design(of_inputs, index))
        return [input_law_rates(given, time)[:3] for given in design.inputs]

    rows = [motion(index) for index in range(many if of_inputs else 1)]
    found = np.array(rows).transpose(2, 1, 3, 0)
    return np.broadcast_to(found, (*found.shape[:3], many))


class _TimedBlockSolver:
    def __init__(self, block: DesignBlock, duration: float):
        self.block, self.duration = block, duration
        self.reference: ReferenceDesign = reference_design(block.mechanism, None, True)
        self.design_count = len(next(iter(block.designs.values())))
        self.time = np.linspace(0.0, duration, block.steps + 1)
        self.row_count = 2 * len(block.points) * (3 if block.rates else 1)

    def solve(self) -> SolvedDesigns:
        """See `solve_timed_block`."""
        steps, many = self.block.steps, self.design_count
        out = allocate_aligned(steps + 1, self.row_count, many, self.block.dtype)
        status = np.zeros((many, steps + 1), dtype=np.int8)
        good = self._run_compiled(out)
        general, said = 0, dict[int, tuple[int, str | NoAnswer]]()
        rest = np.flatnonzero(good <= steps)
        for index in rest:
            told = solve_timed_design(
                self._design(int(index)), self.duration, steps, self.block.points, self.block.rates
            )
            out[:, :, index], status[index] = told.out, told.status
            general += int(np.sum(told.status == 0))
            for code, sentence in (
                (int(told.status[-1]), told.message),
                (OUTCOMES.index(Outcome.SOLVED), told.rate_remark),
            ):
                if sentence:
                    count, first = said.get(code, (0, sentence))
                    said[code] = count + 1, first
        endings = tuple((code, *each) for code, each in said.items())
        return SolvedDesigns(out, status, self.time, general, int(rest.size), endings, *np.full((2, many), np.nan))

    def _design(self, index: int) -> Mechanism:
        design = with_design_values(self.reference.mechanism, values_of_design(self.block.designs, index))
        if self.block.assemblies is None:
            return design
        u = self.reference.inputs(design, 1)[0][:, 0]
        return self.reference.with_sketch_of(design, self.block.assemblies[:, index], u)

    def _run_compiled(self, out: Array) -> Array:
        """Fill out (steps + 1, rows, designs) as far as it runs compiled; how many steps passed (designs,)."""
        base_, block = self.reference, self.block
        good = np.zeros(self.design_count, dtype=int)
        if not base_.can_be_compiled or base_.mechanism.stops:
            return good
        designs = with_design_values(base_.mechanism, block.designs)
        shapes = base_.shapes(designs)
        p = base_.pair_numbers(shapes, self.design_count, designs)
        u, u1, u2 = input_motions(base_.mechanism, dict(block.designs), self.time) / base_.input_scale[:, None, None]
        if block.assemblies is None:
            start = find_assemblies(base_, shapes, p, base_.inputs(designs, self.design_count)[0])
        else:
            start = given_assemblies(block.assemblies)
        fit = start.is_sure & base_.is_fit(block.designs, shapes, p)
        fit &= np.abs(u).max(axis=(0, 1)) <= LARGEST_INPUT_POSITION
        if block.rates:
            fit &= np.all((np.ptp(u1, axis=1) == 0.0) & np.all(u2 == 0.0, axis=1), axis=0)
        members = [base_.point_member(name) for name in block.points]
        moving = [k for k, (link, _) in enumerate(members) if link != base_.mechanism.frame]
        inputs = u[:, 0], u1[:, 0], u2[:, 0]
        march = base_.design_batch(shapes, p, inputs, [members[k] for k in moving], block.rates)._replace(z0=start.z)
        offsets = (u - u[:, :1]).transpose(1, 0, 2)  # (steps + 1, inputs, designs)
        found = allocate_aligned(len(out), march.output_row_count, self.design_count)
        which = np.flatnonzero(fit)
        if not which.size:
            return good
        alike = np.unique(offsets[:, :, which].reshape(-1, which.size), axis=1, return_inverse=True)[1].ravel()
        try:
            for group in range(int(alike.max(initial=-1)) + 1):
                own = which[alike == group]
                part = march.select(own)._replace(input_offsets=np.ascontiguousarray(offsets[:, :, own[0]]))
                rows = allocate_aligned(len(out), march.output_row_count, own.size)
                good[own] = run_designs(part, rows)
                found[:, :, own] = rows
        except UnsupportedOperation:
            return np.zeros_like(good)
        orders = 3 if block.rates else 1
        out[:] = 0.0
        whole = out.reshape(len(out), orders, len(members), 2, -1)
        whole[:, :, moving] = found.reshape(len(out), orders, len(moving), 2, -1)
        for k, (link, point) in enumerate(members):
            if k not in moving:
                whole[:, 0, k, 0], whole[:, 0, k, 1] = place_in_link(shapes[link], point)
        return good
