"""A wanted function against the one that a design makes, and below it the error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.drawing.designs.wanted_marks import CROSS
from planar.drawing.diagrams.axes import axes_frame, curve_strokes, fit_axis, point_on_paper
from planar.drawing.paper.picture import Label, Mark, Pen, Picture, Polyline
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import TURN
from planar.model.file_units import display_unit
from planar.model.mechanism import Mechanism, relative_motions
from planar.solving.input_grid import motion_over_input
from planar.synthesis.synthesis import SynthesisedDesign
from planar.synthesis.task.starts import motion_kind
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedFunction

ROOM = (84.0, 66.0)
"""mm that both diagrams take."""
ERROR_SHARE, GAP, NUMBER_ROOM = 0.3, 12.0, 18.0
"""Of the height that the error takes; mm between the diagrams for numbers and a name, and beside them."""
CURVE_STEPS = 60


class MadeFunction(NamedTuple):
    """What a design makes of a wanted function: `x`, `y` (m,) over its range with the scales' zeros where they fit
    best, and the `errors` (n,) of its entries, what is made less what is wanted; all SI."""

    x: Array
    y: Array
    errors: Array


def function_picture(
    design: SynthesisedDesign, task: SynthesisTask, item: int, room: tuple[float, float] = ROOM
) -> Picture | None:
    """The diagram of the item of this number, None where the design does not come to all its entries."""
    wanted = task.wanted[item]
    if not isinstance(wanted, WantedFunction):
        raise TypeError(f"a function is wanted, not {type(wanted).__name__}")
    try:
        made = _made_function(design, wanted, item)
    except (NoAnswer, BadInput):
        return None
    kinds = [motion_kind(design.mechanism, name) for name in (wanted.from_pair, wanted.to_pair)]
    (x_name, x_unit), (y_name, y_unit) = (display_unit(kind, task.units) for kind in kinds)
    x, y, errors = x_unit.from_si(made.x), y_unit.from_si(made.y), y_unit.from_si(made.errors)
    wanted_x, wanted_y = x_unit.from_si(wanted.inputs), y_unit.from_si(wanted.values)
    of_angles = [kind == "angle" and name == "°" for kind, name in zip(kinds, (x_name, y_name), strict=True)]
    width, height = room[0] - NUMBER_ROOM, room[1] - GAP
    names = f"{wanted.from_pair} ({x_name})", f"{wanted.to_pair} ({y_name})"
    across = fit_axis(np.concatenate([x, wanted_x]), width, names[0], degrees=of_angles[0])
    up = fit_axis(np.concatenate([y, wanted_y]), (1.0 - ERROR_SHARE) * height, names[1], 8.0, degrees=of_angles[1])
    marks: list[Mark] = [*axes_frame(across, up)]
    for own_x, own_y in zip(wanted_x, wanted_y, strict=True):
        at = point_on_paper(own_x, own_y, across, up)
        for rise in (CROSS, -CROSS):
            ends = (at[0] - CROSS, at[1] - rise), (at[0] + CROSS, at[1] + rise)
            marks.append(Polyline(ends, Pen.WANTED, f"wanted {wanted.of}"))
    marks += curve_strokes(x, y, across, up, Pen.PATH, f"made {wanted.of}")
    below = fit_axis(np.append(errors, 0.0), ERROR_SHARE * height, f"error ({y_name})", 5.0)
    error_marks: list[Mark] = [*axes_frame(across, below)]
    for own_x, error in zip(wanted_x, errors, strict=True):
        ends = point_on_paper(own_x, 0.0, across, below), point_on_paper(own_x, error, across, below)
        error_marks.append(Polyline(ends, Pen.ACCELERATION, f"error of {wanted.of}"))
    return Picture(
        (*marks, *_lowered(error_marks, GAP + ERROR_SHARE * height)), f"{wanted.to_pair} over {wanted.from_pair}"
    )


def _made_function(design: SynthesisedDesign, wanted: WantedFunction, item: int) -> MadeFunction:
    """Raises NoAnswer where the design does not reach an entry."""
    inputs = design.inputs[item]
    turns = motion_kind(design.mechanism, wanted.from_pair) == "angle"
    apart = inputs - wanted.inputs
    # an input that turns may have been brought back by whole turns: entries go on as they are wanted
    inputs = inputs - (TURN * np.round((apart - apart[0]) / TURN) if turns else 0.0)
    shift = 0.0 if wanted.is_absolute and not turns else float(np.mean(inputs - wanted.inputs))
    x = np.linspace(float(inputs.min()), float(inputs.max()), CURVE_STEPS + 1)
    every = _values(design.mechanism, wanted.to_pair, np.concatenate([inputs, x]))
    there, y = every[: len(inputs)], every[len(inputs) :]
    off = there - wanted.values
    if motion_kind(design.mechanism, wanted.to_pair) == "angle":
        turned = TURN * np.round(off / TURN)
        off, y = off - turned, y - turned[0]
    zero = 0.0 if wanted.is_absolute else float(off.mean())
    return MadeFunction(x - shift, y - zero, off - zero)


def _values(mechanism: Mechanism, pair: str, inputs: Array) -> Array:
    """The position of a pair (n,) at positions of the input, angles going on without a jump. Raises NoAnswer."""
    found = motion_over_input(mechanism, inputs).pair(pair)
    values: Array = np.asarray(found[next(iter(relative_motions(mechanism)[pair].result_kinds))], float)
    if motion_kind(mechanism, pair) == "length":
        return values
    order = np.argsort(inputs)
    values = values.copy()
    values[order] = np.unwrap(values[order])
    return values


def _lowered(marks: list[Mark], by: float) -> Iterator[Mark]:
    """Lines and letters so much farther down."""
    for mark in marks:
        if isinstance(mark, Label):
            yield mark._replace(at=(mark.at[0], mark.at[1] - by))
        elif isinstance(mark, Polyline):
            yield mark._replace(points=tuple((x, y - by) for x, y in mark.points))
