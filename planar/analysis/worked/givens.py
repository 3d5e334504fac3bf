"""What is given for a position, as a chapter states it: links with their lengths, pairs, inputs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2

import numpy as np

from planar.analysis.rate_equations import SlideJoint, rate_equations
from planar.analysis.rich_text import MeasuredValue, Phrase, list_phrases
from planar.foundation.units import SI_UNITS, parse_unit
from planar.model.file_units import FileUnits, unit_of_kind
from planar.model.link_shapes import Along, At, Distances, Link, Offset
from planar.model.mechanism import Mechanism, pair_entries, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount, turning_sense
from planar.results.motion import State
from planar.results.records import InputState


def given_data(state: State) -> Iterator[Phrase]:
    """Links with their lengths, pairs, and inputs with their rates."""
    mechanism = state.mechanism
    for link in mechanism.links:
        yield from _link_phrases(mechanism, link)
    pairs: dict[str, list[Pair]] = {}
    for group in pair_entries(mechanism):
        pairs.setdefault(type(group[0]).keyword, []).append(group[0])
    for kind, alike in pairs.items():
        many = "s" * (len(alike) > 1)
        yield (f"{kind.capitalize()} pair{many}: ", *_pair_phrases(alike, state), ".")
    named = relative_motions(mechanism)
    for pair, driven in state.inputs.items():
        yield _input_phrase(mechanism, named[pair], driven)


def _pair_phrases(group: Sequence[Pair], state: State) -> Phrase:
    said: list[Phrase] = []
    slides = {slide.name: slide for slide in rate_equations(state).slides}
    for pair in group:
        rides = pair.point_on_line()
        sizes = pair.describe_sizes(lambda value: _format_amount(value, "length", state.mechanism.units))
        more = f"; {sizes}" if sizes else ""
        if rides is not None:
            (rider, point), guide = rides
            line = _guide_line(state, slides[pair.name]) if guide == state.mechanism.frame else ""
            said.append((f"{pair.name} ({point} of {rider} on {guide}{line}{more})",))
        elif pair.coincident_points():
            said.append((pair.entry_name(),))
        else:
            said.append((f"{pair.name} ({' and '.join(pair.links)}{more})",))
    return list_phrases(said)


def _guide_line(state: State, slide: SlideJoint) -> str:
    """Where a fixed line is: its direction, and the point of it that is nearest to the origin."""
    if slide.line is None:
        return ""
    units, way = state.mechanism.units, slide.line[0]
    place = rate_equations(state).point_position(slide.rider, slide.point)
    foot = place - (place @ way) * way
    foot[np.abs(foot) <= 1e-9 * (np.hypot(*place) or 1.0)] = 0.0
    way = np.where(np.abs(way) <= 1e-12, 0.0, way)
    angle = _format_amount(atan2(way[1], way[0]), "angle", units)
    x, y = (_format_signed(parse_unit(units.length).from_si(float(each))) for each in foot)
    return f", along a line at {angle} through ({x}, {y}) {units.length}"


def _format_amount(value: float, kind: str, units: FileUnits) -> str:
    return amount(value, kind, units).replace("-", "−", 1) if value < 0.0 else amount(value, kind, units)


def _link_phrases(mechanism: Mechanism, link: Link) -> Iterator[Phrase]:
    """What is known of a link's shape: AB = 50 mm; E on BC, BE = 40 mm."""
    units = mechanism.units
    told: list[str] = []
    if link.ends is not None and link.length is not None:
        told.append(f"{_line_name(*link.ends)} = {_format_amount(float(link.length), 'length', units)}")
    size = parse_unit(units.length)
    placed = [point for point in link.points if isinstance(point.place, At)]
    if placed and (link.name == mechanism.frame or len(link.names) > 1):
        spots = [
            f"{point.name} ({', '.join(_format_signed(size.from_si(float(each))) for each in point.place)})"
            for point in placed
        ]
        told.append(f"{', '.join(spots)} {units.length}")
    for point in link.points:
        place = point.place
        if isinstance(place, Along):
            way = f"{_line_name(place.start, place.towards)}"
            back = " produced back" if float(place.distance) < 0.0 else ""
            whole = link.length if link.ends and {place.start, place.towards} == set(link.ends) else None
            if whole is not None and not float(place.angle) and float(place.distance) > float(whole) * (1.0 + 1e-9):
                back = " produced"
            turned = _format_amount(float(place.angle), "angle", units) if float(place.angle) else ""
            where = f", at {turned} from {way}{back}" if turned else f" on {way}{back}"
            away = _format_amount(abs(float(place.distance)), "length", units)
            told.append(f"{point.name}{where}, {_line_name(place.start, point.name)} = {away}")
        elif isinstance(place, Offset):
            line = _line_name(place.start, place.towards)
            along, across = (
                _format_amount(abs(float(size)), "length", units) for size in (place.distance, place.offset)
            )
            back = " produced back" if float(place.distance) < 0.0 else ""
            side = "right" if float(place.offset) < 0.0 else "left"
            told.append(f"{point.name}: {along} from {place.start} along {line}{back}, {across} to the {side} of it")
        elif isinstance(place, Distances):
            lengths = [
                f"{_line_name(end, point.name)} = {_format_amount(float(each), 'length', units)}"
                for end, each in ((place.first, place.from_first), (place.second, place.from_second))
            ]
            side = "left" if place.left else "right"
            told.append(f"{point.name}: {', '.join(lengths)}, to the {side} from {place.first} to {place.second}")
    if told:
        what = "Fixed link" if link.name == mechanism.frame else "Link"
        yield (f"{what} {link.name}: {'; '.join(told)}.",)


