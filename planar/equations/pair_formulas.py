"""Formulas of pairs, as functions and as lists of operations, by which pairs of equal formula are recognised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

from planar.foundation.geometry import GROUND, Frame
from planar.foundation.jets import Scalar
from planar.foundation.recorded_formula import RecordedFormula, RecordedNumber, record_formula
from planar.model.pairs import Pair

PARTS_OF_FRAME = 5
"""x, y, cos, sin and angle of a frame are the arguments of a recorded formula."""
MAX_RECORDED_PAIRS = 2**14
PairFormula = Callable[[Sequence[Frame], Sequence[Scalar], Sequence[Scalar]], Sequence[Scalar]]
"""(frames of its bodies, numbers, own coordinates) -> values."""


def pair_formula(pair: Pair, is_input: bool) -> PairFormula:
    """The residual of a pair, or with `is_input` the position of its relative motion."""
    if not is_input:
        return pair.residual

    def position(frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        return (pair.input_position(frames, numbers, own),)

    return position


def recorded_pair_formula(
    pair: Pair, is_input: bool, is_moving: tuple[bool, ...], own_count: int, number_count: int
) -> RecordedFormula:
    """The operations of a pair's formula, of which bodies (bodies,) move; the others are the frame.

    Its arguments are the frames of the moving bodies, own coordinates, numbers.
    """
    try:
        hash(pair)
    except TypeError:  # made in Python, of lists
        return _record(pair, is_input, is_moving, own_count, number_count)
    return _cached_record(pair, is_input, is_moving, own_count, number_count)


def _record(
    pair: Pair, is_input: bool, is_moving: tuple[bool, ...], own_count: int, number_count: int
) -> RecordedFormula:
    moving = [link for link, moves in zip(pair.bodies, is_moving, strict=True) if moves]
    frames_end = PARTS_OF_FRAME * len(moving)
    own_end = frames_end + own_count

    def recorded(arguments: Sequence[RecordedNumber]) -> Sequence[Scalar]:
        parts = (arguments[k : k + PARTS_OF_FRAME] for k in range(0, frames_end, PARTS_OF_FRAME))
        frames = {link: Frame(x, y, c, s, angle) for link, (x, y, c, s, angle) in zip(moving, parts, strict=True)}
        bodies = [frames.get(link, GROUND) for link in pair.bodies]
        return pair_formula(pair, is_input)(bodies, arguments[own_end:], arguments[frames_end:own_end])

    return record_formula(recorded, own_end + number_count)


_cached_record = lru_cache(maxsize=MAX_RECORDED_PAIRS)(_record)
