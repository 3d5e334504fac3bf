"""A function that several tests call alike, and that computes each of its results once."""

from collections.abc import Callable
from functools import wraps
from typing import Any


def remembered(function: Callable[..., Any], key: Callable[..., str] | None = None) -> Callable[..., Any]:
    """The function, which remembers its results by its arguments, or by what `key` makes of them.

    One that reports progress is called each time, unless a key says by what it is known.
    """
    results: dict[str, Any] = {}

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        known_by = repr((args, named)) if key is None else key(*args, **named)
        if known_by not in results or (key is None and "progress" in named):
            results[known_by] = function(*args, **named)
        return results[known_by]

    return call
