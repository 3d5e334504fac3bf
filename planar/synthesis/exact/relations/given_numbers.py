"""The numbers of links and lines that are given, as conditions between the places of the first entry."""

from __future__ import annotations

from typing import NamedTuple

from planar.model.link_shapes import At, Link, link_shape
from planar.synthesis.exact.relations.polynomials import Polynomial, as_polynomial
from planar.synthesis.exact.relations.reference_pose import ReferencePose, SlidingRow
from planar.synthesis.exact.relations.unknowns import NumberKind, refuse


class KnownAxes(NamedTuple):
    """Of a link at the first entry: where its x-axis goes, and its origin, where that is known."""

    direction: Polynomial
    origin: Polynomial | None


def add_given_numbers(pose: ReferencePose, axes: dict[str, KnownAxes], slides: dict[str, float]) -> None:
    """The conditions of all numbers that are given; `axes` of links, and displacements (m), that are known at the
    first entry."""
    for link in pose.mechanism.links:
        if link.name != pose.mechanism.frame:
            _add_link(pose, link, axes.get(link.name))
    for each in pose.slides:
        if each.pair.bodies[0] == pose.mechanism.frame:
            _add_line(pose, each, slides.get(each.pair.name))
        else:
            _add_moving_line(pose, each, axes.get(each.pair.bodies[0]), each.pair.name in slides)


def _add_link(pose: ReferencePose, link: Link, axes: KnownAxes | None) -> None:
    used = [name for own, name in pose.places if own == link.name and isinstance(name, str)]
    if link.axis is not None and (axes is not None or len(used) > 1):
        raise refuse(f"the axes of {link.name!r} follow from two of its points")
    if link.ends is not None:
        _add_link_by_ends(pose, link, used, axes)
    else:
        _add_link_by_points(pose, link, used, axes)


def _is_free(pose: ReferencePose, name: str) -> bool:
    return name in pose.free or name not in pose.numbers


def _add_link_by_ends(pose: ReferencePose, link: Link, used: list[str], axes: KnownAxes | None) -> None:
    assert link.ends is not None
    table = pose.table
    first, second = (pose.place(link.name, name) for name in link.ends)
    others = [name for name in used if name not in link.ends]
    given = {name: [not _is_free(pose, f"{link.name}.{name}.{axis}") for axis in "xy"] for name in others}
    has_length = not _is_free(pose, f"{link.name}.length")
    if axes is not None and axes.origin is not None:
        pose.tie(first - axes.origin)
    along = _now(pose, second - first)
    length = None
    if has_length:
        length = table.add_given(NumberKind.LENGTH, float(link.length)).value  # type: ignore[arg-type]
    if axes is None and not any(any(each) for each in given.values()):
        if length is not None:
            pose.conditions.append(along * along.conjugate - length * length)
        return
    way = axes.direction if axes is not None else _sought_direction(pose)
    if length is not None:
        pose.tie(along - length * way)
    else:
        pose.conditions.append(along * way.conjugate - along.conjugate * way)
    for name in others:
        _add_point(pose, link, name, given[name], _now(pose, first), way)


def _add_link_by_points(pose: ReferencePose, link: Link, used: list[str], axes: KnownAxes | None) -> None:
    given = {name: [not _is_free(pose, f"{link.name}.{name}.{axis}") for axis in "xy"] for name in used}
    count = sum(sum(each) for each in given.values())
    if axes is not None and axes.origin is not None:
        origin, way = axes.origin, axes.direction
    elif count > 3 or (axes is not None and count > 2):  # up to three only say where the axes are
        origin = pose.table.add_unknown().value
        way = axes.direction if axes is not None else _sought_direction(pose)
    else:
        return
    for name in used:
        _add_point(pose, link, name, given[name], origin, way)


def _sought_direction(pose: ReferencePose) -> Polynomial:
    way = pose.table.add_unknown().value
    pose.conditions.append(way * way.conjugate - 1.0)
    return way


def _add_point(
    pose: ReferencePose, link: Link, name: str, given: list[bool], origin: Polynomial, way: Polynomial
) -> None:
    """The coordinates of a point along its link's axes, as far as they are given."""
    if not any(given):
        return
    place = next((each.place for each in link.points if each.name == name), None)
    if not isinstance(place, At):
        raise refuse(f"point {name!r} of {link.name!r} is not written by its coordinates")
    own = pose.table.add_given(NumberKind.VECTOR, complex(place.x, place.y)).value
    off = _now(pose, pose.place(link.name, name) - origin)
    if all(given):
        pose.tie(off - own * way)
        return
    turned = off * way.conjugate - own
    pose.conditions.append(turned + turned.conjugate if given[0] else turned - turned.conjugate)


def _add_line(pose: ReferencePose, slide: SlidingRow, displacement: float | None) -> None:
    """Where a line goes through a place that is given, or that has another part."""
    frame = pose.mechanism.frame
    free = pose.free_coordinates(slide.through)
    name = slide.through
    has_other_part = any(own == frame and other == name for own, other in pose.places)
    if not has_other_part and (all(free) or (displacement is None and any(free))):
        return
    off = _now(pose, slide.slider - pose.place(frame, name))
    if displacement is not None:
        along = pose.table.add_given(NumberKind.LENGTH, displacement).value
        off = off - along * slide.direction
    if has_other_part or not any(free):
        if displacement is not None:
            pose.tie(off)
        else:
            pose.conditions.append(_now(pose, off * slide.direction.conjugate - off.conjugate * slide.direction))
        return
    pose.conditions.append(off + off.conjugate if not free[0] else off - off.conjugate)


def _add_moving_line(pose: ReferencePose, slide: SlidingRow, axes: KnownAxes | None, has_displacement: bool) -> None:
    """The direction of a line of a moving link, and where it goes through, as far as they are given."""
    link, name = slide.pair.bodies[0], slide.through
    if has_displacement:
        raise refuse(f"where {slide.pair.name!r} stands on a link that moves is given")
    angle = pose.line_angle(slide.pair.name)
    has_angle = angle is not None and not _is_free(pose, angle)
    if not isinstance(name, str):
        raise refuse(f"the line of {slide.pair.name!r} goes through a place without a name")
    has_place = not any(_is_free(pose, f"{link}.{name}.{axis}") for axis in "xy")
    is_elsewhere = any(own == link and other == name for own, other in pose.places)
    if is_elsewhere:
        off = _now(pose, slide.slider - pose.place(link, name))
        pose.conditions.append(_now(pose, off * slide.direction.conjugate - off.conjugate * slide.direction))
    if not has_angle and (is_elsewhere or not has_place):
        return
    if axes is None or axes.origin is None:
        raise refuse(f"the line of {slide.pair.name!r} is given on {link!r}, and how that stands is not")
    if has_angle:
        assert angle is not None
        turned = pose.table.add_given(NumberKind.TURN, float(pose.numbers[angle].value)).value
        pose.tie(slide.direction - axes.direction * turned)
    if has_place and not is_elsewhere:
        at = link_shape(pose.links[link]).position(name)
        own = pose.table.add_given(NumberKind.VECTOR, complex(at.x, at.y)).value
        off = _now(pose, slide.slider - axes.origin - own * axes.direction)
        pose.conditions.append(_now(pose, off * slide.direction.conjugate - off.conjugate * slide.direction))


def _now(pose: ReferencePose, row: Polynomial) -> Polynomial:
    return as_polynomial(row).substitute(pose.values)
