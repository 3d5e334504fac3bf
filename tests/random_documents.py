"""Documents of mechanisms drawn at random, and what remains of them when they are mutilated."""

from __future__ import annotations

import copy
from collections.abc import Callable
from math import inf, nan
from typing import Any

from hypothesis import strategies as st

from planar.document.schema import schema
from planar.model.pairs import pair_types
from tests.documents import (
    EXAMPLES,
)

NAMES = st.text(st.characters(exclude_categories=("C", "Z"), exclude_characters=".:,"), min_size=1, max_size=6)

LENGTHS = st.floats(1e-3, 1e3)

SIGNED = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-90 else 0.0)  # no length is smaller, in any unit
SPELLED = {
    "length": st.one_of(
        SIGNED, st.integers(-99, 99), SIGNED.map(lambda x: f"{x!r} in"), SIGNED.map(lambda x: f"{x}mm")
    ),
    "angle": st.one_of(
        SIGNED, st.integers(-360, 360), SIGNED.map(lambda x: f"{x!r}°"), SIGNED.map(lambda x: f"{x} rad")
    ),
    "angular velocity": st.one_of(SIGNED.map(lambda x: f"{x!r} rpm"), SIGNED.map(lambda x: f"{x!r} deg/s"), st.just(0)),
    "angular acceleration": st.one_of(SIGNED.map(lambda x: f"{x!r} rad/s²"), SIGNED.map(lambda x: f"{x!r} deg/s^2")),
    "velocity": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} mm/s"), SIGNED.map(lambda x: f"{x!r} km/h")),
    "acceleration": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} m s^-2")),
    "force": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} kN"), SIGNED.map(lambda x: f"{x!r} lbf")),
    "torque": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} N m")),
    "time": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} ms")),
    "mass": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} g"), LENGTHS.map(lambda x: f"{x!r} lb")),
    "moment of inertia": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} g cm^2")),
    "stiffness": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N/mm")),
    "damping": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N s/mm")),
    "torsional stiffness": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N m/deg")),
    "torsional damping": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N m s/rad")),
}

UNITS = st.fixed_dictionaries(
    {},
    optional={
        "length": st.sampled_from(["mm", "m", "in", "ft", "cm", "µm"]),
        "angle": st.sampled_from(["deg", "rad", "°", "turn", "grad"]),
    },
)


@st.composite
def a_link(draw: Any, points: list[str]) -> Any:
    """A link that carries the points, by ends or by coordinates, and one more point of any kind."""
    own: dict[str, Any] = {}
    if len(points) > 1 and draw(st.booleans()):
        first, second, *rest = points
        length = draw(LENGTHS)
        for name in rest:
            own[name] = {"along": [first, second], "distance": draw(SPELLED["length"]), "angle": draw(SPELLED["angle"])}
        side = draw(st.sampled_from(["left_of", "right_of"]))
        apex = length * draw(st.floats(0.6, 2.0))
        own["apex"] = {"distances": {second: apex, first: apex}, side: draw(st.permutations([first, second]))}
        return {"ends": [first, second], "length": length, "points": own}
    places = draw(st.lists(st.tuples(st.integers(-99, 99), SIGNED), min_size=len(points), max_size=len(points)))
    link = {"points": dict(zip(points, map(list, places), strict=True))}
    if len(points) > 1 and places[0] != places[1] and draw(st.booleans()):
        link["axis"] = points[:2]
    link["points"]["mark"] = [draw(SPELLED["length"]), draw(SPELLED["length"])]
    return link


@st.composite
def a_train(draw: Any, k: int) -> Any:
    """Links and pairs: an arm, two wheels that it carries, and what ties their turning."""
    arm, one, two = f"arm {k}", f"wheel {k}", f"wheel {k}'"
    r, s = draw(st.integers(30, 99)), draw(st.integers(1, 29))
    keyword, by = draw(st.sampled_from(["gear", "belt", "chain"])), draw(st.sampled_from(["radii", "teeth", "ratio"]))
    tie: dict[str, Any] = {keyword: f"W{k}", "links": [one, two], "carrier": arm, by: [r, s]}
    if by == "ratio":
        tie["ratio"] = draw(st.sampled_from([-1, 1])) * draw(LENGTHS)
    elif draw(st.booleans()):
        tie |= {by: [-r, s]} if keyword == "gear" else {"crossed": True}
    if draw(st.booleans()):
        tie["mesh"] = {one: draw(SPELLED["angle"]), two: draw(SPELLED["angle"])}
    apart = abs(sum(tie[by])) if keyword == "gear" and by != "ratio" else 200
    links = {arm: {"points": {f"U{k}": [0, 0], f"V{k}": [apart, 0]}}}
    links |= {wheel: {"points": {f"{pin}{k}": [0, 0]}} for wheel, pin in ((one, "U"), (two, "V"))}
    return links, [{"turning": f"U{k}"}, {"turning": f"V{k}"}, tie]


