"""The published schema and the reader agree: what the schema refuses the reader refuses, and mostly the other way."""

import json
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

import planar
from planar.document.cursor import Cursor
from planar.document.files import model_files
from planar.document.schema import PAIR_SCHEMA, STOP_SCHEMA, schema
from planar.foundation.errors import BadInput
from planar.model.pairs import pair_types
from tests import documents as document
from tests import random_documents
from tests import wheel_documents as wheels
from tests.cams import cam_document
from tests.draws import draws
from tests.remembered import remembered

EXAMPLE_FILES = Path(planar.__file__).parent / "guide" / "examples"
VALIDATOR = Draft202012Validator(schema())
MODELS = {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in model_files()}
SAMPLES = [pytest.param(sample, id=key) for key, kind in pair_types().items() for sample in kind.samples()]
BAD = [
    *(pytest.param(document.mistaken(*row.values[:3]), id=row.id) for row in document.MISTAKES),
    *(pytest.param(wheels.mistaken(row.values[0]), id=row.id) for row in wheels.MISTAKES),
    *(pytest.param(value, id=place) for value, place, _ in wheels.INPUTS),
]
UNSAID = {
    "a name that is not there": ["there is no ", " has no point ", "carries a point ", " is neither of the wheels "],
    "a name that is there already": [" already", "there is a pair "],
    "a pair of another kind, or without an input": ["what acts between the links of pair ", " has no input"],
    "names that must differ, or agree": [
        *("the line needs two different points", "the way must be between ", "rests on itself"),
        *("is one of the wheels", "several points are called "),
    ],
    "a word that is no unit": [" is not a unit", " is not a known unit", "turns or radians"],
    "a unit of the wrong kind": [" is wanted, such as ", "a bare rate "],
    "numbers that do not fit one another": [
        *("does not close", " coincide", " apart", "not pinned to ", "internal"),
        *("as many factors as places", "the places rise", "the places do not differ"),
    ],
    "what no JSON file holds": ["this is not a number"],
    "a character that is not printable": [" holds a character that cannot be shown"],
}
"""What a JSON Schema cannot say, and the words by which the reader's sentences about it are known."""
TOO_LARGE = "1e999 m"
"""A schema bounds numbers, but not those in texts."""

searching = settings(
    deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
)


@remembered
def refusal(value):
    """The sentence in which the reader refuses a value; None if it reads."""
    try:
        planar.from_dict(value)
    except BadInput as problem:
        return problem.sentence
    return None


is_valid = remembered(VALIDATOR.is_valid)
"""Whether the schema has nothing against a value."""


def wrong(value):
    """What the schema has against a value; None if nothing."""
    problem = best_match(VALIDATOR.iter_errors(value))
    return problem and f"{problem.json_path}: {problem.message[:500]}"


def test_the_command_prints_the_schema():
    command = [sys.executable, "-m", "planar", "schema"]
    ended = subprocess.run(command, capture_output=True, check=True, encoding="utf-8")
    assert ended.stderr == ""
    printed = json.loads(ended.stdout)
    assert printed == schema()
    Draft202012Validator.check_schema(printed)
    assert printed["$schema"] == Draft202012Validator.META_SCHEMA["$id"]


def test_every_reference_of_the_schema_leads_somewhere_and_every_definition_is_used():
    text = json.dumps(schema())
    for name in schema()["$defs"]:
        assert f'"#/$defs/{name}"' in text
    assert text.count('"$ref"') == sum(text.count(f'"#/$defs/{name}"') for name in schema()["$defs"])


def keys_of(part, place="file"):
    """Every key of a schema with its place and what is said of it."""
    if isinstance(part, dict):
        for name, own in part.get("properties", {}).items():
            yield f"{place}.{name}", own
        for name, own in part.items():
            yield from keys_of(own, f"{place}/{name}")
    elif isinstance(part, list):
        for index, own in enumerate(part):
            yield from keys_of(own, f"{place}[{index}]")


