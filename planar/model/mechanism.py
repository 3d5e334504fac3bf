"""A mechanism as immutable data, in SI units: links, pairs, inputs, what acts on it, sketch, what was published."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from math import isfinite, pi
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.foundation.argument_types import checked_arguments
from planar.foundation.errors import BadInput, first_unprintable, join_names
from planar.foundation.geometry import Vector
from planar.foundation.notebook_display import Displayable
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, rate_length
from planar.model.link_shapes import Along, At, Distances, Link, LinkShape, Offset, Point, PointDefinition
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.pairs.base import MeasureKind, Pair
from planar.model.revision import Revisable

if TYPE_CHECKING:
    from planar.model.input_laws import InputLaw
    from planar.model.motors import Motor
    from planar.model.stops import Stops
    from planar.model.tolerances.tolerances import Tolerances

__all__ = [
    "PUBLISHED_QUANTITIES",
    "Along",
    "At",
    "Course",
    "CurvedSlot",
    "Distances",
    "Drive",
    "Input",
    "Link",
    "Load",
    "Mass",
    "Mechanism",
    "NamedPoint",
    "Offset",
    "Point",
    "PointDefinition",
    "PublishedValue",
    "Spring",
    "Stops",
    "check_mechanism",
    "curved_slots",
    "find_law_problem",
    "find_slot_problem",
    "has_input_rates",
    "links_counting_turns",
    "named_points",
    "pair_entries",
    "pair_misfits",
    "relative_motions",
    "replace_inputs",
    "running_input_index",
    "slot_centres",
    "unit_input_rate",
    "unit_rate_note",
    "with_unit_rate",
]


PUBLISHED_QUANTITIES = {
    "position": "length",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "centripetal acceleration": "acceleration",
    "tangential acceleration": "acceleration",
    "Coriolis acceleration": "acceleration",
    "angular velocity": "angular velocity",
    "angular acceleration": "angular acceleration",
    "rubbing speed": "velocity",
    "displacement": "length",
    "sliding velocity": "velocity",
    "sliding acceleration": "acceleration",
    "input torque": "torque",
}
"""What a published value may be of, and what it is measured in."""


FRAME_NUMBERS = ("first", "last")
"""Where the frame is in the numbering of the links."""
LARGEST_NUMBER = 10**100
"""SI; beyond it squares, and squares of squares, overflow."""
SMALLEST_NUMBER = 1e-100
"""SI; a number that is not 0 is no smaller, or its square is none."""
LARGEST_INPUT_POSITION = 1e4
"""rad or m: to where a law leads an input and the backends of a sweep follow it, and how far out `pinned` takes pins.

