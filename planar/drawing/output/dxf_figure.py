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
DARK = 0.2


def encode_dxf(figure: Figure) -> bytes:
    """The figure's lines as polylines, dashed ones as such, in their colours; areas are not filled, so that what lies
    behind one shows. Raises BadInput where ezdxf is not installed."""
    try:
        from ezdxf import colors, units
        from ezdxf.filemanagement import new
    except ImportError:
        raise BadInput("ezdxf", 'DXF files need ezdxf: pip install "planar-linkages[parts]"') from None
    from matplotlib.backend_bases import RendererBase

    document = new("R2010", setup=["linetypes"], units=units.MM)
    document.layers.add(LINES, color=7)
    document.layers.add(LETTERS, color=7)
    space = document.modelspace()
    width, height = figure.get_size_inches() * DOTS

    class Renderer(RendererBase):
        """Takes each path that the figure draws, clipped as it says, into the drawing."""

        layer = LINES

        def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
            stroked = gc.get_linewidth() > 0.0 and gc.get_rgb()[3] > 0.0
            colour = gc.get_rgb()[:3] if stroked else rgbFace
            if colour is None or (not stroked and min(colour[:3]) > 0.99):  # paper
                return
            box = gc.get_clip_rectangle()
            clip = (0.0, 0.0, width, height) if box is None else tuple(box.extents)
            told: dict[str, Any] = {"layer": self.layer}
            if max(colour[:3]) > DARK:  # black is the colour of the layer, which is white on a dark ground
                told["true_color"] = colors.rgb2int(tuple(round(255 * each) for each in colour[:3]))
            if stroked and gc.get_dashes()[1] is not None:
                told |= {"linetype": "DASHED", "ltscale": 0.1}
            for points, closed in _polylines(
                path.cleaned(transform=transform, clip=clip, curves=False, simplify=False)
            ):
                space.add_lwpolyline(points * MM_PER_DOT, close=closed, dxfattribs=told)

        def draw_text(self, *args: Any, **more: Any) -> None:
            self.layer = LETTERS
            super().draw_text(*args, **more)
            self.layer = LINES

        def draw_image(self, *args: Any, **more: Any) -> None:
            """A picture of dots is no drawing of lines."""

        def get_canvas_width_height(self) -> tuple[float, float]:
            return float(width), float(height)

        def points_to_pixels(self, points: Any) -> Any:
            return points * DOTS / 72.0

        def flipy(self) -> bool:
            return False

    before = figure.dpi
    try:
        figure.dpi = DOTS
        figure.draw(Renderer())
    finally:
        figure.dpi = before
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def _polylines(path: Any) -> list[tuple[np.ndarray, bool]]:
    """The lines of a path without curves, each with whether it is closed."""
    found: list[tuple[np.ndarray, bool]] = []
    points: list[Any] = []
    closed = False

    def end() -> None:
        if len(points) > 1:
            found.append((np.array(points), closed))

    for vertex, code in zip(path.vertices, path.codes, strict=True):
        if code in (path.MOVETO, path.STOP):
            end()
            points, closed = ([vertex] if code == path.MOVETO else []), False
        elif code == path.CLOSEPOLY:
            closed = True
        else:
            points.append(vertex)
    end()
    return found
