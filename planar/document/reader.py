"""A JSON value to a Mechanism, or BadInput with the place in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from planar.document.cursor import Cursor, FileContext, describe_value
from planar.document.loads import read_loads
from planar.document.names import find_motion, find_point, point_aliases
from planar.document.schema import (
    ALONG_SCHEMA,
    DISTANCES_SCHEMA,
    FILE_SCHEMA,
    FORMAT_VERSION,
    GEOMETRY_SOURCES,
    INPUT_SCHEMA,
    LINK_SCHEMA,
    PAIR_SCHEMA,
    STOP_SCHEMA,
    UNITS_SCHEMA,
)
from planar.document.sections.published import read_published
from planar.foundation.errors import suggest_name, suggest_spelling
from planar.foundation.geometry import GROUND
from planar.foundation.units import UnitError, example_quantity
from planar.model.file_units import FileUnits, OtherKind, parse_declared_unit
from planar.model.link_shapes import (
    Along,
    At,
    Distances,
    Link,
    LinkShape,
    Offset,
    Point,
    PointDefinition,
    PointPlacementError,
    fitted_frame,
    link_shape,
)
from planar.model.mechanism import (
    FRAME_NUMBERS,
    Input,
    Mechanism,
    find_slot_problem,
    pair_entries,
    pair_misfits,
    relative_motions,
    sketched_places,
)
from planar.model.pairs import MeasureKind, Pair, pair_types


def read_mechanism(value: Any) -> Mechanism:
    """The mechanism that a JSON value describes. Raises BadInput."""
    top = Cursor(value)
    top.check_json()
    top.check_keys(*FILE_SCHEMA)
    if top["planar"].value != FORMAT_VERSION or isinstance(top["planar"].value, bool):
        raise top.error_at(
            "planar", f"the format is to be the number {FORMAT_VERSION}, not {describe_value(top['planar'].value)}"
        )
    units = read_units(top)
    top = replace(top, context=FileContext(units, "", {}))
    frame = top["frame"].as_text()
    links = {name: _read_link(name, cursor) for name, cursor in top["links"].members()}
    if frame not in links:
        raise top.error_at("frame", f"there is no link {frame!r} to be the frame{suggest_name(frame, links, 'links')}")
    full = _expand_short_forms(replace(top, context=FileContext(units, frame, links)))
    links = dict(full.context.links)
    pairs = _read_pairs(full)
    bare = Mechanism(
        name=(full["name"].as_line() if full.has("name") else "") or "mechanism",
        frame=frame,
        links=tuple(links.values()),
        pairs=pairs,
        units=units,
        ids=tuple(item.as_line() for item in full.list_items("ids")),
        about=full.text("about"),
        source=full.text("source"),
        geometry=full.choice("geometry", GEOMETRY_SOURCES),
        notes=tuple(item.as_text() for item in full.list_items("notes")),
        remarks=_unpinned_link_remarks(full, pairs),
        closes_within=full["closes_within"].as_positive("length") if full.has("closes_within") else None,
        frame_number=full.choice("frame_number", FRAME_NUMBERS) or "last",
    )
    inputs = _read_inputs(full, relative_motions(bare))
    entries = tuple(zip(full["pairs"].items(), pair_entries(bare), strict=True))
    driven = replace(bare, inputs=inputs, **_read_common_keys(entries))
    _check_links(full, driven)
    shapes = {link.name: link_shape(link) for link in bare.links}
    driven = replace(driven, remarks=(*driven.remarks, *(text for pair in bare.pairs for text in pair.remarks(shapes))))
    if any(given.law is not None for given in inputs):
        from planar.document.input_laws import speed_jump_remarks

        jumps = speed_jump_remarks(inputs, relative_motions(bare), units)
        driven = replace(driven, remarks=(*driven.remarks, *jumps))
    points = point_aliases(driven)
    complete = _completed_by_sketch(
        replace(
            driven,
            **read_loads(full, driven, points),
            sketch=_read_sketch(full, points),
            published=tuple(read_published(item, driven, points) for item in full.list_items("published")),
        ),
        entries,
        shapes,
    )
    if not full.has("tolerances"):
        return complete
    from planar.document.sections.tolerances import read_tolerances  # few files have any

    return replace(complete, tolerances=read_tolerances(full["tolerances"], complete))


def _completed_by_sketch(
    mechanism: Mechanism, entries: Sequence[tuple[Cursor, Sequence[Pair]]], shapes: Mapping[str, LinkShape]
) -> Mechanism:
    """The mechanism with what the entries of its pairs leave out and its sketch decides, and remarks that say so."""
    if not mechanism.sketch:
        return mechanism
    places = sketched_places(mechanism)
    frames = {mechanism.frame: GROUND}
    for link in places:
        frame = None if link == mechanism.frame else fitted_frame(shapes[link], places[link])
        if frame is not None:
            frames[link] = frame
    pairs, remarks = list(mechanism.pairs), list(mechanism.remarks)
    for entry, group in entries:
        for pair in group:
            completed = pair.completed_by_sketch(entry, shapes, frames, places.get(pair.links[1], {}))
            if completed is not None:
                pairs[pairs.index(pair)] = completed[0]
                remarks.append(completed[1])
    return replace(mechanism, pairs=tuple(pairs), remarks=tuple(remarks))


def _check_links(top: Cursor, mechanism: Mechanism) -> None:
    """Refuse a link that cannot stand for a curved slot, and a frame that cannot be the first link. Raises BadInput."""
    slot_problem = find_slot_problem(mechanism)
    if slot_problem:
        raise top["links"][slot_problem[0]].error_at("curved_slot", slot_problem[1])
    if not top.has("frame_number"):
        return
    from planar.model.link_graph import frame_number_problem  # few files have the key

    problem = frame_number_problem(mechanism)
    if problem:
        raise top.error_at("frame_number", problem)


def read_units(top: Cursor) -> FileUnits:
    """The units that a file declares. Raises BadInput."""
    if not top.has("units"):
        return FileUnits()
    units = top.object_at("units")
    units.check_keys(*UNITS_SCHEMA)
    found = {key: units[key].as_text() for key in UNITS_SCHEMA if units.has(key)}
    for key, text in found.items():
        kind = key.replace("_", " ")
        try:
            parse_declared_unit(kind, text)
        except UnitError as problem:
            such = example_quantity(kind).partition(" ")[2]
            more = f"; {problem}" if isinstance(problem, OtherKind) else ""
            raise units.error_at(key, f"{text!r:.70} is not a unit of {kind}, such as {such!r}{more}") from None
    return FileUnits(**found)


def _expand_short_forms(top: Cursor) -> Cursor:
    """The file with the short forms of its pairs in full."""
    links = dict(top.context.links)
    entries = [dict(item.fields()) for item in top["pairs"].items()]
    for index, entry in enumerate(entries):
        cursor = Cursor(entry, f"$.pairs[{index}]", top.context)
        bare = _own_keys(cursor)
        whole = _pair_type(bare).expand_short_form(bare)
        if whole is None:
            continue
        for name, link in whole.links.items():
            if name in links:
                told = f"this makes a link {name!r}, but there is one of that name already; write the second one as "
                told += "a link of its own, with 'links' and 'point'"
                raise cursor.error_at(None, told)
            links[name] = _read_link(name, Cursor(link, cursor.path, top.context))
        entries[index] = whole.entry | {key: entry[key] for key in STOP_SCHEMA if key in entry}
        _add_links_to_entry(whole.joining_entry, tuple(whole.links), entries)
    context = replace(top.context, links=links)
    return replace(top, value=dict(top.fields()) | {"pairs": entries}, context=context)


def _add_links_to_entry(by: dict[str, Any], links: tuple[str, ...], entries: list[dict[str, Any]]) -> None:
    """See that an entry of this type and name joins the links too."""
    keyword, name = next(iter(by.items()))
    for entry in entries:
        if entry.get(keyword) == name:
            if isinstance(entry.get("links"), list):
                entry["links"] = [*entry["links"], *links]
                if isinstance(entry.get("points"), list):
                    entry["points"] = [*entry["points"], *(name for _ in links)]
            return
    entries.append(by)


def _pair_type(entry: Cursor) -> type[Pair]:
    types = pair_types()
    found = [keyword for keyword in types if entry.has(keyword)]
    if len(found) != 1:
        wanted = ", ".join(repr(keyword) for keyword in sorted(types))
        told = "more than one" if found else "none"
        near = "" if found else next(filter(None, (suggest_spelling(key, types) for key in entry.fields())), "")
        raise entry.error_at(None, f"a pair says its type by one of the keys {wanted}; {told} is here{near}")
    return types[found[0]]


def _read_link(name: str, cursor: Cursor) -> Link:
    cursor.check_name(name)
    cursor.check_keys(*LINK_SCHEMA)
    ends, length = _read_ends(cursor)
    points: list[Point] = []
    for point, place in cursor["points"].members() if cursor.has("points") else ():
        place.check_name(point)
        if point in (ends or ()):
            raise place.error_at(None, f"{point!r} is an end of this link already; its place follows from 'length'")
        points.append(Point(point, _read_point_definition(place)))
    if ends is None and not points:
        raise cursor.error_at(None, "a link needs points: 'ends' with a 'length', or 'points'")
    axis = _read_axis(cursor, (*(ends or ()), *(point.name for point in points)))
    link = Link(name, tuple(points), ends, length, axis, cursor.flag("curved_slot"))
    try:
        link_shape(link)
    except PointPlacementError as problem:
        if problem.point is None:
            raise cursor.error_at("axis", str(problem)) from None
        raise cursor["points"].error_at(problem.point, str(problem)) from None
    return link


def _read_ends(cursor: Cursor) -> tuple[tuple[str, str] | None, float | None]:
    if not cursor.has("ends"):
        if cursor.has("length"):
            raise cursor.error_at("length", "a 'length' needs the two 'ends' that it lies between")
        return None, None
    first, second = cursor.names("ends", 2)
    if first == second:
        raise cursor.error_at("ends", f"both ends are {first!r}; a link has two different ends")
    return (first, second), cursor["length"].as_positive("length")


def _read_axis(cursor: Cursor, points: tuple[str, ...]) -> tuple[str, str] | None:
    if not cursor.has("axis"):
        return None
    if cursor.has("ends"):
        raise cursor.error_at("axis", "a link with 'ends' has its x-axis along them; leave 'axis' out")
    first, second = cursor.names("axis", 2)
    for end in (first, second):
        if end not in points:
            raise cursor.error_at(
                "axis", f"there is no point {end!r} on this link{suggest_name(end, points, 'its points')}"
            )
    if first == second:
        raise cursor.error_at("axis", "the axis needs two different points")
    return first, second


def _read_point_definition(cursor: Cursor) -> PointDefinition:
    if isinstance(cursor.value, list):
        return At(*cursor.as_vector("length"))
    if cursor.has("along"):
        cursor.check_keys(*ALONG_SCHEMA)
        start, towards = cursor.names("along", 2)
        if start == towards:
            raise cursor.error_at("along", "a direction needs two different points")
        distance = cursor.quantity("distance", "length")
        if not cursor.has("offset"):
            return Along(start, towards, distance, cursor.quantity("angle", "angle", 0.0))
        if cursor.has("angle"):
            raise cursor.error_at("offset", "a point has an 'angle' or an 'offset', not both; leave one out")
        return Offset(start, towards, distance, cursor.quantity("offset", "length"))
    cursor.check_keys(*DISTANCES_SCHEMA)
    if not cursor.has("distances"):
        raise cursor.error_at(None, "a point is [x, y], or has 'along' and 'distance', or 'distances' and a side")
    given = cursor["distances"].members()
    distances = {place.check_name(name): place.as_positive("length") for name, place in given}
    if len(distances) != 2:
        raise cursor.error_at("distances", f"distances from two points are wanted here, not {len(distances)}")
    if cursor.has("left_of") == cursor.has("right_of"):
        raise cursor.error_at(None, "a point by two distances lies either 'left_of' or 'right_of' the way between them")
    side = "left_of" if cursor.has("left_of") else "right_of"
    first, second = cursor.names(side, 2)
    if {first, second} != set(distances):
        raise cursor.error_at(side, f"the way must be between {' and '.join(distances)}, from which the distances are")
    return Distances(first, second, distances[first], distances[second], side == "left_of")


def _own_keys(entry: Cursor) -> Cursor:
    """A pair's entry with the keys of its type alone."""
    common = STOP_SCHEMA | PAIR_SCHEMA
    keys_of_type = {key: value for key, value in entry.fields().items() if key not in common}
    return replace(entry, value=keys_of_type, other_keys=tuple(common))