These follow the input sample by sample all the way, so that work and rounding grow with it. An angle that only stands
somewhere, or that runs at a steady pace (`solve`, `cycle`, the general path of a sweep), counts whole turns: see
`LARGEST_COUNTED_ANGLE`."""
LARGEST_COUNTED_ANGLE = 1e12
"""rad: how far an angle may count; beyond it rounding leaves less than three digits of where it points."""


@checked_arguments
class Input(NamedTuple):
    """A relative motion that is given: at a turning pair an angle, at a sliding pair a distance (rad or m, per s).

    With a law it moves in time: from `position` on, and where the law goes on at a speed, from `velocity`. With a motor
    a simulation moves it by what that supplies.
    """

    pair: str
    position: float
    velocity: float = 0.0
    acceleration: float = 0.0
    law: InputLaw | None = None
    motor: Motor | None = None


@checked_arguments
class Drive(NamedTuple):
    """What an input is changed to for one published quantity; None leaves it as it is."""

    pair: str
    position: float | None = None
    velocity: float | None = None
    acceleration: float | None = None


@checked_arguments
class PublishedValue(NamedTuple):
    """A value that a book prints for a quantity of this mechanism (SI), or None where it prints none.

    `tolerance` is the part of the exact value by which a drawing may be off; `slip` says why a printed value
    is wrong; `inputs` are changed inputs, and `start` those of the position that a displacement is measured from.
    """

    symbol: str
    quantity: str
    of: str
    value: float | None = None
    tolerance: float = 0.02
    relative_to: str | None = None
    component: str | None = None
    sense: str | None = None
    case: str | None = None
    note: str | None = None
    slip: str | None = None
    inputs: tuple[Drive, ...] = ()
    start: tuple[Drive, ...] = ()


@dataclass(frozen=True)
class Mechanism(Displayable, Revisable):
    """Links joined by pairs, one of them the frame.

    `pairs` are binary: a pin of n links is n - 1 of them. `gravity` is an acceleration (m/s^2), `stops` are those of
    pairs. `closes_within` is the misfit (m) up to which the pairs of a redundant linkage may stay open,
    `pair_stiffness` by pair what resists it (N/m), `tolerances` how far numbers may be off. `frame_number` says whether
    the frame is the "first" or the "last" of the links when they are numbered. `remarks` are what the reader of the
    file has to say.
    """

    name: str
    frame: str
    links: tuple[Link, ...]
    pairs: tuple[Pair, ...]
    inputs: tuple[Input, ...] = ()
    loads: tuple[Load, ...] = ()
    springs: tuple[Spring, ...] = ()
    masses: tuple[Mass, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)
    stops: tuple[Stops, ...] = ()
    sketch: tuple[tuple[str, float, float], ...] = ()
    units: FileUnits = field(default_factory=FileUnits)
    ids: tuple[str, ...] = ()
    about: str | None = None
    source: str | None = None
    geometry: str | None = None
    notes: tuple[str, ...] = ()
    published: tuple[PublishedValue, ...] = ()
    remarks: tuple[str, ...] = ()
    closes_within: float | None = None
    pair_stiffness: tuple[tuple[str, float], ...] = ()
    tolerances: Tolerances | None = None
    frame_number: str = "last"

    def __repr__(self) -> str:
        driven = f", driven at {', '.join(given.pair for given in self.inputs)}" if self.inputs else ""
        return f"<Mechanism {self.name!r}: {len(self.links)} links, {len(self.pairs)} pairs{driven}>"

    def __hash__(self) -> int:
        found = self.__dict__.get("_hash")
        if found is None:
            found = hash(tuple(getattr(self, each.name) for each in fields(self)))
            object.__setattr__(self, "_hash", found)
        return found

    def with_inputs(self, inputs: tuple[Input, ...]) -> Mechanism:
        """The same mechanism with other inputs: `replace` takes several times as long."""
        there = object.__new__(type(self))
        there.__dict__.update(self.__getstate__(), inputs=inputs)
        return there

    def __getstate__(self) -> dict[str, Any]:
        """Without what was worked out from it, as the hash, which another process would not share."""
        return {name: value for name, value in self.__dict__.items() if name[0] != "_"}


class NamedPoint(NamedTuple):
    """A point under the name that results give it, and the (link, point) that lie there."""

    name: str
    members: tuple[tuple[str, str], ...]


class CurvedSlot(NamedTuple):
    """A curved slot for which a link stands: the pair at its centre joins that link with the one that has the slot."""

    link: str
    carrier: str
    pair: Pair
    pin: str
    "the point of the link that slides in the slot"

    def angles(self, mechanism: Mechanism) -> tuple[float, float] | None:
        """The directions (rad) of the ends of the slot from its centre in the axes of its carrier, by the stops.

        None without two stops less than a turn apart: the slot is a whole ring.
        """
        low, high = next(((s.low, s.high) for s in mechanism.stops if s.pair == self.pair.name), (None, None))
        if low is None or high is None or high - low >= 2.0 * pi:
            return None
        first, second = self.pair.links
        moving = first if second == mechanism.frame else second
        return (low, high) if moving == self.link else (-high, -low)


def replace_inputs(mechanism: Mechanism, drives: tuple[Drive, ...]) -> Mechanism:
    """The same mechanism with some of its inputs changed; their laws start from there.

    Raises BadInput where it has no such input.
    """
    if not drives:
        return mechanism
    for drive in drives:
        for value in drive[1:]:
            if value is not None and (isinstance(value, bool) or not isinstance(value, Real) or not isfinite(value)):
                raise BadInput(drive.pair, f"an input moves to a finite number (rad or m), not {value!r:.60}")
            if value is not None and abs(value) > LARGEST_COUNTED_ANGLE:
                raise BadInput(drive.pair, f"an input moves to {LARGEST_COUNTED_ANGLE:g} rad or m at most")
    changes = {drive.pair: drive for drive in drives}
    for pair in changes.keys() - {given.pair for given in mechanism.inputs}:
        known = ", ".join(given.pair for given in mechanism.inputs) or "none"
        raise BadInput(pair, f"there is no input at {pair!r}; the inputs are at {known}")

    def changed(given: Input) -> Input:
        drive = changes.get(given.pair)
        if drive is None:
            return given
        old = given.position, given.velocity, given.acceleration
        position, velocity, acceleration = (
            now if new is None else new for now, new in zip(old, drive[1:], strict=True)
        )
        law = given.law and given.law.start_at(position, velocity)
        return given._replace(position=position, velocity=velocity, acceleration=acceleration, law=law)

    return mechanism.with_inputs(tuple(map(changed, mechanism.inputs)))


def has_input_rates(mechanism: Mechanism) -> bool:
    """Whether an input has a velocity, an acceleration or a law."""
    return any(driven.velocity or driven.acceleration or driven.law is not None for driven in mechanism.inputs)


def unit_input_rate(mechanism: Mechanism, pair: str) -> float:
    """The unit rate of the input at a pair: 1 rad/s, or the length of the file's rates (`rate_length`) per second."""
    slides = relative_motions(mechanism)[pair].input_kind is MeasureKind.LENGTH
    return rate_length(mechanism.units)[1].to_si(1.0) if slides else 1.0