def test_every_key_says_what_it_means():
    conditions = {"minProperties"}  # no key of its own: what another way of writing it asks for
    silent = [place for place, own in keys_of(schema()) if "description" not in own and set(own) != conditions]
    assert silent == []


@pytest.mark.parametrize("name", MODELS)
def test_a_model_is_valid_as_it_is_written_and_as_it_is_written_back(name):
    assert wrong(MODELS[name]) is None
    assert wrong(planar.to_dict(planar.from_dict(MODELS[name]))) is None


@pytest.mark.parametrize("name", document.EXAMPLES)
def test_an_example_is_valid(name):
    assert wrong(document.base(name)) is None


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_of_every_pair_type_is_valid(sample):
    links = {name: {"points": dict(shape.points)} for name, shape in zip("abc", sample.shapes, strict=False)}
    value = {
        "planar": 1,
        "frame": "a",
        "links": json.loads(json.dumps(links)),
        "pairs": [sample.entry, *sample.other_entries],
    }
    if "c" in links:
        value["frame"] = "c"
    assert refusal(value) is None
    assert wrong(value) is None


def test_mistakes_that_a_schema_can_say_are_refused_by_it():
    """The mistakes that it cannot say are refused by the reader; of each kind of these there is an example."""
    unsaid = [words for kind in UNSAID.values() for words in kind]
    passed = []
    for case in BAD:
        (value,) = case.values
        sentence = refusal(value)
        assert sentence is not None, case.id
        if is_valid(value):
            is_known = any(words in sentence for words in unsaid)
            is_too_large = "too large" in sentence and TOO_LARGE in json.dumps(value)
            assert is_known or is_too_large, f"{case.id}: {sentence}"
            passed.append(sentence)
    assert [words for words in unsaid if not any(words in sentence for sentence in passed)] == []


# whatever is written


@settings(searching, max_examples=draws(40))
@given(random_documents.documents())
def test_any_mechanism_is_valid_as_it_is_written_and_as_it_is_written_back(value):
    assert wrong(value) is None
    assert wrong(planar.to_dict(planar.from_dict(value))) is None


@settings(searching, max_examples=draws(200))
@given(st.sampled_from([*MODELS.values(), *map(document.base, document.EXAMPLES)]), st.integers(1, 2), st.data())
def test_what_the_schema_refuses_the_reader_refuses(value, times, data):
    value = deepcopy(value)
    if data.draw(st.booleans()):
        value.pop("published", None)  # long, and so most changes would fall on it
    for _ in range(times):
        if random_documents.places(value):
            random_documents.mutilated(value, data.draw)
    if refusal(value) is None:
        assert wrong(value) is None


SPELT = st.builds(
    "".join,
    st.tuples(
        st.sampled_from(["", " ", "\t", "\u00a0"]),
        st.sampled_from(["", "+", "-", "−", "+-"]),
        st.sampled_from(["5", "05", "5.", ".5", "5.5", "5e3", "5E-3", "5.e+3", "0", "5e", ".", "٥"]),
        st.sampled_from(["", " ", "  ", "\u2009"]),
        st.sampled_from(["", "mm", "µm", "μm", "m", "°", "deg", "rad/s", "°/s", "1/s", "e3", "N m/N", "m^1", "²"]),
        st.sampled_from(["", " "]),
    ),
)


@settings(searching, max_examples=draws(100))
@given(SPELT, st.sampled_from([("links", "AB", "length"), ("inputs", 0, "position"), ("inputs", 0, "velocity")]))
def test_a_quantity_that_the_reader_reads_is_one_of_the_schema(text, path):
    value = document.put(document.base(), list(path), text)
    if refusal(value) is None:
        assert wrong(value) is None
    elif "has no unit" in refusal(value):
        assert wrong(value)


# one wrong file for each rule of the schema


