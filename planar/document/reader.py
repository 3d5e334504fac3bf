"""A JSON value to a Mechanism, or BadInput with the place in the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from planar.document.cursor import Cursor, Whole, called, did_you_mean, offered
from planar.document.loads import read_applied
from planar.document.names import motion, point_named, point_names
from planar.document.schema import (
    ALONG,
    DISTANCES,
    DRIVE,
    FORMAT,
    GEOMETRY,
    INPUT,
    LINK,
    PUBLISHED,
    SENSES,
    TOP,
    UNITS,
)
from planar.foundation.units import UnitError, unit
from planar.model.link_shapes import Unplaced, shape
from planar.model.mechanism import (
    QUANTITIES,
    Along,
    At,
    Distances,
    Drive,
    Input,
    Link,
    Mechanism,
    Place,
    Point,
    Published,
    Units,
    misfits,
    motions,
)
from planar.model.pairs import Kind, Pair, pair_types


def read(value: Any) -> Mechanism:
    """The mechanism that a JSON value describes. Raises BadInput."""
    top = Cursor(value)
    top.only_json()
    top.only(*TOP)
    if top["planar"].value != FORMAT or isinstance(top["planar"].value, bool):
        raise top.refuse("planar", f"the format is to be the number {FORMAT}, not {called(top['planar'].value)}")
    units = _units(top)
    top = replace(top, whole=Whole(units, "", {}))
    frame = top["frame"].as_text()
    links = {name: _link(name, cursor) for name, cursor in top["links"].members()}
    if frame not in links:
        raise top.refuse("frame", f"there is no link {frame!r} to be the frame{offered(frame, links, 'links')}")
    full = _written_out(replace(top, whole=Whole(units, frame, links)))
    links = dict(full.whole.links)
    pairs = _pairs(full)
    bare = Mechanism(
        name=(full["name"].as_line() if full.has("name") else "") or "mechanism",
        frame=frame,
        links=tuple(links.values()),
        pairs=pairs,
        units=units,
        ids=tuple(item.as_line() for item in full.listed("ids")),
        about=full.text("about"),
        source=full.text("source"),
        geometry=full.one_of("geometry", GEOMETRY),
        notes=tuple(item.as_text() for item in full.listed("notes")),
        remarks=_left_out(full, pairs),
    )
    inputs = _inputs(full, motions(bare))
    driven = replace(bare, inputs=inputs)
    if any(given.law is not None for given in inputs):
        from planar.document.input_laws import jumps

        driven = replace(driven, remarks=(*bare.remarks, *jumps(inputs, motions(bare))))
    points = point_names(driven)
    return replace(
        driven,
        **read_applied(full, driven, points),
        sketch=_sketch(full, points),
        published=tuple(_published(item, driven, points) for item in full.listed("published")),
    )


def _units(top: Cursor) -> Units:
    if not top.has("units"):
        return Units()
    units = top.inside("units")
    units.only(*UNITS)
    found = Units()._asdict()
    for kind in found:
        text = units[kind].as_text() if units.has(kind) else found[kind]
        try:
            fits = unit(text).kind == kind
        except UnitError:
            fits = False
        if not fits:
            such = {"length": "mm", "angle": "deg"}[kind]
            raise units.refuse(kind, f"{text!r:.70} is not a unit of {kind}, such as {such!r}")
        found[kind] = text
    return Units(**found)


def _written_out(top: Cursor) -> Cursor:
    """The file with the short forms of its pairs in full."""
    links = dict(top.whole.links)
    entries = [dict(item.fields()) for item in top["pairs"].items()]
    for index, entry in enumerate(entries):
        cursor = Cursor(entry, f"$.pairs[{index}]", top.whole)
        whole = _type(cursor).rewrite(cursor)
        if whole is None:
            continue
        for name, link in whole.links.items():
            if name in links:
                told = f"this makes a link {name!r}, but there is one of that name already; write the second one as "
                told += "a link of its own, with 'links' and 'point'"
                raise cursor.refuse(None, told)
            links[name] = _link(name, Cursor(link, cursor.path, top.whole))
        entries[index] = whole.entry
        _join(whole.joined_by, tuple(whole.links), entries)
    whole = replace(top.whole, links=links)
    return replace(top, value=dict(top.fields()) | {"pairs": entries}, whole=whole)


def _join(by: dict[str, Any], links: tuple[str, ...], entries: list[dict[str, Any]]) -> None:
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


def _type(entry: Cursor) -> type[Pair]:
    types = pair_types()
    found = [keyword for keyword in types if entry.has(keyword)]
    if len(found) != 1:
        wanted = ", ".join(repr(keyword) for keyword in sorted(types))
        told = "more than one" if found else "none"
        near = "" if found else next(filter(None, (did_you_mean(key, types) for key in entry.fields())), "")
        raise entry.refuse(None, f"a pair says its type by one of the keys {wanted}; {told} is here{near}")
    return types[found[0]]


def _link(name: str, cursor: Cursor) -> Link:
    cursor.checked_name(name)
    cursor.only(*LINK)
    ends, length = _ends(cursor)
    points: list[Point] = []
    for point, place in cursor["points"].members() if cursor.has("points") else ():
        place.checked_name(point)
        if point in (ends or ()):
            raise place.refuse(None, f"{point!r} is an end of this link already; its place follows from 'length'")
        points.append(Point(point, _place(place)))
    if ends is None and not points:
        raise cursor.refuse(None, "a link needs points: 'ends' with a 'length', or 'points'")
    link = Link(name, tuple(points), ends, length, _axis(cursor, (*(ends or ()), *(point.name for point in points))))
    try:
        shape(link)
    except Unplaced as problem:
        if problem.point is None:
            raise cursor.refuse("axis", str(problem)) from None
        raise cursor["points"].refuse(problem.point, str(problem)) from None
    return link


def _ends(cursor: Cursor) -> tuple[tuple[str, str] | None, float | None]:
    if not cursor.has("ends"):
        if cursor.has("length"):
            raise cursor.refuse("length", "a 'length' needs the two 'ends' that it lies between")
        return None, None
    first, second = cursor.names("ends", 2)
    if first == second:
        raise cursor.refuse("ends", f"both ends are {first!r}; a link has two different ends")
    return (first, second), cursor["length"].positive("length")


def _axis(cursor: Cursor, points: tuple[str, ...]) -> tuple[str, str] | None:
    if not cursor.has("axis"):
        return None
    if cursor.has("ends"):
        raise cursor.refuse("axis", "a link with 'ends' has its x-axis along them; leave 'axis' out")
    first, second = cursor.names("axis", 2)
    for end in (first, second):
        if end not in points:
            raise cursor.refuse("axis", f"there is no point {end!r} on this link{offered(end, points, 'its points')}")
    if first == second:
        raise cursor.refuse("axis", "the axis needs two different points")
    return first, second


def _place(cursor: Cursor) -> Place:
    if isinstance(cursor.value, list):
        return At(*cursor.as_vector("length"))
    if cursor.has("along"):
        cursor.only(*ALONG)
        start, towards = cursor.names("along", 2)
        if start == towards:
            raise cursor.refuse("along", "a direction needs two different points")
        return Along(start, towards, cursor.quantity("distance", "length"), cursor.quantity("angle", "angle", 0.0))
    cursor.only(*DISTANCES)
    if not cursor.has("distances"):
        raise cursor.refuse(None, "a point is [x, y], or has 'along' and 'distance', or 'distances' and a side")
    given = cursor["distances"].members()
    distances = {place.checked_name(name): place.positive("length") for name, place in given}
    if len(distances) != 2:
        raise cursor.refuse("distances", f"distances from two points are wanted here, not {len(distances)}")
    if cursor.has("left_of") == cursor.has("right_of"):
        raise cursor.refuse(None, "a point by two distances lies either 'left_of' or 'right_of' the way between them")
    side = "left_of" if cursor.has("left_of") else "right_of"
    first, second = cursor.names(side, 2)
    if {first, second} != set(distances):
        raise cursor.refuse(side, f"the way must be between {' and '.join(distances)}, from which the distances are")
    return Distances(first, second, distances[first], distances[second], side == "left_of")


def _pairs(top: Cursor) -> tuple[Pair, ...]:
    found: list[Pair] = []
    named: dict[str, str] = {}
    placed: dict[tuple[str, str], str] = {}
    for entry in top["pairs"].items():
        group = _type(entry).read(entry)
        name = group[0].entry_name()
        pinned = {member for pair in group for member in pair.coincident()}
        shared = [member for member in pinned if member in placed]
        if name in named or shared:
            other = named.get(name) or placed[shared[0]]
            if shared:
                raise entry.refuse(
                    None, f"{name!r} is written at {other} already; write one pair that names all links of the pin"
                )
            raise entry.refuse(None, f"there is a pair {name!r} at {other} already; give this one another name")
        named[name] = entry.path
        placed |= dict.fromkeys(pinned, entry.path)
        found += group
    _fitting(top, found, named)
    return tuple(found)


def _fitting(top: Cursor, pairs: list[Pair], places: Mapping[str, str]) -> None:
    """Refuse a pair that does not go with the others."""
    shapes = {name: shape(link) for name, link in top.whole.links.items()}
    for pair, wrong in misfits(pairs, shapes, top.whole.units):
        raise replace(top, path=places[pair.entry_name()]).refuse(None, wrong)


def _left_out(top: Cursor, pairs: tuple[Pair, ...]) -> tuple[str, ...]:
    """What is to be said of links that carry a pin's point but are not on the pin."""
    pinned: dict[str, set[tuple[str, str]]] = {}
    for pair in pairs:
        pinned.setdefault(pair.entry_name(), set()).update(pair.coincident())
    return tuple(
        f"link {link!r} carries a point {name!r} but is not on the pin {name!r}; if it should be, name it there"
        for name, members in pinned.items()
        for link in top.carriers(name)
        if members and (link, name) not in members and not any((link, name) in others for others in pinned.values())
    )


