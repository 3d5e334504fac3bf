"""The first argument of public functions: a mechanism, or what says where one is, or a result; nothing else."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import unwrap
from os import PathLike
from typing import Any, Concatenate, Literal, ParamSpec, Protocol, TypeVar, overload

from planar.document.files import as_mechanism
from planar.foundation.arrays import one_blas_thread
from planar.foundation.errors import BadInput, join_names
from planar.model.mechanism import Mechanism

MechanismSource = Mechanism | str | PathLike[str]
"""A mechanism, a file, or the name of a model that comes along."""

P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

ResultName = Literal[
    "Balance",
    "Calibration",
    "Centres",
    "Circuits",
    "Cognates",
    "ForceMap",
    "Forces",
    "Modes",
    "Motion",
    "Simulation",
    "State",
    "ToleranceBand",
]
SourceName = Literal["Mechanism"]


class _TakesSource(Protocol):
    """Makes of a function one that takes a path or a model's name, too."""

    def __call__(
        self, function: Callable[Concatenate[T, P], R], /
    ) -> Callable[Concatenate[T | str | PathLike[str], P], R]: ...


def takes_mechanism(function: Callable[Concatenate[Mechanism, P], R]) -> Callable[Concatenate[MechanismSource, P], R]:
    """The function with a path or a model's name in place of its mechanism, too; anything else is BadInput."""
    found: Callable[Concatenate[MechanismSource, P], R] = _with_first(function, as_mechanism)
    return found


@overload
def takes_result(result: ResultName, source: SourceName, /) -> _TakesSource: ...
@overload
def takes_result(result: ResultName, other: ResultName, source: SourceName, /) -> _TakesSource: ...
@overload
def takes_result(result: ResultName, other: ResultName, third: ResultName, source: SourceName, /) -> _TakesSource: ...
@overload
def takes_result(source: SourceName, result: ResultName, other: ResultName, /) -> _TakesSource: ...
@overload
def takes_result(*results: ResultName) -> Callable[[F], F]: ...
def takes_result(*classes: str) -> Any:
    """The function, which takes results of these classes, by name; with "Mechanism" among them a path or a name, too.

    Anything else is BadInput.
    """

    def resolve(source: Any) -> Any:
        if any(each.__name__ in classes for each in type(source).__mro__):
            return source
        if "Mechanism" in classes and isinstance(source, str | PathLike):
            return as_mechanism(source)
        wanted = join_names([f"a {name}" for name in classes], last_joiner=" or ")
        raise BadInput("argument", f"{wanted} is wanted, not {type(source).__name__} {source!r:.60}")

    return lambda function: _with_first(function, resolve)


def _with_first(function: Any, resolve: Callable[[Any], Any]) -> Any:
    first = unwrap(function).__code__.co_varnames[0]

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        if args:
            source = resolve(args[0])
            args = (source, *args[1:])
        elif first in named:
            source = named[first] = resolve(named[first])
        else:
            return function(**named)
        mechanism = getattr(source, "mechanism", source)
        with one_blas_thread(len(getattr(mechanism, "links", ()))):
            return function(*args, **named)

    return call
