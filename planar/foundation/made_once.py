"""Values kept by their arguments, each made once, whichever thread asks for it first."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, update_wrapper
from threading import RLock
from typing import Generic, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Value = TypeVar("Value")

_MAKING = RLock()
"""Held by the thread that makes a value, or looks for one. One for all, since making one may ask for another."""


class MadeOnce(Generic[Arguments, Value]):
    """A function whose values are kept, as `functools.lru_cache` keeps them; threads wait for one being made."""

    def __init__(self, function: Callable[Arguments, Value], maxsize: int):
        self._cached = lru_cache(maxsize)(function)
        self.cache_clear = self._cached.cache_clear
        update_wrapper(self, function)

    def __call__(self, *arguments: Arguments.args, **named: Arguments.kwargs) -> Value:
        """The value, made if it is not kept."""
        with _MAKING:
            return self._cached(*arguments, **named)  # type: ignore[arg-type]  # that they hash is the caller's part


def made_once(maxsize: int) -> Callable[[Callable[Arguments, Value]], MadeOnce[Arguments, Value]]:
    """A decorator: the last `maxsize` values are kept."""

    def keep(function: Callable[Arguments, Value]) -> MadeOnce[Arguments, Value]:
        return MadeOnce(function, maxsize)

    return keep
