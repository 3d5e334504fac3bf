"""Blocks that Newton's method solves, in the text of a march: predicted by the steps before, corrected, judged."""

from __future__ import annotations

import casadi as ca

from planar.batch.march.kernel import KernelBlock, Operand
from planar.batch.march.llvm.kernel_writer import KernelWriter, OperandNames
from planar.batch.march.regularity import LEAST_KERNEL_REGULARITY, LEAST_START_REGULARITY, least_regularity
from planar.codegen.llvm_linear import LinearSystems
from planar.equations.linear import solve_by_determinants

HISTORY_LENGTH = 8
"""Steps before for which there is room: a power of two, more than `PREDICTOR_ORDER`."""


class NewtonBlockWriter(KernelWriter):
    """What of a march's text is for blocks that Newton's method solves, and for large systems."""

    point_blocks: tuple[int, ...] | None = None
    state_slots: dict[Operand, str]
    history_slots: dict[Operand, str]
    predictor_weights: list[str]
    history_indices: list[str]
    regularity_slot: str
    correction_slot: str
    block_correction_slots: dict[int, str]
    linear_systems: LinearSystems | None

    def write_newton_block(self, part: KernelBlock, have: OperandNames) -> None:
        """Newton's method for a block from where it would be if it went on as before, so often as the step says."""
        t, level = self.ir, part.block.block_index
        own = {leaf: slot for leaf, slot in self.state_slots.items() if leaf[1] in part.unknowns}
        ahead = {
            leaf: t.add_all(
                [
                    t.binary("mul", w, t.load(t.element_pointer(self.history_slots[leaf], at)))
                    for w, at in zip(self.predictor_weights, self.history_indices, strict=True)
                ]
            )
            for leaf in own
        }
        for k in part.unknowns:
            if self.equations.is_angle[k]:
                ahead["zc", k], ahead["zs", k] = self.write_normalised(ahead["zc", k], ahead["zs", k])
        for leaf, slot in own.items():
            t.store(ahead[leaf], slot)
        count = t.add_instruction(f"load i64, ptr {t.add_instruction('getelementptr i64, ptr %counts, i64 %k')}")
        strong, before = t.load(self.regularity_slot), t.load(self.correction_slot)
        moved = self.block_correction_slots[level]
        t.store("zeroinitializer", moved)
        t.write_line(f"br label %from{level}")
        t.write_label(f"from{level}")
        t.write_line(f"br label %newton{level}")
        t.write_label(f"newton{level}")
        t.write_line(f"%n{level} = phi i64 [0, %from{level}], [%n{level}next, %newton{level}]")
        now = {leaf: t.load(slot) for leaf, slot in own.items()}
        *delta, spanned, lengths, squared_arm = self._write_newton_step(part, have | now)
        far = []
        for k, each in zip(part.unknowns, delta, strict=True):
            far.append(t.call_intrinsic("fabs", each))
            back = t.add_instruction(f"fneg {t.vector} {each}")
            if ("z", k) in now:
                now["z", k] = t.binary("add", now["z", k], back)
            if self.is_carried(("z", k)):
                now["zc", k], now["zs", k] = t.call_per_lane("cos", now["z", k]), t.call_per_lane("sin", now["z", k])
            elif self.equations.is_angle[k]:
                now["zc", k], now["zs", k] = self.write_small_rotation(now["zc", k], now["zs", k], back)
        for leaf, slot in own.items():
            t.store(now[leaf], slot)
        t.store(t.add_all([t.load(moved), *far]), moved)
        t.close_loop(f"n{level}", count.lstrip("%"), f"newton{level}", f"solved{level}")
        t.write_label(f"solved{level}")
        have.update({leaf: t.load(slot) for leaf, slot in own.items()})
        t.store(
            t.call_intrinsic(
                "minnum", strong, self._write_regularity(spanned, lengths, squared_arm, len(part.unknowns))
            ),
            self.regularity_slot,
        )
        t.store(t.binary("add", before, t.load(moved)), self.correction_slot)
        here = t.add_instruction(f"and i64 %k, {HISTORY_LENGTH - 1}")
        for leaf in own:
            t.store(have[leaf], t.element_pointer(self.history_slots[leaf], here))

    def _write_newton_step(self, part: KernelBlock, names: OperandNames) -> list[str]:
        """See `KernelEquations.newton_step`."""
        if not part.is_large:
            return self.write_values(self.equations.newton_step(part.block), names)
        assert self.linear_systems is not None
        residuals, columns, squared_arm = self.write_separately(self.newton_system(part), names)
        least = self.linear_systems.factorise(columns, len(residuals))
        return [*self.linear_systems.solve(residuals), least, self.ir.constant(1.0), *squared_arm]

    def write_rates(self, have: OperandNames) -> None:
        """The rates of the unknowns put into `have`, block after block, where large blocks' are solved in numbers."""
        t = self.ir
        for part, system in zip(self.equations.blocks, self.rate_systems(), strict=False):
            if part.is_large:
                assert self.linear_systems is not None
                self.linear_systems.factorise(self.write_values([ca.vec(system.jacobian)], have), len(part.unknowns))
            for name, right_side in (("z1", system.first), ("z2", system.second)):
                if part.is_large and self.linear_systems is not None:
                    found = self.linear_systems.solve(self.write_values([right_side], have))
                else:
                    found = self.write_values([solve_by_determinants(system.jacobian, right_side)], have)
                have |= {
                    (name, k): t.add_instruction(f"fneg {t.vector} {value}")
                    for k, value in zip(part.unknowns, found, strict=True)
                }

    def _write_regularity(self, spanned: str, lengths: str, squared_arm: str, count: int) -> str:
        """How regular a Jacobian is, where that is told; else only whether it is enough: not below nothing."""
        t = self.ir
        if self.point_blocks is not None:
            return t.binary("div", spanned, lengths)
        least = least_regularity(LEAST_KERNEL_REGULARITY**2, count)
        room = t.binary("sub", spanned, t.binary("mul", lengths, t.constant(least)))
        return t.call_intrinsic("minnum", room, t.binary("sub", squared_arm, t.constant(LEAST_START_REGULARITY**2)))