def _inputs(top: Cursor, known: Mapping[str, Pair]) -> tuple[Input, ...]:
    found: dict[str, Input] = {}
    for cursor in top.listed("inputs"):
        cursor.only(*INPUT)
        pair = motion(cursor["pair"], known)
        if pair.name in found:
            raise cursor.refuse("pair", f"pair {pair.name!r} has an input already; a pair takes one")
        given = Input(
            pair.name,
            cursor.quantity("position", "length") if pair.drive_kind is Kind.LENGTH else cursor.turned("position"),
            cursor.quantity("velocity", pair.driven()[1], 0.0),
            cursor.quantity("acceleration", pair.driven()[2], 0.0),
        )
        if cursor.has("law"):
            from planar.document.input_laws import read_law  # few mechanisms run by laws

            given = given._replace(law=read_law(cursor["law"], given, pair.driven()))
        found[pair.name] = given
    return tuple(found.values())


def _sketch(top: Cursor, points: Mapping[str, str]) -> tuple[tuple[str, float, float], ...]:
    if not top.has("sketch"):
        return ()
    found: dict[str, tuple[str, float, float]] = {}
    for name, place in top["sketch"].members():
        point = point_named(place, name, points)
        if point in found:
            raise place.refuse(None, f"the point {point!r} is sketched already, under another of its names")
        found[point] = (point, *place.as_vector("length"))
    return tuple(found.values())