def _read_common_keys(entries: Sequence[tuple[Cursor, Sequence[Pair]]]) -> dict[str, Any]:
    """The mechanism's fields by the keys that the entry of any pair may have."""
    if not any(entry.has(key) for entry, _ in entries for key in STOP_SCHEMA | PAIR_SCHEMA):
        return {}
    from planar.document.common_pair_keys import read_pair_stiffness, read_stops  # few pairs have them

    stops = tuple(each for entry in entries for each in read_stops(*entry))
    return {"stops": stops, "pair_stiffness": read_pair_stiffness(entries)}


def _read_pairs(top: Cursor) -> tuple[Pair, ...]:
    found: list[Pair] = []
    named: dict[str, str] = {}
    placed: dict[tuple[str, str], str] = {}
    for entry in top["pairs"].items():
        bare = _own_keys(entry)
        group = _pair_type(bare).read(bare)
        name = group[0].entry_name()
        pinned = {member for pair in group for member in pair.coincident_points()}
        shared = [member for member in pinned if member in placed]
        if name in named or shared:
            other = named.get(name) or placed[shared[0]]
            if shared:
                raise entry.error_at(
                    None, f"{name!r} is written at {other} already; write one pair that names all links of the pin"
                )
            raise entry.error_at(None, f"there is a pair {name!r} at {other} already; give this one another name")
        named[name] = entry.path
        placed |= dict.fromkeys(pinned, entry.path)
        found += group
    _check_pair_misfits(top, found, named)
    return tuple(found)


