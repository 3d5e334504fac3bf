"""Linkages of pinned bars as tapes of steps, each of which places a pin: their formulas, their steps, their runs."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache, partial
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.prediction import LEAST_COSINE
from planar.batch.mechanisms.block_type import write_formula
from planar.batch.mechanisms.results import PointTable, pin_number
from planar.batch.mechanisms.tape_runs import (
    FIRST_ROOM_SLOT,
    POINT_ROWS,
    TABLE,
    TABLE_COS,
    TABLE_SIN,
    BlockKinds,
    PreparedTape,
    TapedLinkages,
)
from planar.codegen.tape import FormulaInput, TapeFormula, compile_block
from planar.foundation.arrays import Array, BoolArray, IntArray, part_offsets
from planar.model.link_shapes import PointName
from planar.model.pin_linkages import PinnedLinkages
from planar.solving.assembly.nearest_assembly import is_surely_farther
from planar.solving.checks import EPS, NEGLIGIBLE_ERROR, SHORT_ARM, residual_tolerance


class PinStep(IntEnum):
    """How a pin is placed: on the crank; as the pin between two bars whose others are known; on a bar through two
    pins. Of those the second may be one of the frame."""

    CRANK = 0
    DYAD = 1
    DYAD_ON_FRAME = 2
    CARRIED = 3
    CARRIED_ON_FRAME = 4


NUMBERS = 6
"""Numbers of a step at most. Of a crank: where it is on the frame, the pin from there as it stands (m), velocity and
acceleration. Of a dyad: the lengths of its bars (m), its sign, one by the linkage's size. Of a pin on a bar: where it
is, in parts of the way from the first pin to the second. Then the second pin (m) where that is on the frame."""
_FRAME_PIN = {PinStep.DYAD_ON_FRAME: 4, PinStep.CARRIED_ON_FRAME: 2}


@lru_cache
def pin_formulas(rates: bool, polished: bool) -> tuple[TapeFormula, ...]:
    """The formulas of all steps, which take two pins and write the third. `polished`: closed forms are followed by a
    step of Newton's method."""
    row_count = POINT_ROWS[rates]
    rows = tuple((2, row) for row in range(row_count))
    made = []
    for step in PinStep:
        frame_pin = _FRAME_PIN.get(step)
        numbers = [FormulaInput("p", k) for k in range(NUMBERS if frame_pin is None else frame_pin)]
        if step is PinStep.CRANK:
            table = [FormulaInput("row", 0, row) for row in (TABLE_COS, TABLE_SIN)]
            made.append(TapeFormula(write_formula((table, numbers), partial(_crank, rates)), rows))
            continue
        first, second = ([FormulaInput("row", slot, row) for row in range(row_count)] for slot in range(2))
        if frame_pin is not None:
            second = [FormulaInput("p", frame_pin + k) for k in range(2)]
        inputs = first, second, numbers
        if step in (PinStep.CARRIED, PinStep.CARRIED_ON_FRAME):
            made.append(TapeFormula(write_formula(inputs, partial(_carried, rates)), rows))
        else:
            directions = tuple((row_count + k, row_count + k + 1, row_count + k + 2) for k in (0, 3))
            made.append(TapeFormula(write_formula(inputs, partial(_dyad, rates, polished)), rows, directions, True))
    return tuple(made)


def _quarter_turn(x: ca.SX) -> ca.SX:
    """A vector rotated by a right angle."""
    return ca.vertcat(-x[1], x[0])


def _orders(pin: ca.SX, rates: bool) -> list[ca.SX]:
    """Place, velocity and acceleration of a pin; without rates it stands still."""
    order_count = POINT_ROWS[rates] // 2
    return [pin[2 * k : 2 * k + 2] if 2 * k < pin.numel() else ca.SX.zeros(2) for k in range(order_count)]


