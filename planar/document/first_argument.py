"""The first argument of public functions: a mechanism, or what says where one is, or a result; nothing else."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from os import PathLike, fspath
from typing import Any, Concatenate, ParamSpec, TypeVar

from planar.foundation.errors import BadInput, join_names
from planar.model.mechanism import Mechanism

MechanismSource = Mechanism | str | PathLike[str]
"""A mechanism, a file, or the name of a model that comes along."""

P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F", bound=Callable[..., Any])


def as_mechanism(source: Any) -> Mechanism:
    """The mechanism that is given, or that of a file or of a model's name. Raises BadInput."""
    if isinstance(source, Mechanism):
        return source
    if isinstance(source, str | PathLike):
        from planar.document.files import load

        path = fspath(source)
        if isinstance(path, str):
            return load(path)
    raise BadInput("mechanism", f"a Mechanism, a file or a model's name is wanted, not {_name_of(source)}")


def takes_mechanism(function: Callable[Concatenate[Mechanism, P], R]) -> Callable[Concatenate[MechanismSource, P], R]:
    """The function with a path or a model's name in place of its mechanism, too; anything else is BadInput."""
    return _with_first(function, as_mechanism)


def takes_result(*classes: str) -> Callable[[F], F]:
    """The function, which takes results of these classes, by name; with "Mechanism" among them a path or a name, too.

    Anything else is BadInput.
    """

    def resolve(source: Any) -> Any:
        if any(each.__name__ in classes for each in type(source).__mro__):
            return source
        if "Mechanism" in classes and isinstance(source, str | PathLike):
            return as_mechanism(source)
        wanted = join_names([f"a {name}" for name in classes], last_joiner=" or ")
        raise BadInput("argument", f"{wanted} is wanted, not {_name_of(source)}")

    return lambda function: _with_first(function, resolve)


def _with_first(function: Any, resolve: Callable[[Any], Any]) -> Any:
    first = function.__code__.co_varnames[0]

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        if args:
            return function(resolve(args[0]), *args[1:], **named)
        if first in named:
            named[first] = resolve(named[first])
        return function(**named)

    return call


def _name_of(source: Any) -> str:
    return f"{type(source).__name__} {source!r:.60}"