def unit_rate_note(mechanism: Mechanism, pair: str) -> str:
    """The sentence which says that velocities and accelerations are those at the unit rate of an input."""
    slides = relative_motions(mechanism)[pair].input_kind is MeasureKind.LENGTH
    rate = f"1 {rate_length(mechanism.units)[0]}/s" if slides else "1 rad/s"
    return f"the file gives no velocity: velocities and accelerations are for {rate} at the input {pair}"


def with_unit_rate(mechanism: Mechanism, pair: str | None = None) -> Mechanism:
    """The same mechanism with one input at its unit rate where no input has a rate, else the mechanism itself.

    `pair` names the input, by default the first. The remarks of the result say so. Raises BadInput for an input that
    the mechanism does not have.
    """
    if not mechanism.inputs or has_input_rates(mechanism):
        return mechanism
    name = mechanism.inputs[0 if pair is None else running_input_index(mechanism, pair)].pair
    moving = replace_inputs(mechanism, (Drive(name, velocity=unit_input_rate(mechanism, name)),))
    return replace(moving, remarks=(*moving.remarks, unit_rate_note(mechanism, name)))


def running_input_index(mechanism: Mechanism, pair: str | None, place: str | None = None) -> int:
    """Which of the inputs runs while the others stand still; `pair` names it where there are several.

    Raises BadInput, at `place`, where there is no such input, or several of which none is named.
    """
    names = [given.pair for given in mechanism.inputs]
    if not names:
        raise BadInput(place or "inputs", "the mechanism has no input that could run")
    if pair is None and len(names) > 1:
        raise BadInput(place or "inputs", f"there are several inputs, {', '.join(names)}; name the one that runs")
    if pair is not None and pair not in names:
        raise BadInput(place or pair, f"there is no input at {pair!r}; inputs are at {join_names(names)}")
    return 0 if pair is None else names.index(pair)


