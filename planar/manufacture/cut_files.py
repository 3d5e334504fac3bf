"""Sheets of plates as files: DXF with a layer for what is cut and what is written, SVG; in millimetres or inches."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from math import atan, degrees, hypot, sin
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

from planar.foundation.errors import BadInput, unknown_format_error
from planar.manufacture.cut_units import CutUnit
from planar.manufacture.plates import Plate, Slot, Vertex, plate_box, room_within, sampled, scaled_plate

SUFFIXES = (".dxf", ".svg", ".step")
SHEET_GAP = 40.0
"""Between sheets that stand beside each other in one drawing (mm)."""
LETTER_HEIGHT = 4.0
"""Of the names on plates, and of the parts list (mm)."""
LETTER_WIDTH = 0.6
"""Of a letter, in parts of its height, for the width of a drawing."""


class Layout(NamedTuple):
    """What is drawn: the plates of each sheet, the sheets' width and height (mm), plates' numbers, lines of text, and
    the unit of the file."""

    sheets: Sequence[Sequence[Plate]]
    size: tuple[float, float]
    numbers: Mapping[str, int]
    lines: Sequence[str]
    unit: CutUnit

    @property
    def millimetre(self) -> float:
        """A millimetre in the unit of the file."""
        return 1.0 / self.unit.millimetres

    @property
    def letter_height(self) -> float:
        """The height of the lines of text, in the unit of the file."""
        return LETTER_HEIGHT * self.millimetre

    @property
    def scaled_sheets(self) -> list[list[Plate]]:
        """The plates of each sheet in the unit of the file."""
        return [[scaled_plate(plate, self.millimetre) for plate in sheet] for sheet in self.sheets]


def encode_layout(layout: Layout, suffix: str) -> bytes:
    """The sheets, side by side, with the lines of text beneath. Raises BadInput for another ending."""
    kind = suffix.lower()
    if kind not in SUFFIXES:
        raise unknown_format_error(suffix, "parts", SUFFIXES)
    return _encode_dxf(layout) if kind == ".dxf" else _encode_svg(layout)


def _number_place(plate: Plate, millimetre: float) -> tuple[float, float, float]:
    """Where a plate's number stands, and how high: between two of its points where most room is."""
    outline = sampled(plate.outline)
    middle = tuple(sum(place[k] for place in plate.core) / len(plate.core) for k in (0, 1))
    middles = [(middle[0], middle[1])]
    middles += [((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0) for a in plate.core for b in plate.core]
    middles += [(x, y + 0.55 * plate.reach) for x, y in plate.core]

    def room(at: tuple[float, float]) -> float:
        free = [hypot(hole.at[0] - at[0], hole.at[1] - at[1]) - hole.diameter / 2.0 for hole in plate.holes]
        free += [_off_slot(slot, at) for slot in plate.slots]
        return min([*free, room_within(outline, at), LETTER_HEIGHT * millimetre])

    best = max(middles, key=room)
    return *best, max(millimetre, room(best))


def _off_slot(slot: Slot, at: tuple[float, float]) -> float:
    """How far a place is from a slot's edge."""
    (x, y), (u, v) = slot.start, slot.end
    size = (u - x) ** 2 + (v - y) ** 2
    along = 0.0 if size == 0.0 else min(1.0, max(0.0, ((at[0] - x) * (u - x) + (at[1] - y) * (v - y)) / size))
    return hypot(at[0] - x - along * (u - x), at[1] - y - along * (v - y)) - slot.width / 2.0


def _encode_dxf(layout: Layout) -> bytes:
    """Lines and arcs as closed polylines with bulges, holes as circles; $INSUNITS is the millimetre or the inch."""
    try:
        from ezdxf import units
        from ezdxf.filemanagement import new
    except ImportError:
        raise BadInput("ezdxf", 'DXF files need ezdxf: pip install "planar-linkages[parts]"') from None
    document = new("R2010", units=units.MM if layout.unit.name == "mm" else units.IN)
    for name, colour in (("CUT", 7), ("HOLES", 1), ("SLOTS", 5), ("TEXT", 3), ("SHEET", 8)):
        document.layers.add(name, color=colour)
    space = document.modelspace()
    width, height = (side * layout.millimetre for side in layout.size)
    for number, sheet in enumerate(layout.scaled_sheets):
        x = number * (width + SHEET_GAP * layout.millimetre)
        corners = [(x, 0.0), (x + width, 0.0), (x + width, height), (x, height)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "SHEET"})
        for plate in sheet:
            _add_plate(space, plate, layout, x)
    for number, line in enumerate(layout.lines):
        at = (0.0, -2.0 * layout.letter_height * (number + 1))
        space.add_text(line, height=layout.letter_height, dxfattribs={"layer": "TEXT"}).set_placement(at)
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def _add_plate(space: Any, plate: Plate, layout: Layout, x: float) -> None:
    cut = len(plate.inside) + 1
    for which, loop in enumerate(plate.loops):
        layer = "CUT" if which < cut else "SLOTS"
        space.add_lwpolyline(
            [(u + x, v, bulge) for u, v, bulge in loop], format="xyb", close=True, dxfattribs={"layer": layer}
        )
    for hole in plate.drilled:
        space.add_circle((hole.at[0] + x, hole.at[1]), hole.diameter / 2.0, dxfattribs={"layer": "HOLES"})
    u, v, size = _number_place(plate, layout.millimetre)
    placed = space.add_text(str(layout.numbers[plate.name]), height=size, dxfattribs={"layer": "TEXT"})
    placed.set_placement((u + x, v), align=_centred())


