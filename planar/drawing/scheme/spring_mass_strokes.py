"""Springs, dampers and centres of mass as strokes on paper."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, pi, remainder

from planar.drawing.paper.picture import Letter, Line, Mark, spot
from planar.drawing.scheme import symbols
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.springs_masses import Centre, Coil, Spiral

NO_LENGTH = 1e-6
"""mm: ends of a spring nearer than this have no direction."""


def springs(scene: Scene) -> Iterator[Line]:
    """Springs and dampers, each as long as it is in this position."""
    for mark in scene.marks:
        if isinstance(mark, Coil):
            ends = [scene.place(link, at) for link, at in zip(mark.links, mark.at, strict=True)]
            apart = ends[1] - ends[0]
            if apart.dot(apart) > NO_LENGTH**2:
                yield from symbols.coil(*ends, mark.symbol, mark.name)
        elif isinstance(mark, Spiral):
            turned = [scene.way(link, way) for link, way in zip(mark.links, mark.ways, strict=True)]
            first, second = (atan2(way.y, way.x) for way in turned)
            angles = [scene.frames[link].angle for link in mark.links]
            wound = remainder(angles[1] - angles[0] - mark.free, 2.0 * pi)
            yield from symbols.spiral(scene.place(mark.pin, mark.at), first, second, wound, mark.symbol, mark.name)


def centres(scene: Scene) -> Iterator[Mark]:
    """Centres of mass."""
    for mark in scene.marks:
        if isinstance(mark, Centre):
            yield from symbols.mass_centre(scene.place(mark.link, mark.at), mark.name)


def centre_letters(scene: Scene, size: float = 9.0) -> Iterator[Letter]:
    """The letters of the centres of mass that are at no named point."""
    for mark in scene.marks:
        if isinstance(mark, Centre) and mark.letter:
            at = scene.place(mark.link, mark.at)
            yield Letter(mark.letter, spot(at), mark.name, size, symbols.MASS + 0.5)