def check_mechanism(mechanism: Mechanism) -> None:
    """Refuse a mechanism made in Python that names what it does not have. Raises BadInput.

    What comes from a file has been checked at its place there.
    """
    points = {link.name: set(link.names) for link in mechanism.links}
    names = (*points, *(name for link in mechanism.links for name in link.names), *(p.name for p in mechanism.pairs))
    for name in names:
        if first_unprintable(name):
            raise BadInput(name, f"the name {name!r} holds a character that cannot be shown")
    if mechanism.frame_number not in FRAME_NUMBERS:
        raise BadInput(
            "frame_number", f"write {' or '.join(map(repr, FRAME_NUMBERS))}, not {mechanism.frame_number!r:.40}"
        )
    if mechanism.frame not in points:
        raise BadInput("frame", f"there is no link {mechanism.frame!r} to be the frame; links are {join_names(points)}")
    for pair in mechanism.pairs:
        for link in pair.bodies:
            if link not in points:
                raise BadInput(pair.name, f"there is no link {link!r}; links are {join_names(points)}")
        rides = pair.point_on_line()
        for link, point in (*pair.coincident_points(), *((rides[0],) if rides else ())):
            if point not in points[link]:
                raise BadInput(
                    pair.name,
                    f"link {link!r} has no point {point!r}; its points are {join_names(sorted(points[link]))}",
                )
    named = relative_motions(mechanism)
    for given in mechanism.inputs:
        if given.pair not in named:
            raise BadInput(given.pair, f"there is no pair {given.pair!r} to be driven; pairs are {join_names(named)}")
    _check_stops_and_motors(mechanism, named)
    wrong = find_slot_problem(mechanism) or find_law_problem(mechanism)
    if wrong:
        raise BadInput(*wrong)


def _check_stops_and_motors(mechanism: Mechanism, named: Mapping[str, Pair]) -> None:
    for given in mechanism.inputs:
        unfit = given.motor and given.motor.find_problem()
        if unfit:
            raise BadInput(f"{given.pair}.motor.{unfit[0]}", unfit[1])
    for each in mechanism.stops:
        if each.pair not in named:
            raise BadInput(each.pair, f"there is no pair {each.pair!r} to have stops; pairs are {join_names(named)}")
        unfit = each.find_problem()
        if unfit:
            raise BadInput(f"{each.pair}.{unfit[0]}", unfit[1])


def find_law_problem(mechanism: Mechanism) -> tuple[str, str] | None:
    """The place of the first law that cannot be, and a sentence why."""
    for given in mechanism.inputs:
        wrong = given.law and given.law.find_problem()
        if wrong:
            return f"{given.pair}.law{wrong[0]}", wrong[1]
    return None


def pair_misfits(
    pairs: Sequence[Pair], shapes: Mapping[str, LinkShape], units: FileUnits
) -> Iterator[tuple[Pair, str]]:
    """Pairs that do not go with the others, each with a sentence."""
    every = tuple(pairs)
    for pair in every:
        wrong = pair.find_misfit(
            every, shapes, lambda value: f"{parse_unit(units.length).from_si(value):.6g} {units.length}"
        )
        if wrong is not None:
            yield pair, wrong


def links_counting_turns(mechanism: Mechanism) -> frozenset[str]:
    """The links whose angles count turns."""
    return frozenset(link for pair in mechanism.pairs if pair.counts_turns for link in pair.bodies)


def pair_entries(mechanism: Mechanism) -> tuple[tuple[Pair, ...], ...]:
    """The pairs grouped as a file's entries have them: a pin of n links is one entry of n - 1 pairs."""
    grouped: dict[str, list[Pair]] = {}
    for pair in mechanism.pairs:
        grouped.setdefault(pair.entry_name(), []).append(pair)
    return tuple(tuple(group) for group in grouped.values())


def relative_motions(mechanism: Mechanism) -> Mapping[str, Pair]:
    """Every relative motion that has a name: each pair, and at a pin of n links each two of them."""
    return {pair.name: pair for group in pair_entries(mechanism) for pair in type(group[0]).relative_motions(group)}


def curved_slots(mechanism: Mechanism) -> tuple[CurvedSlot, ...]:
    """The curved slots for which links stand; links of which `find_slot_problem` tells a problem are left out."""
    result = []
    for link in mechanism.links:
        pairs = _pins_at(mechanism, link.name, link.ends[0]) if link.curved_slot and link.ends else ()
        if len(pairs) == 1 and link.ends:
            carrier = next(name for name in pairs[0].links if name != link.name)
            result.append(CurvedSlot(link.name, carrier, pairs[0], link.ends[1]))
    return tuple(result)