def _check_pair_misfits(top: Cursor, pairs: list[Pair], places: Mapping[str, str]) -> None:
    """Refuse a pair that does not go with the others."""
    shapes = {name: link_shape(link) for name, link in top.context.links.items()}
    for pair, wrong in pair_misfits(pairs, shapes, top.context.units):
        raise replace(top, path=places[pair.entry_name()]).error_at(None, wrong)


def _unpinned_link_remarks(top: Cursor, pairs: tuple[Pair, ...]) -> tuple[str, ...]:
    """What is to be said of links that carry a pin's point but are not on the pin."""
    pinned: dict[str, set[tuple[str, str]]] = {}
    for pair in pairs:
        pinned.setdefault(pair.entry_name(), set()).update(pair.coincident_points())
    return tuple(
        f"link {link!r} carries a point {name!r} but is not on the pin {name!r}; if it should be, name it there"
        for name, members in pinned.items()
        for link in top.links_with_point(name)
        if members and (link, name) not in members and not any((link, name) in others for others in pinned.values())
    )


def _read_inputs(top: Cursor, known: Mapping[str, Pair]) -> tuple[Input, ...]:
    found: dict[str, Input] = {}
    for cursor in top.list_items("inputs"):
        cursor.check_keys(*INPUT_SCHEMA)
        pair = find_motion(cursor["pair"], known)
        if pair.name in found:
            raise cursor.error_at("pair", f"pair {pair.name!r} has an input already; a pair takes one")
        given = Input(
            pair.name,
            cursor.quantity("position", "length")
            if pair.input_kind is MeasureKind.LENGTH
            else cursor.counted_angle("position"),
            cursor.quantity("velocity", pair.input_quantity_kinds()[1], 0.0),
            cursor.quantity("acceleration", pair.input_quantity_kinds()[2], 0.0),
        )
        if cursor.has("law"):
            from planar.document.input_laws import read_law  # few mechanisms run by laws

            given = given._replace(law=read_law(cursor["law"], given, pair.input_quantity_kinds()))
        if cursor.has("motor"):
            from planar.document.motors import read_motor  # nor have many a motor

            given = given._replace(motor=read_motor(cursor["motor"], pair))
        found[pair.name] = given
    return tuple(found.values())


def _read_sketch(top: Cursor, points: Mapping[str, str]) -> tuple[tuple[str, float, float], ...]:
    if not top.has("sketch"):
        return ()
    found: dict[str, tuple[str, float, float]] = {}
    for name, place in top["sketch"].members():
        point = find_point(place, name, points)
        if point in found:
            raise place.error_at(None, f"the point {point!r} is sketched already, under another of its names")
        found[point] = (point, *place.as_vector("length"))
    return tuple(found.values())
