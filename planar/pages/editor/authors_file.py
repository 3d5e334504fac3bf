"""A file as its author wrote it, with what another one has of its own."""

from __future__ import annotations

from typing import Any


def carry_over(own: Any, before: Any, after: Any) -> Any:
    """The JSON value `own` of an author, with what differs between `before`, the same as planar writes it, and `after`.

    What is alike in these stays as its author wrote it, with the order of keys and all texts.
    """
    if before == after:
        return own
    if isinstance(own, dict) and isinstance(before, dict) and isinstance(after, dict):
        kept = [key for key in own if key in after or key not in before]
        new = [key for key in after if key not in own and (key not in before or before[key] != after[key])]
        return {
            key: carry_over(own.get(key), before.get(key), after[key]) if key in after else own[key]
            for key in [*kept, *new]
        }
    if not (isinstance(own, list) and isinstance(before, list) and isinstance(after, list)):
        return after
    if not len(own) == len(before) == len(after):
        return after
    return [carry_over(*each) for each in zip(own, before, after, strict=True)]
