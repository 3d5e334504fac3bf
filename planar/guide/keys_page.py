"""The page of all keys of a mechanism file, made from the schema."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from planar.document.schema import schema

Schema = Mapping[str, Any]

KIND_WORDS = {
    "name": "a name",
    "text": "a text",
    "number": "a number",
    "quantity": "a quantity",
    "length": "a length",
    "amount": "a quantity from 0 on",
    "size": "a length above 0",
    "angle": "an angle",
    "spot": "a point's name, or [x, y]",
    "time": "a time above 0",
    "link": "a link",
    "pair": "a pair",
    "place": "where a point is",
    "piece": "a piece of a law",
    "lift": "a piece of lift",
    "nose": "a circle",
    "varies": "a variation",
    "drives": "inputs by their pairs",
}
"""What a page calls the kinds of values that the schema defines."""
TYPE_WORDS = {
    "string": "a text",
    "boolean": "true or false",
    "number": "a number",
    "integer": "a whole number",
    "null": "null",
}
HEAD = """# Every key of a file

Made from the schema that `planar schema` prints. A *quantity* is a number in the declared unit, or a text with its own,
such as `"210 rpm"`; [Writing a mechanism](writing.md) shows how the keys are used. Keys in **bold** are always there.
"""


def keys_page() -> str:
    """The whole page, in Markdown."""
    whole = schema()
    kinds = whole["$defs"]
    parts = [HEAD, *_section("The file", whole)]
    parts += _section("A link", kinds["link"])
    parts += _section("A point of a link", *(each for each in kinds["place"]["anyOf"] if "properties" in each))
    parts += [part for pair in kinds["pair"]["oneOf"] for part in _section(_title(pair), pair)]
    parts += _section("A piece of a cam's lift", *kinds["lift"]["oneOf"])
    parts += _section("A circle of a cam", kinds["nose"])
    parts += _section("An input", whole["properties"]["inputs"]["items"])
    parts += _section("A piece of an input's law", *kinds["piece"]["oneOf"])
    parts += _section("A load", *whole["properties"]["loads"]["items"]["anyOf"])
    parts += _section("How a load varies", kinds["varies"])
    parts += _section("A spring", *whole["properties"]["springs"]["items"]["anyOf"])
    parts += _section("A mass", whole["properties"]["masses"]["items"])
    parts += _section("Units", whole["properties"]["units"])
    parts += _section("A published value", whole["properties"]["published"]["items"])
    return "\n".join(parts)


def _title(pair: Schema) -> str:
    """The heading of a pair: what its keyword says it is."""
    keyword = next(iter(pair["properties"]))
    return f"`{keyword}`: {pair['properties'][keyword]['description'].partition(':')[0]}"


def _section(title: str, *kinds: Schema) -> Iterator[str]:
    """A heading, and a table of the keys of one kind of object, or of several, one after the other."""
    yield f"\n## {title}"
    for kind in kinds:
        yield "\n| key | value | |\n|---|---|---|"
        for key, own in kind["properties"].items():
            name = f"**`{key}`**" if key in kind.get("required", ()) else f"`{key}`"
            yield f"| {name} | {_value_words(own)} | {own['description']} |"
            for inner, part in own.get("properties", {}).items() if key != "units" else ():
                yield f"| `{key}.{inner}` | {_value_words(part)} | {part['description']} |"


def _value_words(value: Schema) -> str:  # noqa: PLR0911
    """What a value is, in a few words."""
    if "const" in value:
        return f"`{value['const']}`"
    if "enum" in value:
        return ", ".join(f"`{each}`" for each in value["enum"])
    if "$ref" in value:
        return KIND_WORDS[value["$ref"].rpartition("/")[2]]
    if "properties" in value:
        return "an object"
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(_value_words(each) for each in value["anyOf"]))
    if value.get("type") == "array":
        least, most = value.get("minItems"), value.get("maxItems")
        count = f"{least} of " if least is not None and least == most else ""
        item = _value_words(value["items"])
        return "a list of objects" if item == "an object" else f"a list: {count}{item}"
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return f"an object: for each name {_value_words(inner)}" if isinstance(inner, dict) else "an object"
    return TYPE_WORDS[value["type"]]