def _crank(rates: bool, table: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of a pin on the crank."""
    pivot, pin, velocity, acceleration = numbers[:2], numbers[2:4], numbers[4], numbers[5]
    arm = table[0] * pin + table[1] * _quarter_turn(pin)
    if not rates:
        return [pivot + arm]
    return [pivot + arm, velocity * _quarter_turn(arm), acceleration * _quarter_turn(arm) - velocity**2 * arm]


def _carried(rates: bool, first: ca.SX, second: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of a pin on a bar: linear in those of two others."""
    pairs = zip(_orders(first, rates), _orders(second, rates), strict=True)
    return [a + numbers[0] * (b - a) + numbers[1] * _quarter_turn(b - a) for a, b in pairs]


def _dyad(rates: bool, polished: bool, first: ca.SX, second: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of the pin between two bars, these as vectors with their squared lengths, the error of the
    distances (sizes), and the distance measure from a dead point: the squared sine between the bars.

    The pin is an intersection of two circles about the other pins.
    """
    (a, *a_rates), (b, *b_rates) = _orders(first, rates), _orders(second, rates)
    lengths, sign, per_size = numbers[:2], numbers[2], numbers[3]
    squares, between = lengths**2, b - a
    distance = ca.sumsqr(between)
    scale = 0.5 / distance
    height = (ca.sum1(lengths) ** 2 - distance) * (distance - (lengths[0] - lengths[1]) ** 2)
    along, across = 0.5 + scale * (squares[0] - squares[1]), scale * (sign * ca.sqrt(height))
    pin = a + along * between + across * _quarter_turn(between)
    if polished:
        bars, off = _bars(pin, (a, b), squares)
        pin -= _solve(bars, 0.5 * off)
    bars, off = _bars(pin, (a, b), squares)
    rows = [pin]
    if rates:
        # the derivative of a distance that is constant: bar * (pin' - other') = 0, then its derivative
        velocity = _solve(bars, _dots(bars, ca.horzcat(a_rates[0], b_rates[0]).T))
        relative = ca.horzcat(velocity - a_rates[0], velocity - b_rates[0]).T
        acceleration = _solve(bars, _dots(bars, ca.horzcat(a_rates[1], b_rates[1]).T) - _dots(relative, relative))
        rows += [velocity, acceleration]
    error = ca.sum1(ca.fabs(off) * (0.5 * per_size / lengths))
    directions = [part for k in range(2) for part in (bars[k, 0], bars[k, 1], squares[k])]
    return [*rows, *directions, error, height * (0.25 / (squares[0] * squares[1]))]


def _bars(pin: ca.SX, given_pins: Sequence[ca.SX], squares: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The vectors from given pins to one, row by row, and the errors of their squared lengths."""
    bars = ca.horzcat(*(pin - given_pin for given_pin in given_pins)).T
    return bars, bars[:, 0] ** 2 - squares + bars[:, 1] ** 2


def _dots(bars: ca.SX, others: ca.SX) -> ca.SX:
    return bars[:, 0] * others[:, 0] + bars[:, 1] * others[:, 1]


def _solve(bars: ca.SX, products: ca.SX) -> ca.SX:
    """The vector with these scalar products with two bars."""
    scale = 1.0 / (bars[0, 0] * bars[1, 1] - bars[0, 1] * bars[1, 0])
    x = products[0] * bars[1, 1] - products[1] * bars[0, 1]
    y = products[1] * bars[0, 0] - products[0] * bars[1, 0]
    return ca.vertcat(scale * x, scale * y)


def result_pins(linkages: PinnedLinkages, names: Sequence[PointName] | None) -> PointTable:
    """The pins of these names in every linkage that has them; all that move, if there are no names."""
    if names is None:
        moves = np.ones(len(linkages.positions), dtype=bool)
        moves[frame_pins(linkages)] = False
        pins = np.flatnonzero(moves)
        first = np.searchsorted(pins, linkages.first_pin)
        return PointTable(first, pins - np.repeat(linkages.first_pin[:-1], np.diff(first)))
    numbers = np.array([number for name in names if (number := pin_number(name)) is not None], dtype=np.int64)
    is_present = numbers < np.diff(linkages.first_pin)[:, None]
    return PointTable(part_offsets(is_present.sum(axis=1)), np.broadcast_to(numbers, is_present.shape)[is_present])


def frame_pins(linkages: PinnedLinkages) -> IntArray:
    """The pins on the frame, numbered through all linkages."""
    pins: IntArray = linkages.frame_pins + np.repeat(linkages.first_pin[:-1], np.diff(linkages.first_frame_pin))
    return pins


SMALLEST_SIZE, LARGEST_SIZE = 1e-50, 1e50
"""m: squares and products of lengths between these are numbers."""


class _Steps(NamedTuple):
    """Steps, level after level: their kinds, the two given pins, the one that is placed, the two bars."""

    kinds: IntArray
    first: IntArray
    second: IntArray
    placed: IntArray
    one: IntArray
    two: IntArray


def make_pin_tape(linkages: PinnedLinkages) -> TapedLinkages:
    """Make the tape of the linkages that consist of a crank and dyads, if their assembly is surely that of their pins'
    places. Slots are the two pins that a step takes and the one that it places, numbered through all linkages."""
    count, bar_counts = len(linkages), np.diff(linkages.first_bar)
    bar_owner = np.repeat(np.arange(count), bar_counts)
    pin_owner = np.repeat(np.arange(count), np.diff(linkages.first_pin))
    entry_bar = np.repeat(np.arange(len(bar_owner)), np.diff(linkages.first_entry))
    entry_pin = linkages.bar_pins + linkages.first_pin[bar_owner[entry_bar]]
    is_fixed = np.zeros(len(pin_owner), dtype=bool)
    is_fixed[frame_pins(linkages)] = True
    # a pin of n links has n - 1 pairs
    pairs = np.diff(linkages.first_entry[linkages.first_bar]) - np.diff(linkages.first_pin)
    pairs += np.diff(linkages.first_frame_pin)
    steps, known = _find_steps(linkages, entry_bar, entry_pin, is_fixed)
    unit, reach = _sizes(linkages, entry_bar, entry_pin)
    is_other = 2 * pairs + 1 != 3 * bar_counts
    is_other |= ~((unit > SMALLEST_SIZE) & (unit < LARGEST_SIZE))
    is_other[pin_owner[~known]] = True
    p, arm = _numbers(linkages, steps, pin_owner, unit, is_fixed)
    owner = pin_owner[steps.placed]
    is_other[owner[arm < SHORT_ARM]] = True
    which = np.flatnonzero(~is_other)
    order = _stable_order(owner)
    if len(which) < count:
        order = order[~is_other[owner[order]]]
    first = np.zeros(len(which) + 1, dtype=np.int64)
    np.cumsum(np.bincount(owner, minlength=count)[which], out=first[1:])
    slots, bars = (np.stack([part[order] for part in parts], axis=1) for parts in (steps[1:4], steps[4:6]))
    tolerance = residual_tolerance(bar_counts + 1, reach / unit)[which]
    shortest = np.minimum.reduceat(arm[order], first[:-1]) if len(which) else np.ones(0)
    clearance = EPS / (NEGLIGIBLE_ERROR * np.minimum(shortest, 1.0))
    bars -= linkages.first_bar[owner[order], None]
    return TapedLinkages(which, first, steps.kinds[order], slots, p[order], bars, tolerance, clearance)


def _find_steps(
    linkages: PinnedLinkages, entry_bar: IntArray, entry_pin: IntArray, is_fixed: BoolArray
) -> tuple[_Steps, BoolArray]:
    """Find the steps that follow from known pins, level after level, and which pins (pins,) are known in the end.

    A pin beside two known ones is carried if these are on one bar, else it is the pin of a dyad. If a linkage has as
    many constraints as freedoms, and all its pins are known, no pin is constrained twice.
    """
    crank = linkages.first_bar[:-1] + linkages.crank
    driven = np.zeros(linkages.first_bar[-1], dtype=bool)
    driven[crank] = True
    known = is_fixed.copy()
    on_crank = np.flatnonzero(driven[entry_bar])
    crank_pins, crank_bars = entry_pin[on_crank], entry_bar[on_crank]
    pivot = np.zeros(len(driven), dtype=np.int64)
    is_pivot = is_fixed[crank_pins]
    pivot[crank_bars[is_pivot]] = crank_pins[is_pivot]
    crank_pins, crank_bars = crank_pins[~is_pivot], crank_bars[~is_pivot]
    known[crank_pins] = True
    levels = [(pivot[crank_bars], pivot[crank_bars], crank_pins, crank_bars, crank_bars)]
    on_cranks = slice(0, len(crank_bars))
    pin, other, bar = _pairs_on_bars(linkages, entry_bar, entry_pin)
    counts_of = np.bincount(pin, minlength=len(known))
    starts = counts_of.cumsum() - counts_of
    known_count, earlier_pin, earlier_bar = (np.zeros(len(known), dtype=np.int64) for _ in range(3))
    newly_known = np.flatnonzero(known)
    while len(newly_known):
        # the pins beside those of the level before, once for each pair of pins
        counts = counts_of[newly_known]
        stops = counts.cumsum()
        entries = np.arange(stops[-1]) + (starts[newly_known] + counts - stops).repeat(counts)
        beside = other[entries]
        (rest,) = (~known[beside]).nonzero()
        rest = rest[_stable_order(beside[rest])]
        beside, by, on = beside[rest], pin[entries[rest]], bar[entries[rest]]
        is_first = np.ones(len(beside), dtype=bool)
        np.not_equal(beside[1:], beside[:-1], out=is_first[1:])
        (begins,) = is_first.nonzero()
        beside = beside[begins]
        times = np.empty_like(begins)
        times[:-1], times[-1:] = begins[1:] - begins[:-1], len(by) - begins[-1:]
        known_count[beside] += times
        (is_placed,) = (known_count[beside] == 2).nonzero()
        placed, begin = beside[is_placed], begins[is_placed]
        is_alone = times[is_placed] == 1  # beside one of an earlier level
        second = begin + 1 - is_alone
        one_pin, one_bar = np.where(is_alone, (earlier_pin[placed], earlier_bar[placed]), (by[begin], on[begin]))
        earlier_pin[beside], earlier_bar[beside] = by[begins], on[begins]
        known[placed] = True
        newly_known = placed
        if len(placed):
            levels.append((one_pin, by[second], placed, one_bar, on[second]))
    first, second, placed, a, b = (np.concatenate(parts) for parts in zip(*levels, strict=True))
    # the first of the given pins moves, but for cranks
    swap = is_fixed[first]
    swap[on_cranks] = False
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    kinds = np.where(a == b, int(PinStep.CARRIED), int(PinStep.DYAD)) + is_fixed[second]
    kinds[on_cranks] = PinStep.CRANK
    return _Steps(kinds, first, second, placed, np.where(swap, b, a), np.where(swap, a, b)), known


def _pairs_on_bars(
    linkages: PinnedLinkages, entry_bar: IntArray, entry_pin: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Every pin with every other on the same bar, sorted by the first: both, and the bar."""
    sizes, starts = np.diff(linkages.first_entry), linkages.first_entry[:-1]
    pins, others, bars = [], [], []
    place, size, begin = np.arange(len(entry_bar)) - starts[entry_bar], sizes[entry_bar], starts[entry_bar]
    for step in range(1, int(sizes.max())):
        entries = slice(None) if sizes.min() > step else np.flatnonzero(size > step)
        pins.append(entry_pin[entries])
        others.append(entry_pin[begin[entries] + (place[entries] + step) % size[entries]])
        bars.append(entry_bar[entries])
    pin, other, bar = (np.concatenate(parts) for parts in (pins, others, bars))
    order = _stable_order(pin)
    return pin[order], other[order], bar[order]


def _stable_order(numbers: IntArray) -> IntArray:
    """The stable order of integers from zero on: numpy counts short integers, and compares others."""
    is_short = len(numbers) and numbers.max() <= np.iinfo(np.uint16).max
    return np.argsort(numbers.astype(np.uint16) if is_short else numbers, kind="stable")


def _numbers(
    linkages: PinnedLinkages, steps: _Steps, pin_owner: IntArray, unit: Array, is_fixed: BoolArray
) -> tuple[Array, Array]:
    """The numbers of steps (steps, numbers), and the shortest bar of dyads (steps,) in sizes; zero if the assembly
    is not sure."""
    x, y = linkages.positions.T.copy()
    (ax, ay), (bx, by), (px, py) = ((x[pins], y[pins]) for pins in (steps.first, steps.second, steps.placed))
    tox, toy, farx, fary = px - ax, py - ay, bx - ax, by - ay
    across, square = farx * toy - fary * tox, farx * farx + fary * fary
    p = np.empty((NUMBERS, len(px)))
    size = unit[pin_owner[steps.placed]]
    with np.errstate(all="ignore"):
        first_length, second_length = np.sqrt(tox * tox + toy * toy), np.sqrt((px - bx) ** 2 + (py - by) ** 2)
        p[:] = first_length, second_length, np.sign(across), 1.0 / size, bx, by
        # the other assembly has the pin on the other side of the line through the first two
        is_sure = is_surely_farther(4.0 * across * across / (square * size * size), np.zeros(1), roundings=2)
        arm = np.where(is_sure & ~is_fixed[steps.first], np.minimum(first_length, second_length) / size, 0.0)
        carried = np.flatnonzero(steps.kinds >= PinStep.CARRIED)
        p[0, carried], p[1, carried] = ((farx * tox + fary * toy) / square)[carried], (across / square)[carried]
        p[2, carried], p[3, carried] = bx[carried], by[carried]
        arm[carried] = np.where(is_fixed[steps.first[carried]], 0.0, np.inf)
    cranks = np.flatnonzero(steps.kinds == PinStep.CRANK)
    owner = pin_owner[steps.placed[cranks]]
    for row, values in enumerate((ax, ay, tox, toy)):
        p[row, cranks] = values[cranks]
    p[4, cranks], p[5, cranks], arm[cranks] = linkages.velocity[owner], linkages.acceleration[owner], np.inf
    return p.T.copy(), np.nan_to_num(arm, nan=0.0, posinf=np.inf)


def _sizes(linkages: PinnedLinkages, entry_bar: IntArray, entry_pin: IntArray) -> tuple[Array, Array]:
    """The greatest extent of a link of each linkage, and its greatest coordinate (m)."""
    starts, frames = linkages.first_entry[:-1], linkages.first_frame_pin[:-1]
    xy, first, fixed = linkages.positions.T.copy(), entry_pin[starts], frame_pins(linkages)
    base = [coordinates[first] for coordinates in xy]
    axis = [coordinates[entry_pin[starts + 1]] - begin for coordinates, begin in zip(xy, base, strict=True)]
    length = np.sqrt(axis[0] ** 2 + axis[1] ** 2)
    extents, reaches = length, length
    if len(entry_bar) > 2 * len(starts):
        c, s = ((part / length)[entry_bar] for part in axis)
        x, y = (coordinates[entry_pin] - begin[entry_bar] for coordinates, begin in zip(xy, base, strict=True))
        extents, reaches = _extents((c * x + s * y, c * y - s * x), starts)
    (extent, reach), heads = _extents([coordinates[fixed] for coordinates in xy], frames), linkages.first_bar[:-1]
    unit = np.maximum(np.maximum.reduceat(extents, heads), extent)
    return unit, np.maximum(np.maximum.reduceat(reaches, heads), reach)


def _extents(points: Sequence[Array], starts: IntArray) -> tuple[Array, Array]:
    """The diagonals of the boxes around points x, y (points,), part by part, and the greatest coordinate (parts,)."""
    bounds = [(np.minimum.reduceat(part, starts), np.maximum.reduceat(part, starts)) for part in points]
    (left, right), (low, high) = bounds
    wide, tall = right - left, high - low
    return np.sqrt(wide * wide + tall * tall), np.maximum(np.maximum(-left, right), np.maximum(-low, high))


def prepare_pins(
    linkages: PinnedLinkages, tape: TapedLinkages, numbers: IntArray, pins: IntArray, rows: IntArray
) -> PreparedTape:
    """Prepare the tape of linkages, see `make_pin_tape`; `numbers` (linkages,) are those in the part.

    `pins` (points,) are those that are results, numbered through all linkages, and `rows` their rows. Other pins have
    temporary slots that linkages share.
    """
    slots = FIRST_ROOM_SLOT - np.arange(len(linkages.positions))
    slots += np.repeat(linkages.first_pin[:-1], np.diff(linkages.first_pin))
    slots[pins] = rows
    block_slots = slots[tape.slots]
    block_slots[tape.kinds == PinStep.CRANK, 0] = TABLE
    return PreparedTape(tape._replace(which=numbers[tape.which], slots=block_slots), _pin_kinds)


def _pin_kinds(rates: bool) -> BlockKinds:
    return BlockKinds(
        lambda kind, polished: compile_block(pin_formulas(rates, polished)[kind], LEAST_COSINE), POINT_ROWS[rates]
    )