def _centred() -> Any:
    from ezdxf.enums import TextEntityAlignment

    return TextEntityAlignment.MIDDLE_CENTER


def _encode_svg(layout: Layout) -> bytes:
    """A drawing as large as the parts and their list: cut lines black, slots and holes too, names as text.

    Of several sheets each has a grey frame round its parts.
    """
    letter, unit = layout.letter_height, layout.unit.name
    boxes = [plate_box(sheet) for sheet in layout.scaled_sheets]
    height = max(upper - lower for _, lower, _, upper in boxes) + 2.0 * letter
    elements: list[str] = []
    edge = 0.0
    for sheet, (left, lower, right, _) in zip(layout.scaled_sheets, boxes, strict=True):
        x, floor = edge + letter - left, height - letter + lower
        width = right - left + 2.0 * letter
        if len(boxes) > 1:
            elements.append(f'<rect x="{edge:.6g}" y="0" width="{width:.6g}" height="{height:.6g}" stroke="#999999"/>')
        edge += width + (letter if len(boxes) > 1 else 0.0)
        for plate in sheet:
            elements += _svg_plate(plate, layout, x, floor)
    for number, line in enumerate(layout.lines):
        elements.append(_svg_text(escape(line), letter, height + 2.0 * letter * (number + 1), letter, "start"))
    across = max(edge, *(LETTER_WIDTH * letter * len(line) + 2.0 * letter for line in layout.lines))
    down = height + 2.0 * letter * (len(layout.lines) + 1)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{across:.6g}{unit}" height="{down:.6g}{unit}" '
        f'viewBox="0 0 {across:.6g} {down:.6g}" fill="none" stroke="black" '
        f'stroke-width="{0.2 * layout.millimetre:.4g}">'
    )
    return ("\n".join([head, *elements, "</svg>"]) + "\n").encode()


def _svg_plate(plate: Plate, layout: Layout, x: float, floor: float) -> list[str]:
    """A plate with its number, its origin at x from the left and `floor` from the top of the drawing."""
    way = " ".join(_svg_path(loop, x, floor) for loop in plate.loops)
    elements = [f'<path d="{way}"/>']
    elements += [
        f'<circle cx="{hole.at[0] + x:.6f}" cy="{floor - hole.at[1]:.6f}" r="{hole.diameter / 2.0:.6f}"/>'
        for hole in plate.drilled
    ]
    u, v, size = _number_place(plate, layout.millimetre)
    elements.append(_svg_text(str(layout.numbers[plate.name]), u + x, floor - v + 0.35 * size, size, "middle"))
    return elements


def _svg_text(text: str, x: float, y: float, size: float, anchor: str) -> str:
    return (
        f'<text x="{x:.4f}" y="{y:.4f}" font-size="{size:.4g}" text-anchor="{anchor}" '
        f'font-family="sans-serif" fill="#336699" stroke="none">{text}</text>'
    )


def _svg_path(loop: tuple[Vertex, ...], x: float, height: float) -> str:
    """A closed line; an arc's radius from its bulge: chord / 2 / sin(2 atan b)."""
    found = [f"M{loop[0][0] + x:.6f} {height - loop[0][1]:.6f}"]
    for (u, v, bulge), (a, b, _) in zip(loop, [*loop[1:], loop[0]], strict=True):
        to = f"{a + x:.6f} {height - b:.6f}"
        if bulge == 0.0:
            found.append(f"L{to}")
            continue
        turn = 4.0 * atan(bulge)
        radius = abs(hypot(a - u, b - v) / 2.0 / sin(turn / 2.0))
        large, sweep = int(abs(degrees(turn)) > 180.0), int(bulge < 0.0)
        found.append(f"A{radius:.6f} {radius:.6f} 0 {large} {sweep} {to}")
    return " ".join([*found, "Z"])