@st.composite
def a_course(draw: Any, driven: list[tuple[str, str]]) -> Any:
    """How a load varies, with an input or with time."""
    at = draw(st.lists(st.integers(-400, 400), min_size=2, max_size=5).map(sorted).filter(lambda at: at[0] < at[-1]))
    factors = draw(st.lists(SIGNED, min_size=len(at), max_size=len(at)))
    pair = draw(st.sampled_from([None, *(pair for pair, _ in driven)]))
    return {"at": at, "factors": factors} | ({} if pair is None else {"with": pair})


@st.composite
def applied(draw: Any, points: list[str], links: list[str], pairs: list[tuple[str, str]], driven: Any) -> Any:
    """Loads of every kind, springs and masses, beside points, links and relative motions with their kinds."""

    def some(*kinds: Any) -> Any:
        return draw(st.lists(st.one_of(*kinds), max_size=4))

    def spelled(**keys: str) -> dict[str, Any]:
        return {key: SPELLED[kind] for key, kind in keys.items()}

    varies, one = {"varies": a_course(driven)}, st.sampled_from(links)
    force = st.tuples(SPELLED["force"], SPELLED["force"]).map(list)
    kinds = [
        st.fixed_dictionaries({"point": st.sampled_from(points), "force": force}, optional=varies | {"axes": one}),
        st.fixed_dictionaries({"link": one} | spelled(torque="torque"), optional=varies),
    ]
    for pair, kind in pairs:
        effort = {"length": "force", "angle": "torque"}[kind]
        kinds.append(st.fixed_dictionaries({"pair": st.just(pair), effort: SPELLED[effort]}, optional=varies))
    two = st.lists(one, min_size=2, max_size=2, unique=True)
    springs = [
        st.fixed_dictionaries(
            {"links": two} | spelled(stiffness="torsional stiffness"),
            optional=spelled(damping="torsional damping", free_angle="angle"),
        )
    ]
    if len(points) > 1:
        ends = st.lists(st.sampled_from(points), min_size=2, max_size=2, unique=True)
        optional = spelled(stiffness="stiffness") | {"free_length": LENGTHS}
        springs.append(st.fixed_dictionaries({"points": ends} | spelled(damping="damping"), optional=optional))
    place = st.tuples(SPELLED["length"], SPELLED["length"]).map(list)
    mass = st.fixed_dictionaries(
        {"link": one, "at": place} | spelled(mass="mass"), optional=spelled(inertia="moment of inertia")
    )
    found = {"loads": some(*kinds), "springs": some(*springs), "masses": some(mass)}
    return found | ({"gravity": [0, draw(SPELLED["acceleration"])]} if draw(st.booleans()) else {})


