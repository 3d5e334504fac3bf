"""What judges positions in the lanes: whether all constraints are closed, and a block's two assemblies keep apart."""

from __future__ import annotations

from collections.abc import Sequence

from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.batch.march.regularity import LEAST_KERNEL_REGULARITY
from planar.codegen.llvm_ir import IRWriter


def write_closes(t: IRWriter, residuals: Sequence[str], tolerance: str) -> str:
    """A flag: what the constraints leave open is in sum not above the tolerance, a number.

    What is not a number stays so in sums, and is not below anything.
    """
    nothing = t.constant(0.0)
    total = t.add_all([t.call_intrinsic("fabs", each) for each in residuals if each != nothing] or [nothing])
    return t.compare("ole", total, t.broadcast(tolerance))


def write_keeps_apart(t: IRWriter, earlier: str, before: str, here: str, is_known: str | None = None) -> str:
    """A flag: over three positions, and between them, the two assemblies of a block keep apart, by its coalescence.

    Between them it does not reach one, by half as much as it bends over all three. So it may be the position before at
    which a block had come too near, and the middle of its change may lie there, as where a run starts just before a
    dead point. `is_known`: flags of whether there are three positions already.
    """
    change = t.binary("sub", t.binary("add", here, earlier), t.binary("add", before, before))
    change = t.call_intrinsic("fabs", change)
    half = t.constant(0.5)
    if is_known is not None:
        half = t.select_or_zero(is_known, half)
    most = t.greater(earlier, t.greater(before, here))  # what is not a number here stays so
    reached = t.binary("add", most, t.binary("mul", change, half))
    return t.compare("ole", reached, t.constant(1.0 - LEAST_KERNEL_REGULARITY**2))


def write_turns_little(t: IRWriter, angles: Sequence[str], slots: Sequence[str]) -> list[str]:
    """Flags that say of angles that they are not far from where they were a step before, as their slots have it."""
    flags = []
    for angle, slot in zip(angles, slots, strict=True):
        far = t.call_intrinsic("fabs", t.binary("sub", angle, t.load(slot)))
        t.store(angle, slot)
        is_near = t.compare("ole", far, t.constant(MAX_TURN_PER_STEP))
        flags.append(t.or_flags(is_near, t.broadcast_counter_test("%k", "sle", 0)))
    return flags
