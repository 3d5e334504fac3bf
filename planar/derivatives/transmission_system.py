"""The transmission angle of an output link by the balance of a load on that link alone; see `planar.transmission`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from planar.dynamics.external_actions import LinkMotion
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar, atan2
from planar.model.loads import Load
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair


def loaded_output(mechanism: Mechanism, pair: Pair) -> Mechanism:
    """The mechanism with weightless links under an effort of one at the output's pair."""
    load = Load(pair=pair.name, effort=1.0)
    return replace(mechanism, loads=(load,), masses=(), springs=(), gravity=(0.0, 0.0), published=())


def output_angle(
    links: LinkMotion, output: tuple[str, Pair], through: tuple[str, ...], forces: Iterable[Vector]
) -> Scalar:
    """The angle (rad) between the forces of the other moving links on the output, (link, pair), and its lever, or
    across its way; `through` are the pairs by which they act."""
    parts = [*forces]
    force = Vector(sum(part.x for part in parts), sum(part.y for part in parts))
    direction = _output_direction(links, output, through[0])
    cross, dot = abs(direction.cross(force)), abs(direction.dot(force))
    return atan2(dot, cross) if output[1].input_kind is MeasureKind.LENGTH else atan2(cross, dot)


def _output_direction(links: LinkMotion, output: tuple[str, Pair], driving: str) -> Vector:
    """Along the slide, or from the fixed pin to where the force acts."""
    link, pair = output
    if pair.input_kind is MeasureKind.LENGTH:
        direction = links.relative_motions[pair.name].effort_action(links.frames, links.shapes).direction
        assert direction is not None
        return direction
    driving_pair = next(other for other in links.mechanism.pairs if other.name == driving)
    place = force_point(driving_pair, link)
    pin = next(member for member in pair.coincident_points() if member[0] == links.mechanism.frame)
    assert place is not None
    end, fixed = (links.place(name, links.shapes[name].position(point)) for name, point in (place, pin))
    return end - fixed


def can_drive(mechanism: Mechanism, pair: Pair, output: tuple[str, Pair]) -> bool:
    """Whether a pair may pass a force from another moving link to the output, (link, pair)."""
    link, output_pair = output
    others = [body for body in pair.bodies if body not in (link, mechanism.frame)]
    return link in pair.bodies and bool(others) and pair.entry_name() != output_pair.entry_name()


def undriven_output(link: str) -> BadInput:
    """The error for an output link that no other moving link drives."""
    return BadInput(
        link, f"no other moving link drives {link}: its transmission angle is that of a link the rest drives"
    )


def force_point(pair: Pair, link: str) -> tuple[str, str] | None:
    """The (link, point) where a pair's force on a link acts: of that link if it can be."""
    members = [member for member in pair.coincident_points() if member[0] == link]
    rides = pair.point_on_line()
    return members[0] if members else rides and rides[0]