@st.composite
def documents(draw: Any) -> Any:
    """The JSON value of some mechanism: a tree of links, with pins of several links, slides, blocks, slots, racks,
    trains of wheels, inputs, loads, springs, masses.
    """
    names = draw(st.lists(NAMES, min_size=2, max_size=6, unique=True))
    carried: dict[str, list[str]] = {name: [] for name in names}
    pairs: list[dict[str, Any]] = []
    motions_of: list[tuple[str, str]] = []
    for k, name in enumerate(names[1:], 1):
        pin = f"P{k}"
        joined = [names[draw(st.integers(0, k - 1))], name]
        if k > 1 and draw(st.booleans()):
            joined += [draw(st.sampled_from([other for other in names[:k] if other not in joined] or [None]))]
            joined = [link for link in joined if link is not None]
        told: dict[str, Any] = {"turning": pin}
        if draw(st.booleans()):
            joined = draw(st.permutations(joined))
            told["links"] = joined
            if draw(st.booleans()):
                points = [f"{pin}{letter}" for letter, _ in zip("abc", joined, strict=False)]
                told["points"] = points
        for link, point in zip(joined, told.get("points", [pin] * len(joined)), strict=True):
            carried[link].append(point)
        size = draw(st.sampled_from([None, "pin_radius", "pin_diameter"]))
        if size:
            told[size] = draw(LENGTHS)
        pairs.append(told)
        if "links" in told or len(joined) == 2:
            motions_of.append((pin if len(joined) == 2 else f"{pin}:{joined[0]},{joined[-1]}", "angle"))
    links = {name: draw(a_link(carried[name])) for name in names}
    for k in range(draw(st.integers(0, 2))):
        first, second = draw(st.permutations(names))[:2]
        angle = draw(st.sampled_from([{}, {"angle": draw(SPELLED["angle"])}]))
        through = draw(st.sampled_from([*links[first]["points"], [draw(SPELLED["length"]), draw(SPELLED["length"])]]))
        how = draw(st.sampled_from(["sliding", "block", "slot", "rack"]))
        told = {"sliding" if how == "block" else how: f"S{k}", "line": {"through": through} | angle}
        if how == "block":
            links[second]["points"][f"B{k}"] = [draw(SPELLED["length"]), 0]
            told |= {"on": first, "block": f"B{k}"}
        else:
            told |= {"links": [first, second], "point": draw(st.sampled_from(list(links[second]["points"])))}
        if how == "rack":
            told |= {"radius": draw(LENGTHS), "mesh": {"displacement": draw(SPELLED["length"]), "angle": 5}}
        elif how != "slot":
            told["turn"] = draw(SPELLED["angle"])
        pairs.append(told)
        motions_of.append((f"S{k}", "length"))
    for k in range(draw(st.integers(0, 2))):
        more, tied = draw(a_train(k))
        links |= more
        pairs += tied
        motions_of.append((f"W{k}", "angle"))
    driven = draw(st.lists(st.sampled_from(motions_of), unique=True, max_size=3)) if motions_of else []
    rates = {"angle": ("angular velocity", "angular acceleration"), "length": ("velocity", "acceleration")}
    value = {
        "planar": 1,
        "name": draw(st.sampled_from(["one", "Träger", "[b]bold[/b]"])),
        "units": draw(UNITS),
        "frame": draw(st.sampled_from(names)),
        "links": links,
        "pairs": pairs,
        "inputs": [
            {"pair": pair, "position": draw(SPELLED[kind])}
            | {"velocity": draw(SPELLED[rates[kind][0]]), "acceleration": draw(SPELLED[rates[kind][1]])}
            for pair, kind in driven
        ],
        **draw(applied([f"{name}.{carried[name][0]}" for name in names[:1]], names, motions_of, driven)),
        "sketch": {f"{names[0]}.{carried[names[0]][0]}": [draw(SPELLED["length"]), draw(SPELLED["length"])]},
        "published": [
            {"symbol": "v", "quantity": "velocity", "of": f"{names[1]}.{carried[names[1]][0]}", "value": None}
            | {"relative_to": f"{names[0]}.{carried[names[0]][0]}"},
            {"symbol": "w", "quantity": "angular velocity", "of": names[1], "value": draw(SPELLED["angular velocity"])}
            | {"inputs": {pair: {"position": draw(SPELLED[kind])} for pair, kind in driven}, "tolerance": 0.01},
        ],
        "notes": ["a note"],
    }
    if value["published"][1]["value"] == 0:
        del value["published"][1]
    return value


def keys_of(part: Any) -> set[str]:
    """Every key that a schema lets an object have."""
    if isinstance(part, list):
        return set().union(*map(keys_of, part))
    if not isinstance(part, dict):
        return set()
    return set(part.get("properties", ())).union(*map(keys_of, part.values()))


SAID = {word for text in EXAMPLES.values() for word in text.split('"')[1::2]}

WORDS = sorted(SAID | keys_of(schema()) | {*pair_types(), "B:a,b", "C:"})

SCRAPS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 200),
    st.sampled_from([10**400, -(10**400), 0, 1e200, -1e200, 1e-200, 1e308, inf, -inf, nan, -0.0]),
    st.floats(),
    st.sampled_from(WORDS),
    st.sampled_from(["5 mm", "-5 mm", "60°", "1e999 m", "3 percent", "5 m^0", "5", "", " ", "rpm", "2 Hz", "block D"]),
    st.text(max_size=4),
)

PIECES = st.recursive(
    SCRAPS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(st.one_of(st.sampled_from(WORDS), st.text(max_size=3)), inner, max_size=3),
    ),
    max_leaves=6,
)


def places(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of everything in a JSON value."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [above] * bool(above) + [path for key, each in inside for path in places(each, (*above, key))]


def mutilated(value: Any, draw: Callable[..., Any]) -> Any:
    """A JSON value with something deleted, replaced, renamed or doubled."""
    path = draw(st.sampled_from(places(value)))
    place = value
    for key in path[:-1]:
        place = place[key]
    how = draw(st.sampled_from(["delete", "replace", "replace", "rename", "move"]))
    if how == "delete":
        del place[path[-1]]
    elif how == "replace" or isinstance(place, list):
        place[path[-1]] = draw(PIECES)
    elif how == "rename":
        place[draw(st.one_of(st.sampled_from(WORDS), st.text(max_size=3)))] = place.pop(path[-1])
    else:
        other = draw(st.sampled_from(places(value)))
        for key in other:
            value = value[key]
        place[path[-1]] = copy.deepcopy(value)
    return place
