"""Springs, dampers and centres of mass as strokes on paper."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, pi, remainder

from planar.drawing.paper.picture import Label, Outline, paper_point
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.link_bodies import unit_vector
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.springs_masses import Coil, MassCentreMark, Spiral

MIN_SPRING_LENGTH = 1e-6
"""mm: ends of a spring nearer than this have no direction."""


def spring_strokes(scene: Scene) -> Iterator[Outline]:
    """Springs and dampers, each as long as it is in this position."""
    for mark in scene.marks:
        if isinstance(mark, Coil):
            ends = [scene.to_paper(link, at) for link, at in zip(mark.links, mark.at, strict=True)]
            apart = ends[1] - ends[0]
            if apart.dot(apart) > MIN_SPRING_LENGTH**2:
                yield from symbols.symbol_marks(mark.symbol, mark.name, ends[0], unit_vector(apart), ends[1])
        elif isinstance(mark, Spiral):
            turned = [scene.direction_on_paper(link, way) for link, way in zip(mark.links, mark.ways, strict=True)]
            first, second = (atan2(way.y, way.x) for way in turned)
            angles = [scene.frames[link].angle for link in mark.links]
            wound = remainder(angles[1] - angles[0] - mark.free, 2.0 * pi)
            yield from symbols.torsion_spring(
                scene.to_paper(mark.pin, mark.at), first, second, wound, f"torsion {mark.symbol}", mark.name
            )


def mass_centre_marks(scene: Scene) -> Iterator[Outline]:
    """Centres of mass."""
    for mark in scene.marks:
        if isinstance(mark, MassCentreMark):
            yield from symbols.symbol_marks("mass centre", mark.name, scene.to_paper(mark.link, mark.at))


def mass_centre_labels(scene: Scene, size: float = 9.0) -> Iterator[Label]:
    """The letters of the centres of mass that are at no named point."""
    for mark in scene.marks:
        if isinstance(mark, MassCentreMark) and mark.letter:
            at = scene.to_paper(mark.link, mark.at)
            yield Label(mark.letter, paper_point(at), mark.name, size, symbol_table.MASS_CENTRE_RADIUS + 0.5)
