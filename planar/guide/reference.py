"""The pages of the reference: every public name, under the room that it is from."""

from __future__ import annotations

import inspect
import re
from typing import NamedTuple

import planar
from planar.document.files import read_packaged_text

ROOM_TITLES = {
    "document": "Files",
    "model": "Mechanisms",
    "solving": "Positions and motions",
    "results": "Positions and motions",
    "assemblies": "Assemblies and circuits",
    "structures": "Chains",
    "analysis": "Analyses",
    "dynamics": "Forces and simulation",
    "batch": "Many designs",
    "foundation": "Outcomes and errors",
}
"""The heading under which the names of a room stand; those of any other are under the last."""
OTHER_TITLE = "Pictures, pages and tables"


EXAMPLES_FILE = "class_examples.txt"
ENTRY = re.compile(
    r"^(?P<name>\w+)\n(?P<attributes>(?:    \w+: .*\n)*)(?P<example>(?:    .*\n|\n(?=    ))*)", re.MULTILINE
)
ATTRIBUTE = re.compile(r"^    (?P<name>\w+): (?P<text>.*)$", re.MULTILINE)


class ClassEntry(NamedTuple):
    """What the reference adds to a class: attributes that its docstring does not tell, and an example."""

    attributes: dict[str, str]
    example: str


def class_entries() -> dict[str, ClassEntry]:
    """What is added to each public class, by its name."""
    found = {}
    for entry in ENTRY.finditer(read_packaged_text("guide", EXAMPLES_FILE)):
        told = {each["name"]: each["text"] for each in ATTRIBUTE.finditer(entry["attributes"])}
        found[entry["name"]] = ClassEntry(told, entry["example"])
    return found


def reference_names() -> dict[str, list[str]]:
    """The public names by heading, each heading's in the order of the alphabet."""
    found: dict[str, list[str]] = {title: [] for title in (*ROOM_TITLES.values(), OTHER_TITLE)}
    for name in sorted(planar.__all__, key=str.lower):
        value = getattr(planar, name)
        module = value.__name__ if inspect.ismodule(value) else value.__module__
        room = module.split(".")[1]
        found[ROOM_TITLES.get(room, OTHER_TITLE)].append(name)
    return found


def reference_pages() -> dict[str, str]:
    """The pages by name, in reStructuredText: a first one, and one for each heading."""
    pages = {}
    for title, names in reference_names().items():
        name = "reference-" + title.lower().replace(" ", "-").replace(",", "")
        parts = [title, "=" * len(title), ""]
        for each in names:
            parts += [*_directive(each), ""]
        pages[name] = "\n".join(parts)
    first = [
        "Reference",
        "=========",
        "",
        "Every public name of ``planar``, from its docstring.",
        "",
        ".. toctree::",
        "",
    ]
    return {"reference": "\n".join([*first, *(f"   {name}" for name in pages)])} | pages


def _directive(name: str) -> list[str]:
    value = getattr(planar, name)
    if inspect.ismodule(value):
        return [f".. automodule:: {value.__name__}", "   :members:"]
    if inspect.isclass(value):
        added = class_entries()[name]
        told = [f"   * ``{attribute}``: {text}" for attribute, text in added.attributes.items()]
        told = ["   Attributes beside those above:", "", *told] if told else []
        example = [line[1:] if line.strip() else "" for line in added.example.splitlines()]
        return [f".. autoclass:: planar.{name}", "   :members:", "", *told, "", *example]
    return [f".. autofunction:: planar.{name}"]