WRONG_VALUES = {"object": [], "array": {}, "string": [], "number": [], "integer": [], "boolean": 5, "null": []}
"""In place of a value of a type: one of no type that any key takes there."""


def resolved(part):
    """A part of the schema, its reference followed, and where it is."""
    name = part.get("$ref", "").rpartition("/")[2]
    return (schema_parts()[name], name) if name else (part, "")


@cache
def schema_parts():
    return schema()["$defs"]


def key_place(where, key):
    """The place of a key in the schema; the keys that pairs of all types share have one."""
    return f"pair.{key}" if where.startswith("pair.") and key in STOP_SCHEMA | PAIR_SCHEMA else f"{where}.{key}"


def broken_rules(part, value, where="file", path=()):
    """Every rule of a part of the schema that a value follows: where the rule is, the path of the value, a wrong one.

    Where a part offers several forms, those that the value has.
    """
    part, name = resolved(part)
    where = name or where
    for keyword in ("anyOf", "oneOf"):
        for index, form in enumerate(part.get(keyword, ())):
            if VALIDATOR.evolve(schema=form).is_valid(value):
                yield from broken_rules(form, value, f"{where}.{keyword}[{index}]", path)
    if "type" in part:
        yield f"{where}.type", path, WRONG_VALUES[part["type"]]
    if "const" in part or "enum" in part:
        yield f"{where}.const", path, "no such word"
    if "pattern" in part and isinstance(value, str):
        yield f"{where}.pattern", path, ".:,"
    for keyword, wrong_value in (("minimum", -1), ("exclusiveMinimum", -1e300), ("exclusiveMaximum", 1e300)):
        if keyword in part and isinstance(value, int | float):
            yield f"{where}.{keyword}", path, wrong_value
    if isinstance(value, list) and value and "items" in part:
        for index, item in enumerate(value):
            yield from broken_rules(part["items"], item, f"{where}.items", (*path, index))
        if part.get("minItems"):
            yield f"{where}.minItems", path, value[: part["minItems"] - 1]
        if part.get("maxItems", 99) < 99:
            yield f"{where}.maxItems", path, [*value, *value]
        if part.get("uniqueItems"):
            yield f"{where}.uniqueItems", path, [value[0], value[0]]
    if not isinstance(value, dict):
        return
    properties, others = part.get("properties", {}), part.get("additionalProperties")
    for key in part.get("required", ()) if properties else ():
        yield f"{where}.required.{key}", path, {name: item for name, item in value.items() if name != key}
    if others is False:
        yield f"{where}.additionalProperties", path, {**value, "no_such_key": 1}
    if "propertyNames" in part and value:
        yield f"{where}.propertyNames", path, {**value, "no.name": next(iter(value.values()))}
    for key, item in value.items():
        if key in properties or isinstance(others, dict):
            part_place = key_place(where, key if key in properties else "*")
            yield from broken_rules(properties.get(key, others), item, part_place, (*path, key))


def rule_names(part, where="file", seen=frozenset()):
    """The name of every rule of a part of the schema, as `broken_rules` names it."""
    part, name = resolved(part)
    where = name or where
    if name in seen:
        return
    seen = seen | {name} - {""}
    for keyword in ("anyOf", "oneOf"):
        for index, form in enumerate(part.get(keyword, ())):
            if set(form) != {"required"}:
                yield from rule_names(form, f"{where}.{keyword}[{index}]", seen)
    if "type" in part:
        yield f"{where}.type"
    if "const" in part or "enum" in part:
        yield f"{where}.const"
    yield from (f"{where}.required.{key}" for key in (part.get("required", ()) if "properties" in part else ()))
    if part.get("additionalProperties") is False:
        yield f"{where}.additionalProperties"
    if isinstance(part.get("additionalProperties"), dict):
        yield from rule_names(part["additionalProperties"], f"{where}.*", seen)
    if "items" in part:
        yield from rule_names(part["items"], f"{where}.items", seen)
    for key, item in part.get("properties", {}).items():
        if not set(item) & {"minProperties"}:
            yield from rule_names(item, key_place(where, key), seen)


