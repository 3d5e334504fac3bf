"""A matplotlib figure as a DXF drawing: lines in millimetres on paper, letters as outlines on a layer of their own."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS = 72.0
"""To an inch, in which the figure is drawn."""
MM_PER_DOT = 25.4 / DOTS
LINES, LETTERS = "LINES", "TEXT"
"""Layers, of the colour that shows on paper and on a dark ground."""
DARK, LIGHT = 0.2, 0.99
"""Colours below are those of the layer, areas above are paper."""


def encode_dxf(figure: Figure) -> bytes:
    """The figure's lines as polylines, dashed ones as such, in their colours; areas are not filled, so that what lies
    behind one shows. Raises BadInput where ezdxf is not installed."""
    try:
        from ezdxf import units
        from ezdxf.filemanagement import new
    except ImportError:
        raise BadInput("ezdxf", 'DXF files need ezdxf: pip install "planar-linkages[parts]"') from None
    document = new("R2010", setup=["linetypes"], units=units.MM)
    for layer in (LINES, LETTERS):
        document.layers.add(layer, color=7)
    before = figure.dpi
    try:
        figure.dpi = DOTS
        figure.draw(_renderer(document.modelspace(), figure.get_size_inches() * DOTS))
    finally:
        figure.dpi = before
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def _renderer(space: Any, size: Any) -> Any:
    """What takes each path that a figure of this size draws into a drawing."""
    from matplotlib.backend_bases import RendererBase

    class Renderer(RendererBase):
        """Letters, which the base class draws by their outlines, are told from lines by the layer."""

        layer = LINES

        def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
            told = _line_attributes(gc, rgbFace, self.layer)
            if told is None:
                return
            box = gc.get_clip_rectangle()
            clip = (0.0, 0.0, *size) if box is None else tuple(box.extents)
            flat = path.cleaned(transform=transform, clip=clip, curves=False, simplify=False)
            for points, closed in _polylines(flat):
                space.add_lwpolyline(points * MM_PER_DOT, close=closed, dxfattribs=told)

        def draw_text(self, *args: Any, **more: Any) -> None:
            self.layer = LETTERS
            super().draw_text(*args, **more)
            self.layer = LINES

        def draw_image(self, *args: Any, **more: Any) -> None:
            """A picture of dots is no drawing of lines."""

        def get_canvas_width_height(self) -> tuple[float, float]:
            return float(size[0]), float(size[1])

        def points_to_pixels(self, points: Any) -> Any:
            return points * DOTS / 72.0

        def flipy(self) -> bool:
            return False

    return Renderer()


def _line_attributes(gc: Any, filled: Any, layer: str) -> dict[str, Any] | None:
    """Layer, colour and dashes of a path; None for what is paper, or not seen."""
    from ezdxf import colors

    stroked = gc.get_linewidth() > 0.0 and gc.get_rgb()[3] > 0.0
    colour = gc.get_rgb()[:3] if stroked else filled
    if colour is None or (not stroked and min(colour[:3]) > LIGHT):
        return None
    told: dict[str, Any] = {"layer": layer}
    if max(colour[:3]) > DARK:
        told["true_color"] = colors.rgb2int(tuple(round(255 * each) for each in colour[:3]))
    if stroked and gc.get_dashes()[1] is not None:
        told |= {"linetype": "DASHED", "ltscale": 0.1}
    return told


def _polylines(path: Any) -> list[tuple[np.ndarray, bool]]:
    """The lines of a path without curves, each with whether it is closed."""
    found: list[tuple[np.ndarray, bool]] = []
    points: list[Any] = []
    closed = False
    for vertex, code in [*zip(path.vertices, path.codes, strict=True), (None, path.STOP)]:
        if code in (path.MOVETO, path.STOP):
            if len(points) > 1:
                found.append((np.array(points), closed))
            points, closed = ([vertex] if code == path.MOVETO else []), False
        elif code == path.CLOSEPOLY:
            closed = True
        else:
            points.append(vertex)
    return found