def _format_signed(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("-", "−")


def _line_name(p: str, q: str) -> str:
    return p + q if max(len(p), len(q)) <= 2 else f"{p}-{q}"


def _input_phrase(mechanism: Mechanism, pair: Pair, driven: InputState) -> Phrase:
    """An input with its rates and their senses."""
    position, velocity, acceleration = driven
    at = _format_amount(position, "length" if pair.input_kind is MeasureKind.LENGTH else "angle", mechanism.units)
    first, second = pair.links
    if pair.input_kind is MeasureKind.LENGTH:
        return (
            f"Input at {pair.name}: {at}; ",
            *_sliding_phrase(second, first, velocity, acceleration, mechanism.units),
            ".",
        )
    moves = second if first == mechanism.frame else first if second == mechanism.frame else f"{second} against {first}"
    if not velocity and not acceleration:
        return (f"Input at {pair.name}: {at}; {moves} is held.",)
    uniformly = "uniformly " if velocity and not acceleration else ""
    found: Phrase = (
        f"Input at {pair.name}: {at}; {moves} turns {uniformly}",
        *_turning_phrase(velocity, mechanism.units),
    )
    if acceleration:
        how = "speeds up" if velocity * acceleration > 0.0 else "slows down" if velocity else "begins to turn"
        found = (
            *found,
            f" and {how} at ",
            *_angular_phrase(abs(acceleration), "angular acceleration", mechanism.units),
            "" if velocity else f" {turning_sense(acceleration)}",
        )
    return (*found, ".")


def _sliding_phrase(second: str, first: str, velocity: float, acceleration: float, units: FileUnits) -> Phrase:
    if not velocity and not acceleration:
        return (f"{second} is held on {first}",)
    found: Phrase = (f"{second} slides on {first} at ", _rate_value(velocity, "velocity", units), " along the line")
    if not acceleration:
        return (*found, ", uniformly")
    return (*found, ", with an acceleration of ", _rate_value(acceleration, "acceleration", units))


def _rate_value(value: float, kind: str, units: FileUnits) -> MeasuredValue:
    name, of = unit_of_kind(kind, units)
    return MeasuredValue(value, name, units_per_si=of.from_si(1.0))


def _turning_phrase(velocity: float, units: FileUnits) -> Phrase:
    if not velocity:
        return ("not yet",)
    return (f"{turning_sense(velocity)} at ", *_angular_phrase(abs(velocity), "angular velocity", units))


def _angular_phrase(value: float, kind: str, units: FileUnits) -> Phrase:
    """An angular rate in the unit that the file declares, and in radians, in which formulas go on."""
    told, plain = _rate_value(value, kind, units), MeasuredValue(value, SI_UNITS[kind])
    return (told,) if told == plain else (told, " = ", plain)