def _drives(cursor: Cursor, key: str, mechanism: Mechanism) -> tuple[Drive, ...]:
    if not cursor.has(key):
        return ()
    known = {given.pair: motions(mechanism)[given.pair] for given in mechanism.inputs}
    found = []
    for name, drive in cursor[key].members():
        if name not in known:
            raise drive.refuse(None, f"there is no input at {name!r}{offered(name, known, 'the pairs with inputs')}")
        drive.only(*DRIVE)
        kinds = known[name].driven()
        found.append(
            Drive(
                name,
                drive.optional("position", kinds[0]),
                drive.optional("velocity", kinds[1]),
                drive.optional("acceleration", kinds[2]),
            )
        )
    return tuple(found)


def _published(cursor: Cursor, mechanism: Mechanism, points: Mapping[str, str]) -> Published:
    cursor.only(*PUBLISHED)
    quantity = cursor["quantity"].as_text()
    if quantity not in QUANTITIES:
        raise cursor.refuse("quantity", f"{quantity!r} is no quantity{did_you_mean(quantity, QUANTITIES)}")
    kind = QUANTITIES[quantity]
    of, relative_to = cursor["of"].as_text(), cursor.text("relative_to")
    if quantity.startswith("angular"):
        of = cursor["of"].as_link()
    elif quantity in ("rubbing speed", "displacement", "sliding velocity", "sliding acceleration", "input torque"):
        of = motion(cursor["of"], motions(mechanism)).name
    else:
        of = point_named(cursor["of"], of, points)
        if relative_to is not None:
            relative_to = point_named(cursor["relative_to"], relative_to, points)
    return Published(
        symbol=cursor["symbol"].as_line(),
        quantity=quantity,
        of=of,
        value=cursor.optional("value", kind) if cursor.has("value") and cursor["value"].value is not None else None,
        tolerance=_tolerance(cursor),
        relative_to=relative_to,
        component=cursor.one_of("component", ("x", "y")),
        sense=cursor.one_of("sense", SENSES),
        case=cursor["case"].as_line() if cursor.has("case") else None,
        note=cursor.text("note"),
        slip=cursor.text("slip"),
        inputs=_drives(cursor, "inputs", mechanism),
        start=_drives(cursor, "from", mechanism),
    )


def _tolerance(cursor: Cursor) -> float:
    if not cursor.has("tolerance"):
        return Published._field_defaults["tolerance"]
    found = cursor["tolerance"].as_number()
    if not 0.0 <= found < 1e100:
        raise cursor.refuse("tolerance", f"a number from zero on is wanted here, not {found!r}")
    return found
