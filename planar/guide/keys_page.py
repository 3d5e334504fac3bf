"""The pages of all keys of mechanism files and of tasks, made from their schemas."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from textwrap import indent
from typing import Any, NamedTuple

from planar.document.files import read_packaged_text
from planar.document.schema import PAIR_SCHEMA, schema

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
    "mechanism": "a mechanism",
    "positive": "a quantity above 0",
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
Beneath a picture stands what it shows.
"""
TASK_HEAD = """# Every key of a task

Made from the schema that `planar schema --task` prints, which editors take as that of mechanisms. A *quantity* is a
number in the declared unit, or a text with its own; units are those of mechanism files. [Linkages for a
task](synthesis.md) shows how the keys are used. Keys in **bold** are always there.

```sh
planar schema --task > planar-task-schema.json
```
"""


SHOWN_KEYS = {
    "file": ("frame_number", "sketch"),
    "misfit": ("closes_within", "pairs"),
    "link": ("links", "pairs"),
    "input": ("inputs",),
    "law": ("inputs",),
    "load": ("loads",),
    "varies": ("loads",),
    "spring": ("springs",),
    "mass": ("masses", "gravity"),
    "tolerances": ("tolerances",),
}
"""What a page shows of the example of a section; of that of a pair the entry with its keyword."""
KEYS_OF_PARTS = {"pairs/lift": "law", "pairs/nose": "noses"}
"""The key of a pair under which the parts of an example stand."""
JSON_WIDTH = 74
"""Characters of a line, which a terminal need not break."""


class KeySection(NamedTuple):
    """A part of the page: its title, the kinds of objects whose keys it tells, and the name of its example, or
    nothing."""

    title: str
    kinds: tuple[Schema, ...]
    example: str


def key_sections() -> tuple[KeySection, ...]:
    """The parts of the page, from the schema."""
    whole = schema()
    kinds, lists = whole["$defs"], {key: value.get("items", {}) for key, value in whole["properties"].items()}
    places = tuple(each for each in kinds["place"]["anyOf"] if "properties" in each)
    return (
        KeySection("The file", (whole,), "file"),
        KeySection("A link", (kinds["link"],), "link"),
        KeySection("A point of a link", places, ""),
        *(KeySection(_title(pair), (pair,), f"pairs/{_keyword(pair)}") for pair in kinds["pair"]["oneOf"]),
        KeySection("A piece of a cam's lift", tuple(kinds["lift"]["oneOf"]), "pairs/lift"),
        KeySection("A circle of a cam", (kinds["nose"],), "pairs/nose"),
        KeySection("Any pair, of links that are held more than once", ({"properties": PAIR_SCHEMA},), "misfit"),
        KeySection("An input", (lists["inputs"],), "input"),
        KeySection("A piece of an input's law", tuple(kinds["piece"]["oneOf"]), "law"),
        KeySection("A load", tuple(lists["loads"]["anyOf"]), "load"),
        KeySection("How a load varies", (kinds["varies"],), "varies"),
        KeySection("A spring", tuple(lists["springs"]["anyOf"]), "spring"),
        KeySection("A mass", (lists["masses"],), "mass"),
        KeySection("Tolerances", (whole["properties"]["tolerances"],), "tolerances"),
        KeySection("Units", (whole["properties"]["units"],), ""),
        KeySection("A published value", (lists["published"],), ""),
    )


def keys_page() -> str:
    """The whole page, in Markdown."""
    return "\n".join([HEAD, *(line for each in key_sections() for line in _section_lines(each))])


def task_keys_page() -> str:
    """The page of the keys of a task, in Markdown."""
    from planar.synthesis.task.task_file import task_schema  # a terminal shows other pages more often

    whole = task_schema()["properties"]
    starts = tuple(each for each in whole["start"]["anyOf"] if "properties" in each)
    path, poses, function = whole["wanted"]["items"]["anyOf"]
    demands = tuple(each for each in whole["demands"]["items"]["anyOf"] if "properties" in each)
    sections = (
        KeySection("The file", (task_schema(),), ""),
        KeySection("Chains to start from", starts, ""),
        KeySection("A path", (path,), ""),
        KeySection("A place of a path, with more than its coordinates", _entries(path["properties"]["through"]), ""),
        KeySection("Poses of a link", (poses,), ""),
        KeySection("A pose", (poses["properties"]["poses"]["items"],), ""),
        KeySection("A function of the input", (function,), ""),
        KeySection("A pair of positions with a weight", _entries(function["properties"]["pairs"]), ""),
        KeySection("A demand that is no word", demands, ""),
    )
    return "\n".join([TASK_HEAD, *(line for each in sections for line in _section_lines(each))])


def _entries(values: Schema) -> tuple[Schema, ...]:
    """The objects that a list may hold."""
    return tuple(each for each in values["items"]["anyOf"] if "properties" in each)


def read_example(name: str) -> dict[str, Any]:
    """The mechanism file in which the keys of a section stand."""
    found: dict[str, Any] = json.loads(read_packaged_text("guide", f"examples/{name}.json"))
    return found


def _keyword(pair: Schema) -> str:
    return str(next(iter(pair["properties"])))


def _title(pair: Schema) -> str:
    """The heading of a pair: what its keyword says it is."""
    keyword = _keyword(pair)
    return f"`{keyword}`: {pair['properties'][keyword]['description'].partition(':')[0]}"


def _section_lines(section: KeySection) -> Iterator[str]:
    """A heading, the example with its picture, and a table of the keys of each kind of object."""
    yield f"\n## {section.title}"
    if section.example:
        yield from _example_lines(section.example)
    for kind in section.kinds:
        yield "\n| key | value | |\n|---|---|---|"
        for key, own in kind["properties"].items():
            name = f"**`{key}`**" if key in kind.get("required", ()) else f"`{key}`"
            yield f"| {name} | {_value_words(own)} | {own['description']} |"
            for inner, part in own.get("properties", {}).items() if key not in ("units", "tolerances") else ():
                yield f"| `{key}.{inner}` | {_value_words(part)} | {part['description']} |"


def _example_lines(name: str) -> Iterator[str]:
    """The picture of an example, and what is shown of its file."""
    example = read_example(name)
    yield f"\n![{example['name']}](../pictures/keys/{name}.png)\n\n```json"
    for key in SHOWN_KEYS.get(name, ()):
        yield f'"{key}": {_json_lines(example[key], JSON_WIDTH - len(key))}'
    if name not in SHOWN_KEYS:
        keyword = KEYS_OF_PARTS.get(name, name.rpartition("/")[2])
        yield from (_json_lines(pair, JSON_WIDTH) for pair in example["pairs"] if keyword in pair)
    yield "```"


def _json_lines(value: Any, width: int) -> str:
    """A JSON value in one line, or its parts in lines of their own where that is too long."""
    whole = json.dumps(value)
    if len(whole) <= width or not value or not isinstance(value, dict | list):
        return whole
    inner = width - 2
    if isinstance(value, dict):
        lines = [f"{json.dumps(key)}: {_json_lines(part, inner)}" for key, part in value.items()]
    else:
        lines = [_json_lines(part, inner) for part in value]
    start, end = "{}" if isinstance(value, dict) else "[]"
    return "\n".join([start, indent(",\n".join(lines), "  "), end])


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
