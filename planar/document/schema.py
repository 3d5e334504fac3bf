"""The JSON Schema of mechanism files, and the keys that the reader knows from it.

What a schema cannot say (that a link exists, that a triangle closes, that a unit is one of length) the reader says.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planar.foundation.units import MAX_QUANTITY_LENGTH
from planar.model.loads import MAX_LAW_ITEMS
from planar.model.mechanism import FRAME_NUMBERS, LARGEST_NUMBER, PUBLISHED_QUANTITIES, SMALLEST_NUMBER
from planar.model.pairs import Pair, pair_types
from planar.model.pairs.base import Schema, described, list_schema, schema_reference

if TYPE_CHECKING:
    from planar.model.input_laws import LawSegment

FORMAT_VERSION = 1
FORBIDDEN_IN_NAMES = ".:,"
GEOMETRY_SOURCES = ("given", "recovered", "fitted", "underdetermined")
SENSE_WORDS = ("clockwise", "anticlockwise", "to the left", "to the right", "upwards", "downwards")

TEXT: Schema = {"type": "string"}
_TEXTS: Schema = {"type": "array", "items": TEXT}
_BOUNDED: Schema = {"type": "number", "exclusiveMinimum": -LARGEST_NUMBER, "exclusiveMaximum": LARGEST_NUMBER}
_FROM_ZERO: Schema = {"type": "number", "minimum": 0, "exclusiveMaximum": LARGEST_NUMBER}
ABOVE_ZERO: Schema = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": LARGEST_NUMBER}
_POSITIVE_SIZE: Schema = {"type": "number", "minimum": SMALLEST_NUMBER, "exclusiveMaximum": LARGEST_NUMBER}
_NUMBER_WITH_UNIT = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*(?![eE][+-]?[0-9])[A-Za-zµμΩ°]"
"""A number and the beginning of its unit."""


def quantity_schema(number: Schema, sign: str, such: str) -> Schema:
    text = {"type": "string", "pattern": rf"^\s*{sign}{_NUMBER_WITH_UNIT}", "maxLength": MAX_QUANTITY_LENGTH}
    return {"anyOf": [number, text], "description": f"a number in the declared unit, or a text such as {such!r}"}


def object_schema(properties: Schema, *required: str, **more: Any) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    } | more


def _named_values_schema(values: Schema, **more: Any) -> Schema:
    """An object whose keys are names."""
    return {"type": "object", "propertyNames": schema_reference("name"), "additionalProperties": values} | more


def vector_schema(kind: str) -> Schema:
    return list_schema(kind, 2, 2)


UNITS_SCHEMA: Schema = {
    "length": described(TEXT, "the unit of bare lengths, as mm; left out: m"),
    "angle": described(TEXT, "the unit of bare angles, deg or rad; left out: rad"),
    "velocity": described(TEXT, "of bare velocities, as in/s; left out, as those below: SI"),
    "acceleration": described(TEXT, "of bare accelerations and gravity, as in/s^2"),
    "jerk": described(TEXT, "in which jerks are shown, as in/s^3"),
    "angular_velocity": described(TEXT, "of bare angular velocities, as rpm or deg/s"),
    "angular_acceleration": described(TEXT, "of bare angular accelerations, as deg/s^2"),
    "angular_jerk": described(TEXT, "in which angular jerks are shown, as rad/s^3"),
    "force": described(TEXT, "of bare forces, as lbf or kN"),
    "torque": described(TEXT, "of bare torques and couples, as lbf in or N mm"),
    "mass": described(TEXT, "of bare masses, as lb, slug or g"),
    "moment_of_inertia": described(TEXT, "of bare moments of inertia, as lb in^2"),
    "stiffness": described(TEXT, "of bare stiffnesses of springs, as lbf/in or N/mm"),
    "torsional_stiffness": described(TEXT, "of bare stiffnesses of torsional springs, as lbf in/rad"),
    "damping": described(TEXT, "of bare dampings, as lbf s/in"),
    "torsional_damping": described(TEXT, "of bare dampings of torsional springs, as lbf in s/rad"),
    "stress": described(TEXT, "of bare moduli of elasticity, and of stresses in results, as psi"),
    "power": described(TEXT, "in which powers are shown, as hp or kW"),
    "energy": described(TEXT, "in which energies are shown, as ft lbf or J"),
}
ALONG_SCHEMA: Schema = {
    "along": described(
        list_schema("name", 2, 2) | {"uniqueItems": True},
        "two points of the link: the way from the first to the second",
    ),
    "distance": described(
        schema_reference("length"), "how far from the first point along that way; negative behind it"
    ),
    "angle": described(
        schema_reference("angle"),
        "by how much the way is turned about the first point, anticlockwise, as on a bell crank",
    ),
    "offset": described(
        schema_reference("length"),
        "how far it lies to the left of the line from the first point to the second, negative to the right; "
        "in place of an 'angle'",
    ),
}
DISTANCES_SCHEMA: Schema = {
    "distances": described(
        _named_values_schema(schema_reference("size"), minProperties=2, maxProperties=2),
        "how far it is from two points of the link, by their names",
    ),
    "left_of": described(
        list_schema("name", 2, 2), "it lies to the left of the way from the first of these to the second"
    ),
    "right_of": described(list_schema("name", 2, 2), "it lies to the right of the way from the first to the second"),
}
LINK_SCHEMA: Schema = {
    "ends": described(
        list_schema("name", 2, 2) | {"uniqueItems": True},
        "two points: the first is the link's origin, the second lies on its x-axis",
    ),
    "length": described(schema_reference("size"), "the distance between the ends"),
    "points": described(_named_values_schema(schema_reference("place")), "its points by their names, in its own axes"),
    "axis": described(
        list_schema("name", 2, 2) | {"uniqueItems": True},
        "two points whose direction is the link's angle, where coordinates were read off a drawing",
    ),
    "curved_slot": described(
        {"type": "boolean"},
        "true where the link stands for a curved slot: its first end is the centre of the slot, in the link that is "
        "pinned there, its second end the pin that slides in it; stops at the first end are the ends of the slot",
    ),
}
MOTOR_SCHEMA: Schema = {
    "stall": described(schema_reference("quantity"), "what it supplies at rest: a torque, at a slide a force"),
    "no_load": described(schema_reference("quantity"), "the speed at which it supplies nothing, as 3000 rpm"),
    "speeds": described(
        list_schema("quantity", 2, MAX_LAW_ITEMS), "in place of both: rising speeds, between which it is straight"
    ),
    "torques": described(list_schema("quantity", 2, MAX_LAW_ITEMS), "what it supplies at these speeds"),
    "forces": described(list_schema("quantity", 2, MAX_LAW_ITEMS), "what it supplies at these speeds, at a slide"),
}
INPUT_SCHEMA: Schema = {
    "pair": described(TEXT, "the pair that is driven; at a pin of several links as B:a,b, link b against a"),
    "position": described(
        schema_reference("quantity"),
        "the angle of the driven link at a pin on the frame, of the second against the first elsewhere; "
        "at a slide the distance along its line",
    ),
    "velocity": described(schema_reference("quantity"), "its rate, as 210 rpm or 2 m/s; left out: 0"),
    "acceleration": described(schema_reference("quantity"), "its second rate, as 60 rad/s^2; left out: 0"),
    "law": described(
        {"anyOf": [schema_reference("piece"), list_schema("piece", 1, MAX_LAW_ITEMS)]},
        "its motion in time: one piece, or a list of pieces, one after the other",
    ),
    "motor": described(
        object_schema(
            MOTOR_SCHEMA,
            oneOf=[
                {"required": ["stall", "no_load"]},
                {"required": ["speeds"], "oneOf": [{"required": ["torques"]}, {"required": ["forces"]}]},
            ],
        ),
        "the motor that drives it: a simulation runs by it, and forces tell whether it is strong enough",
    ),
}
_STOP_LIMITS: Schema = {
    "type": "array",
    "items": {"anyOf": [{"type": "null"}, schema_reference("quantity")]},
    "minItems": 2,
    "maxItems": 2,
}
STOP_SCHEMA: Schema = {
    "stops": described(
        {"anyOf": [_STOP_LIMITS, {"type": "object", "additionalProperties": _STOP_LIMITS, "minProperties": 1}]},
        "between which positions its motion can go, as [10, 95], measured as an input there; null where it is open "
        "(an angle: to the other stop's back, a turn on); "
        'at a pin of several links by their names, as {"B:a,b": [10, 95]}',
    ),
    "restitution": described(
        {"type": "number", "minimum": 0, "maximum": 1},
        "the speed after an impact on a stop beside that before it; left out: 0",
    ),
}
"""Keys of the stops that the entry of any pair may have."""
PAIR_SCHEMA: Schema = {
    "stiffness": described(
        schema_reference("amount"),
        "how stiff it is: the force by which it opens, in the declared unit or N/m, on all pairs or on none; from it "
        "forces follow where the links are held more than once",
    ),
}
"""What else the entry of any pair may have."""
DRIVE_SCHEMA: Schema = {key: INPUT_SCHEMA[key] for key in ("position", "velocity", "acceleration")}
VARIATION_SCHEMA: Schema = {
    "with": described(TEXT, "the input's pair whose position it varies with; left out: time"),
    "at": described(
        list_schema("quantity", 2, MAX_LAW_ITEMS), "rising positions or times; one that stands twice is a step"
    ),
    "factors": described(
        list_schema("number", 2, MAX_LAW_ITEMS), "by what the load is multiplied there, straight between"
    ),
}
_VARIES = described(schema_reference("varies"), "how it varies with an input's position, or with time")
PIN_POINT_NOTE: Schema = {
    "description": "at a pin: on the link that slides there, else on the first, or on the one that is named, as rod.B"
}
"""Of the name of a point where something acts."""
FORCE_SCHEMA: Schema = {
    "point": TEXT | PIN_POINT_NOTE,
    "force": described(vector_schema("quantity"), "its x and y parts, in the declared unit or N"),
    "axes": described(TEXT, "the link in whose axes the force is given, and turns; left out: the frame"),
    "varies": _VARIES,
}
TORQUE_SCHEMA: Schema = {
    "link": described(TEXT, "the link on which the torque acts"),
    "torque": described(schema_reference("quantity"), "the torque, anticlockwise, in the declared unit or N m"),
    "varies": _VARIES,
}
EFFORT_SCHEMA: Schema = {
    "pair": described(TEXT, "the pair between whose links it acts"),
    "force": described(schema_reference("quantity"), "the force at a slide, positive the way its displacement grows"),
    "torque": described(schema_reference("quantity"), "the torque at a pin or wheel, positive the way its angle grows"),
    "varies": _VARIES,
}
POINT_PAIR_SCHEMA: Schema = {
    "points": list_schema("text", 2, 2) | {"uniqueItems": True} | PIN_POINT_NOTE,
    "force": described(
        schema_reference("quantity"),
        "the force on each of the two points along the line that joins them: positive pushes them apart, negative "
        "pulls them together",
    ),
    "varies": _VARIES,
}
SPRING_SCHEMA: Schema = {
    "points": list_schema("text", 2, 2) | {"uniqueItems": True} | PIN_POINT_NOTE,
    "stiffness": described(schema_reference("amount"), "force by length, in the declared unit or N/m"),
    "free_length": described(schema_reference("amount"), "its length when nothing pulls; left out: 0"),
    "damping": described(schema_reference("amount"), "force by speed of its length, in the declared unit or N s/m"),
}
TORSION_SPRING_SCHEMA: Schema = {
    "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the links between which it turns"),
    "stiffness": described(schema_reference("amount"), "torque by angle, in the declared unit or N m/rad"),
    "free_angle": described(
        schema_reference("angle"), "the angle of the second link against the first at rest; left out: 0"
    ),
    "damping": described(schema_reference("amount"), "torque by angular speed, in the declared unit or N m s/rad"),
}
MASS_SCHEMA: Schema = {
    "link": described(TEXT, "the link that it belongs to; several on a link add up"),
    "mass": described(schema_reference("amount"), "the mass, in the declared unit or kg"),
    "at": described(schema_reference("spot"), "its centre: a point of the link, or [x, y] in the link's axes"),
    "inertia": described(schema_reference("amount"), "about that centre, in the declared unit or kg m^2; left out: 0"),
}
PUBLISHED_SCHEMA: Schema = {
    "symbol": described(TEXT, "how the book writes it, as v_C"),
    "quantity": described({"enum": list(PUBLISHED_QUANTITIES)}, "what it is"),
    "of": described(TEXT, "the point, link, pair or input that it is of"),
    "value": described(
        {"anyOf": [{"type": "null"}, schema_reference("quantity")]}, "what the book prints; null where it prints none"
    ),
    "tolerance": described(
        {"type": "number", "minimum": 0, "exclusiveMaximum": LARGEST_NUMBER},
        "the part of the exact value by which a drawing may be off; left out: 0.02",
    ),
    "relative_to": described(TEXT, "the point or link against which it is told; left out: the frame"),
    "component": described({"enum": ["x", "y"]}, "which part of a vector; left out: its size"),
    "sense": described({"enum": list(SENSE_WORDS)}, "the sense that the book gives it"),
    "case": described(TEXT, "which of the book's cases it belongs to"),
    "note": described(TEXT, "what there is to say of it"),
    "slip": described(TEXT, "why the printed value is wrong, where it is"),
    "inputs": described(schema_reference("drives"), "inputs that are changed for it, by their pairs"),
    "from": described(schema_reference("drives"), "inputs at the position from which a displacement counts"),
}
TOLERANCE_SCHEMA: Schema = {
    "general": described(
        {"enum": [f"ISO 2768-1 {grade}" for grade in "fmcv"]},
        "the general tolerances of lengths and angles of links and pairs that have none of their own",
    ),
    "lengths": described(
        {"anyOf": [schema_reference("quantity"), list_schema("quantity", 2, 2)]},
        "how far every length of links and pairs that has no tolerance of its own, and is not 0, may be off: 0.1, plus "
        "and minus, or the lower and upper deviation",
    ),
    "clearance": described(
        _named_values_schema({"anyOf": [schema_reference("amount"), TEXT]}),
        "by pins how far the centres of pin and hole may stand apart, as 0.03 mm, or their fit, as H7/g6",
    ),
}
_LOADS: Schema = {
    "type": "array",
    "items": {
        "anyOf": [
            object_schema(FORCE_SCHEMA, "point", "force"),
            object_schema(TORQUE_SCHEMA, "link", "torque"),
            object_schema(POINT_PAIR_SCHEMA, "points", "force"),
            object_schema(EFFORT_SCHEMA, "pair", oneOf=[{"required": ["force"]}, {"required": ["torque"]}]),
        ]
    },
}
_SPRINGS: Schema = {
    "type": "array",
    "items": {
        "anyOf": [
            object_schema(kind, ends, anyOf=[{"required": ["stiffness"]}, {"required": ["damping"]}])
            for kind, ends in ((SPRING_SCHEMA, "points"), (TORSION_SPRING_SCHEMA, "links"))
        ]
    },
}
FILE_SCHEMA: Schema = {
    "planar": described({"const": FORMAT_VERSION}, "the version of this form of file"),
    "name": described(TEXT, "the mechanism's name, as titles have it"),
    "ids": described(_TEXTS, "other names under which a model is found"),
    "about": described(TEXT, "what it does, in a sentence"),
    "source": described(TEXT, "the book or drawing that it is from"),
    "geometry": described(
        {"enum": list(GEOMETRY_SOURCES)}, "whether its dimensions are given there, or were recovered"
    ),
    "notes": described(_TEXTS, "remarks that are shown with its results"),
    "units": described(object_schema(UNITS_SCHEMA), "the units of bare numbers in this file, and of results"),
    "frame": described(TEXT, "the link that stands still"),
    "frame_number": described(
        {"enum": list(FRAME_NUMBERS)},
        "where the frame is in the numbers of the links: first, so that it is link 1, or last; left out: last",
    ),
    "links": described(_named_values_schema(schema_reference("link"), minProperties=1), "the links by their names"),
    "pairs": described({"type": "array", "items": schema_reference("pair")}, "what joins the links"),
    "inputs": described(
        {"type": "array", "items": object_schema(INPUT_SCHEMA, "pair", "position")},
        "what is driven: as many as the mechanism has freedoms",
    ),
    "loads": described(_LOADS, "forces and torques that act on it"),
    "springs": described(_SPRINGS, "springs and dampers, between two points or two links"),
    "masses": described(
        {"type": "array", "items": object_schema(MASS_SCHEMA, "link", "mass", "at")}, "the masses of its links"
    ),
    "gravity": described(
        vector_schema("quantity"), "the acceleration of weights, as [0, -9.81], in the declared unit or m/s^2"
    ),
    "closes_within": described(
        schema_reference("size"),
        "the misfit up to which the pairs of a linkage that is held more than once may stay open, where its lengths "
        "are rounded: it takes the position of least misfit; left out: it has to close",
    ),
    "tolerances": described(
        object_schema(TOLERANCE_SCHEMA)
        | {"additionalProperties": {"anyOf": [schema_reference("quantity"), list_schema("quantity", 2, 2)]}},
        "how far numbers of the file may be off, by their names as `planar inspect` lists them: 0.05, plus and minus, "
        'or the lower and upper deviation, as ["-0.02 mm", "0.05 mm"]',
    ),
    "sketch": described(
        {"type": "object", "additionalProperties": vector_schema("length")},
        "roughly where some points are, in the frame's axes: the assembly nearest to them is taken",
    ),
    "published": described(
        {"type": "array", "items": object_schema(PUBLISHED_SCHEMA, "symbol", "quantity", "of")},
        "values that the source prints, which are shown beside the exact ones",
    ),
}
"""Every key of a file, and what its value is."""


def schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a mechanism file.

    >>> import planar
    >>> planar.schema()["type"]
    'object'
    """
    from planar.model.input_laws import SEGMENT_TYPES  # which few files have
    from planar.model.pairs.cams.arc_lift import nose_schema
    from planar.model.pairs.cams.lift_law import lift_schema

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A planar mechanism",
        **object_schema(FILE_SCHEMA, "planar", "frame", "links", "pairs"),
        "$defs": {
            "name": {
                "type": "string",
                "pattern": rf"^[^{FORBIDDEN_IN_NAMES}]*[^\s{FORBIDDEN_IN_NAMES}][^{FORBIDDEN_IN_NAMES}]*$",
                "description": f"contains none of {' '.join(FORBIDDEN_IN_NAMES)}",
            },
            "text": TEXT,
            "number": _BOUNDED,
            "quantity": quantity_schema(_BOUNDED, "[+−-]?", "10.5 rad/s"),
            "length": quantity_schema(_BOUNDED, "[+−-]?", "50 mm"),
            "amount": quantity_schema(_FROM_ZERO, "[+]?", "2 kg"),
            "size": quantity_schema(_POSITIVE_SIZE, "[+]?", "50 mm"),
            "angle": quantity_schema(_BOUNDED, "[+−-]?", "60 deg"),
            "spot": {"anyOf": [TEXT, vector_schema("length")], "description": "a point of the link, or [x, y]"},
            "place": {
                "anyOf": [
                    vector_schema("length"),
                    object_schema(ALONG_SCHEMA, "along", "distance", **{"not": {"required": ["angle", "offset"]}}),
                    object_schema(
                        DISTANCES_SCHEMA, "distances", oneOf=[{"required": ["left_of"]}, {"required": ["right_of"]}]
                    ),
                ]
            },
            "link": object_schema(
                LINK_SCHEMA,
                dependentRequired={"length": ["ends"], "ends": ["length"]},
                anyOf=[
                    {"required": ["ends"]},
                    {"properties": {"points": {"minProperties": 1}}, "required": ["points"]},
                ],
                **{"not": {"required": ["ends", "axis"]}},
            ),
            "varies": object_schema(VARIATION_SCHEMA, "at", "factors"),
            "time": quantity_schema(ABOVE_ZERO, "[+]?", "0.5 s"),
            "piece": {"oneOf": [_segment_schema(kind) for kind in SEGMENT_TYPES.values()]},
            "lift": lift_schema(),
            "nose": nose_schema(),
            "drives": {"type": "object", "additionalProperties": object_schema(DRIVE_SCHEMA)},
            "pair": {"oneOf": [_pair_schema(kind) for kind in pair_types().values()]},
        },
    }


def _pair_schema(kind: type[Pair]) -> Schema:
    own = {kind.keyword: described(schema_reference("name"), kind.entry_description), **kind.entry_schemas}
    dependent = {"dependentRequired": {"restitution": ["stops"]}}
    properties = {**own, **STOP_SCHEMA, **PAIR_SCHEMA}
    return object_schema(properties, kind.keyword, *kind.required_keys) | dict(kind.entry_rule) | dependent


def _segment_schema(kind: type[LawSegment]) -> Schema:
    """The schema of one motion of an input's law."""
    values = {"time": schema_reference("time"), "number": {"type": "number", "exclusiveMinimum": 0, "maximum": 1}}
    properties: Schema = {"motion": described({"const": kind.motion}, kind.description)}
    for name, key in kind.keys.items():
        value = values.get(key.value_kind, schema_reference("quantity"))
        properties[name] = described(
            list_schema("quantity", 2, MAX_LAW_ITEMS) if key.is_list else value, key.description
        )
    return object_schema(properties, "motion", *(name for name, key in kind.keys.items() if key.is_required))