def slot_centres(mechanism: Mechanism) -> frozenset[tuple[str, str]]:
    """The points (link, point) at the centres of curved slots."""
    return frozenset(member for slot in curved_slots(mechanism) for member in slot.pair.coincident_points())


def _pins_at(mechanism: Mechanism, link: str, point: str) -> tuple[Pair, ...]:
    """The pairs of the pin at a point of a link."""
    groups = (group for group in pair_entries(mechanism) if group[0].has_pin())
    return next((g for g in groups if any((link, point) in pair.coincident_points() for pair in g)), ())


def find_slot_problem(mechanism: Mechanism) -> tuple[str, str] | None:
    """The first link that cannot stand for a curved slot, and a sentence why."""
    for link in mechanism.links:
        if not link.curved_slot:
            continue
        if link.ends is None or link.points:
            message = "a link that stands for a curved slot has two 'ends' (the centre of the slot, and the pin that"
            return link.name, f"{message} slides in it), a 'length' and no other points"
        if link.name == mechanism.frame:
            return link.name, "the frame cannot stand for a curved slot; name another link as the frame"
        centre, pin = link.ends
        if len(_pins_at(mechanism, link.name, centre)) != 1:
            message = f"its first end {centre!r} is the centre of the slot; it needs a turning pair that joins"
            return link.name, f"{message} this link with the link that has the slot, and no other link"
        if not _pins_at(mechanism, link.name, pin):
            message = f"its second end {pin!r} is the pin that slides in the slot; it needs a turning pair"
            return link.name, f"{message} that joins this link with the link that has this pin"
    return None


def check_link_count(mechanism: Mechanism, maximum: int, subject: str, remedy: str) -> None:
    """Raise BadInput where a mechanism has more links than `subject` can be computed of; `remedy` says what to do."""
    count = len(mechanism.links)
    if count > maximum:
        raise BadInput("links", f"{subject} of {count:,} links would take minutes; {remedy}")


def named_points(mechanism: Mechanism) -> tuple[NamedPoint, ...]:
    """Every point under its result name.

    Points that a pair keeps together stand once under the pair's name; any other under its own name where that
    is unique, else as `link.point`.
    """
    together: dict[tuple[str, str], str] = {}
    for pair in mechanism.pairs:
        for member in pair.coincident_points():
            together[member] = pair.entry_name()
    carried = dict.fromkeys((link.name, point) for link in mechanism.links for point in link.names)
    names = set(together.values())
    alone = Counter(point for link, point in carried if (link, point) not in together)
    grouped: dict[str, list[tuple[str, str]]] = {}
    for link, point in carried:
        own = point if alone[point] == 1 and point not in names else f"{link}.{point}"
        grouped.setdefault(together.get((link, point), own), []).append((link, point))
    return tuple(NamedPoint(name, tuple(members)) for name, members in grouped.items())


def sketched_places(mechanism: Mechanism) -> dict[str, dict[str, Vector]]:
    """The places (m, in the frame's axes) that the sketch gives to points, by link and point."""
    members = {point.name: point.members for point in named_points(mechanism)}
    places: dict[str, dict[str, Vector]] = {}
    for name, x, y in mechanism.sketch:
        for link, point in members[name]:
            places.setdefault(link, {})[point] = Vector(x, y)
    return places


def unjoined_points(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """The points that several links carry under one name though no pair keeps them together there: a link of each.

    Of those alone that are an end of a link, or on a link without ends that one pair at most joins: a name may stand
    twice by chance.
    """
    found: dict[str, dict[str, str]] = {}
    for each in named_points(mechanism):
        for link, point in each.members:
            found.setdefault(point, {}).setdefault(each.name, link)
    joints = Counter(link for pair in mechanism.pairs for link in pair.links)
    loose = [link for link in mechanism.links if link.ends is None and joints[link.name] < 2]
    likely = {(link.name, end) for link in mechanism.links for end in link.ends or ()}
    likely |= {(link.name, point) for link in loose for point in link.names}
    return {
        point: tuple(links.values())
        for point, links in found.items()
        if len(links) > 1 and any((link, point) in likely for link in links.values())
    }