def with_value(value, path, new):
    if not path:
        return new
    copied = deepcopy(value)
    document.put(copied, list(path), new)
    return copied


def json_path(path):
    """A path as the reader writes places."""
    place = Cursor(None)
    for key in path:
        place = replace(place, path=f"{place.path}[{key}]" if isinstance(key, int) else place.place_of(key))
    return place.path


RARE_UNITS = {
    "acceleration": "mm/s^2",
    "jerk": "mm/s^3",
    "angular_acceleration": "deg/s^2",
    "angular_jerk": "rad/s^3",
    "moment_of_inertia": "g mm^2",
    "torsional_stiffness": "N mm/rad",
    "damping": "N s/mm",
    "torsional_damping": "N mm s/rad",
    "stress": "MPa",
    "energy": "J",
}


def rare_keys():
    """Files with the keys that no example and no model has."""
    four_bar = document.base()
    yield four_bar | {"units": four_bar["units"] | RARE_UNITS, "tolerances": {"lengths": ["-0.1 mm", "0.1 mm"]}}
    for piece in schema()["$defs"]["lift"]["oneOf"]:
        motion = {"motion": piece["properties"]["motion"]["const"]}
        law = [{**motion, "by": 20, "in": 120}, {**motion, "by": -20, "in": 120}, {"motion": "dwell", "in": 120}]
        if "by" in piece["required"]:
            yield cam_document("roller", law=law)
    contact = {"modulus": "210 GPa", "poisson_ratio": 0.3, "follower_poisson_ratio": 0.3, "width": 10}
    yield cam_document("roller", contact=contact, grooved=True, clockwise=True)
    yield cam_document("swinging flat", side="right")
    pins = document.base("two dyads")
    pins["pairs"][1] |= {"links": ["crank", "rod"], "points": ["A", "A"], "stops": [None, 100]}
    pins["pairs"][2] |= {"stops": {"C:rod,rocker": [None, 300]}, "restitution": 0.5}
    yield pins
    wheels_by_teeth = document.base("wheels")
    wheels_by_teeth["pairs"][6] = {"belt": "loop", "links": ["planet", "pulley"], "teeth": [20, 40]}
    wheels_by_teeth["pairs"][7] = {
        "chain": "drive",
        "links": ["pulley", "sprocket"],
        "radii": [15, 45],
        "crossed": True,
    }
    rack = wheels_by_teeth["pairs"][10]
    wheels_by_teeth["pairs"][10] = {**rack, "teeth": 20}
    yield wheels_by_teeth


def test_every_rule_of_the_schema_has_its_refusal():
    """A wrong file for each rule is refused where the rule is broken; an unknown key with those that are allowed."""
    documents = [
        *(document.base(name) for name in document.EXAMPLES),
        *(json.loads(file.read_text(encoding="utf-8")) for file in sorted(EXAMPLE_FILES.glob("*.json"))),
        *MODELS.values(),
        *rare_keys(),
    ]
    tried = {}
    for value in documents:
        for rule, path, wrong_value in broken_rules(schema(), value):
            if rule in tried:
                continue
            mistaken = with_value(value, path, wrong_value)
            try:
                planar.from_dict(mistaken)
            except BadInput as problem:
                place, holder = json_path(path), json_path(path[:-1])
                assert problem.place.startswith(holder) or place.startswith(problem.place), (rule, place, str(problem))
                if rule.endswith("additionalProperties"):
                    assert " keys are " in problem.sentence, (rule, str(problem))
                tried[rule] = problem
            else:
                assert VALIDATOR.is_valid(mistaken), (rule, path, wrong_value)
    assert sorted(set(rule_names(schema())) - set(tried)) == []
