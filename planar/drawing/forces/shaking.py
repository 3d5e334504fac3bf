"""What shakes a frame before and after balancing: the polar diagram of its force, moment and effort over the motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planar.drawing.diagrams import axes
from planar.drawing.forces.drawn_forces import ForceRun, forces_over_cycle
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture
from planar.drawing.paper.scales import format_force, unit_for_size
from planar.dynamics.balancing.balance import Balance, BalanceTradeoff
from planar.dynamics.forces import forces
from planar.foundation.arrays import Array
from planar.model.file_units import FileUnits
from planar.model.link_shapes import shape_extent
from planar.model.wording import amount

POLAR_SIZE, DIAGRAM_WIDTH, DIAGRAM_HEIGHT = 80.0, 110.0, 62.0
"""mm between the axes: of the polar diagram, and of the others."""
MARK_RADIUS = 0.6
"""mm: the radius of a mark."""
ROOM = 1.08
"""Of the greatest force: how far the axes of the polar diagram go."""
NEGLIGIBLE = 1e-8
"""Of the greatest before: what is less is none."""
PENS = {"before": Pen.SHARE, "after": Pen.CURVE}


def balance_pictures(found: Balance, tradeoff: BalanceTradeoff | None = None) -> list[Picture]:
    """The shaking force as a polar diagram in the frame's axes, the shaking moment and the effort over the motion.

    Before and after; and the least moment over the force, where that is given. Strokes are `about` "before", "after"
    and "tradeoff".
    """
    drawn = forces_over_cycle(forces(found.motion, friction=False), with_steps=False)
    units = found.motion.mechanism.units
    pictures = [_polar_picture(found, units)]
    of_moment = {name: getattr(found, name).moment for name in PENS}
    told = f"Shaking moment about {found.about_name}"
    force = max(float(np.nanmax(np.hypot(*getattr(found, name).force.T))) for name in PENS)
    rounding = NEGLIGIBLE * force * (max(map(shape_extent, found.motion.shapes.values()), default=0.0) or 1.0)
    if any(np.nanmax(np.abs(each)) > rounding for each in of_moment.values()):
        pictures.append(_curves(drawn, of_moment, "M", "torque", told))
    symbol, kind = ("F", "force") if drawn.forces.is_force_input(found.input) else ("T", "torque")
    of_effort = {name: getattr(found, name).effort for name in PENS}
    if any(np.nanmax(np.abs(each)) > 0.0 for each in of_effort.values()):
        pictures.append(_curves(drawn, of_effort, symbol, kind, f"{kind.capitalize()} of the input {found.input}"))
    if tradeoff is not None:
        pictures.append(tradeoff_picture(tradeoff))
    return pictures


def tradeoff_picture(found: BalanceTradeoff) -> Picture:
    """The least greatest shaking moment over the greatest shaking force, and where both are without counterweights."""
    units = found.mechanism.units
    forces_in, moments = np.append(found.force, found.before[0]), np.append(found.moment, found.before[1])
    name, per = unit_for_size("force", float(forces_in.max()), units)
    across = axes.fit_axis(np.append(forces_in, 0.0) / per, DIAGRAM_WIDTH, f"greatest force ({name})", 16.0)
    across = across._replace(low=across.low * per, high=across.high * per, step=across.step * per, unit_factor=per)
    up = axes.force_axis(moments, DIAGRAM_HEIGHT, "M", "torque", units)
    marks: list[Mark] = [*axes.axes_frame(across, up)]
    marks += axes.curve_strokes(found.force, found.moment, across, up, Pen.CURVE, "tradeoff")
    for force, moment in zip(found.force, found.moment, strict=True):
        marks.append(_mark(axes.point_on_paper(force, moment, across, up), "tradeoff"))
    at = axes.point_on_paper(*found.before, across, up)
    marks += [_mark(at, "before"), Label("before", at, "before", 8.0, 1.2)]
    notes = ("none below the curve, within the limits of the counterweights",)
    return Picture(tuple(marks), f"Least shaking moment about {found.about_name}", notes)


def _mark(at: tuple[float, float], about: str) -> Circle:
    return Circle(at, MARK_RADIUS, Pen.CURVE, about, Fill.PAPER)


def _polar_picture(found: Balance, units: FileUnits) -> Picture:
    sizes = {name: getattr(found, name).measured("shaking force") for name in PENS}
    greatest = max(sizes.values())
    name, per = unit_for_size("force", greatest, units)
    reach = np.array([-ROOM, ROOM]) * (greatest or per) / per
    both = [axes.fit_axis(reach, POLAR_SIZE, f"{part} part of F ({name})", 14.0) for part in ("x", "y")]
    across, up = (
        each._replace(low=each.low * per, high=each.high * per, step=each.step * per, unit_factor=per) for each in both
    )
    marks: list[Mark] = [*axes.axes_frame(across, up)]
    middle = axes.point_on_paper(0.0, 0.0, across, up)
    marks.append(Circle(middle, MARK_RADIUS, Pen.AXIS, "origin", Fill.SOLID))
    for about, pen in PENS.items():
        force = getattr(found, about).force
        if sizes[about] <= NEGLIGIBLE * greatest:
            marks.append(Label(about, middle, about, 8.0, 1.5))
            continue
        marks += axes.curve_strokes(force[:, 0], force[:, 1], across, up, pen, about)
        row = int(np.nanargmax(np.linalg.norm(force, axis=1)))
        at = axes.point_on_paper(force[row, 0], force[row, 1], across, up)
        marks += [_mark(at, about), Label(about, at, about, 8.0, 1.0)]
    shown = {about: size if size > NEGLIGIBLE * greatest else 0.0 for about, size in sizes.items()}
    notes = [
        f"greatest {about}, among these positions: {format_force(size, 'force', units)}"
        for about, size in shown.items()
    ]
    notes += [
        f"{each.link}: {amount(each.mass, 'mass', units)} at {amount(each.radius, 'length', units)}, "
        f"{amount(each.angle, 'angle', units)} from x ({each.axes})"
        for each in found.counterweights
    ]
    return Picture(tuple(marks), "Shaking force on the frame", tuple(notes))


def _curves(drawn: ForceRun, of: dict[str, Array], symbol: str, kind: str, title: str) -> Picture:
    """Before and after over the motion."""
    units = drawn.motion.mechanism.units
    shown = {name: drawn.in_order(each) for name, each in of.items()}
    across = axes.fit_axis(
        drawn.abscissa, DIAGRAM_WIDTH, drawn.axis_name, end_at_ticks=False, degrees=drawn.unit == "deg"
    )
    up = axes.force_axis(np.concatenate([*shown.values()]), DIAGRAM_HEIGHT, symbol, kind, units)
    marks: list[Mark] = [*axes.axes_frame(across, up), *_curve_marks(drawn, shown, across, up)]
    notes = tuple(
        f"greatest {name}, among these positions: {format_force(float(np.nanmax(np.abs(each))), kind, units)}"
        for name, each in of.items()
    )
    return Picture(tuple(marks), title, notes)


def _curve_marks(drawn: ForceRun, shown: dict[str, Array], across: axes.Axis, up: axes.Axis) -> Iterator[Mark]:
    apart = np.abs(shown["before"] - shown["after"])
    rows = {"before": int(np.nanargmax(np.abs(shown["before"]))), "after": int(np.nanargmax(apart))}
    for name, values in shown.items():
        yield from axes.curve_strokes(drawn.abscissa, values, across, up, PENS[name], name)
        at = axes.point_on_paper(drawn.abscissa[rows[name]], values[rows[name]], across, up)
        yield Label(name, at, name, 8.0, 0.8)
