"""A JSON value as a text that people read: short lists and objects in one line, keys in the order that they have."""

from __future__ import annotations

import json
from typing import Any

LINE = 110
"""Letters of a line, as far as it can be kept."""


def format_json(value: Any, indent: str = "") -> str:
    """The text of a JSON value, without a line's end behind.

    >>> print(format_json({"a": [1, 2], "b": {"c": "d"}}))
    {"a": [1, 2], "b": {"c": "d"}}
    """
    inline = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(indent) + len(inline) <= LINE or not isinstance(value, dict | list) or not value:
        return inline
    deeper = indent + "  "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key, ensure_ascii=False)}: {format_json(each, deeper)}" for key, each in value.items()]
    else:
        parts = [format_json(each, deeper) for each in value]
    left, right = "{}" if isinstance(value, dict) else "[]"
    return f"{left}\n{deeper}" + f",\n{deeper}".join(parts) + f"\n{indent}{right}"
