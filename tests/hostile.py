"""Names and texts that would do harm if they were taken for anything but texts."""

from __future__ import annotations

import json
from typing import Any

import planar
from planar.model.mechanism import Mechanism
from tests.builders import four_bar_document

HARMFUL = (
    "</script><script>window.hacked=1</script><img src=x onerror='window.hacked=1'>"
    "\"'`${window.hacked=1}&lt;\u2028\u2029🦾{data}{scripts}"
)
HARMFUL_LINE = HARMFUL.replace("\u2028\u2029", "")
"""The same for what stands in one line."""
HARMFUL_NAME = "</script><img src=x onerror='hacked=1'>\"`${hacked=1}&lt;🦾"
TEXTS = [
    "$x",
    "$x$",
    "a_b^",
    "\\frac{",
    "<b>",
    "&amp;",
    "--",
    "$\\frac{$",
    "中文",
    "a\nb\tc",
    "\ud800",
    "\x00",
    "𝔄",
    "x" * 500,
]


NAMES = ("$x", "a_b^", "\\frac{", "<b>[red]", "点", "🙂", "name of a point that goes on and on", "%d{}")


def hostile_document() -> dict[str, Any]:
    """A four-bar whose every name means something to somebody."""
    a, b, c, d, e, one, two, three = NAMES
    names = ["frame $", one, two, three]
    texts = {"name": "$\\frac{1}{ [bold]x[/bold] <i> _^ 点🙂", "source": "$$ \\alpha_ {"}
    more = {"points": {e: {"along": [b, c], "distance": 0.02}}, "sketch": {c: [0.08, 0.05]}, **texts}
    given = {"pins": [a, b, c, d], "names": names, "omega": 10.5, "alpha": -26}
    return four_bar_document(0.05, 0.066, 0.056, 0.1, 1.0, **given, **more)


def harmful_mechanism() -> Mechanism:
    """A four-bar linkage all of whose texts would do harm if they were taken for anything but texts."""
    value = planar.to_dict(planar.load("four-bar"))
    text = json.dumps(value)
    pins = sorted({pair["turning"] for pair in value["pairs"]})
    new = ["constructor", "__proto__", "toString", *(f"{k}{HARMFUL_NAME}" for k in range(20))]
    for k, name in enumerate([*value["links"], *pins]):
        text = text.replace(json.dumps(name), f'"\\u0001{k}"')  # first aside: a new name may be an old one
    for k in range(len(value["links"]) + len(pins)):
        text = text.replace(f'"\\u0001{k}"', json.dumps(new[k]))
    value = json.loads(text)
    return planar.from_dict(value | {"name": HARMFUL_LINE, "about": HARMFUL, "source": HARMFUL, "notes": [HARMFUL]})
