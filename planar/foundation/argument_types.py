"""The types of what a mechanism is built of in Python, checked against annotations when it is constructed."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache, wraps
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from planar.foundation.errors import BadInput

T = TypeVar("T")
NUMBER_NAMES = frozenset({"float", "int", "Scalar"})
PLAIN_TYPES: Mapping[str, type] = {"str": str, "bool": bool}


def checked_arguments(cls: type[T]) -> type[T]:
    """The named tuple, whose constructor raises BadInput for arguments that are not of the types annotated.

    `_replace` and `_make` take anything, as symbols in place of numbers.
    """
    create = cast("Callable[..., T]", cls.__new__)

    @wraps(create)
    def create_checked(kind: type[T], /, *args: Any, **named: Any) -> T:
        made = create(kind, *args, **named)
        check_field_types(made)
        return made

    cls.__new__ = create_checked  # type: ignore[assignment, method-assign]
    return cls


def check_field_types(made: Any) -> None:
    """Raise BadInput where a field of a named tuple or a dataclass is not of the type annotated.

    What is no text, container, function or dataclass passes as a number: symbols and arrays do. The names of types that
    are not classes are not checked.
    """
    kind = type(made)
    for field in _annotated_fields(cast("Hashable", kind)):
        value = getattr(made, field.name)
        if field.options and not _is_of_any(value, field.options):
            wanted = " or ".join(dict.fromkeys(_describe(option) for option in field.options))
            raise BadInput(f"{kind.__name__}.{field.name}", f"{wanted} is wanted here, not {value!r:.60}")


class _Option(NamedTuple):
    """One type of a union: the name of a class, with the types of a tuple's items, and whether it repeats."""

    name: str
    items: tuple[tuple[_Option, ...], ...] = ()
    repeats: bool = False


class _Field(NamedTuple):
    name: str
    options: tuple[_Option, ...]
    "none where the type is not checked"


@cache
def _annotated_fields(kind: Any) -> tuple[_Field, ...]:
    if issubclass(kind, tuple):
        texts: dict[str, Any] = {name: kind.__annotations__[name] for name in getattr(kind, "_fields", ())}
    else:
        texts = {field.name: field.type for field in fields(cast("Any", kind)) if field.init}
    known = {name: value for base in reversed(kind.__mro__) for name, value in _module_names(base).items()}
    return tuple(_Field(name, _options(_parse(annotation), known)) for name, annotation in texts.items())


def _parse(annotation: Any) -> ast.expr:
    """An annotation, as a text or as what it evaluates to, as an expression."""
    text = annotation.__name__ if type(annotation) is type else str(getattr(annotation, "__forward_arg__", annotation))
    try:
        return ast.parse(text, mode="eval").body
    except SyntaxError:  # what a class writes that is not checked
        return ast.Constant(...)


def _module_names(kind: type) -> dict[str, Any]:
    return vars(sys.modules[kind.__module__]) if kind.__module__ in sys.modules else {}


def _options(node: ast.expr, known: Mapping[str, Any]) -> tuple[_Option, ...]:
    """The types of an annotation; none where one of them is not a class."""
    if isinstance(node, ast.BinOp):
        left, right = _options(node.left, known), _options(node.right, known)
        return left + right if left and right else ()
    if isinstance(node, ast.Constant) and node.value is None:
        return (_Option("None"),)
    if isinstance(node, ast.Name):
        # what is imported for types alone is not among the names of the module
        is_class = node.id in NUMBER_NAMES or isinstance(known.get(node.id, type), type)
        return (_Option(node.id),) if is_class else ()
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "tuple":
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        repeats = any(isinstance(each, ast.Constant) and each.value is Ellipsis for each in nodes)
        items = [_options(each, known) for each in nodes if not (repeats and isinstance(each, ast.Constant))]
        return (_Option("tuple", tuple(items), repeats),)
    return ()


def _is_of_any(value: Any, options: Sequence[_Option]) -> bool:
    """Whether a value is of one of some types, most often of the first."""
    return _is_of_type(value, options[0]) or any(_is_of_type(value, option) for option in options[1:])


def _is_of_type(value: Any, option: _Option) -> bool:
    kind, name = type(value), option.name
    if name == "tuple":
        return _is_tuple_of(value, option)
    if kind.__name__ == name:
        return True
    if name in NUMBER_NAMES:
        is_other = value is None or callable(value) or is_dataclass(value)
        return not is_other and not isinstance(value, str | bytes | list | tuple | set | Mapping)
    if name in PLAIN_TYPES:
        return isinstance(value, PLAIN_TYPES[name])
    return value is None if name == "None" else any(base.__name__ == name for base in kind.__mro__)


def _is_tuple_of(value: Any, option: _Option) -> bool:
    if type(value) is not tuple and (isinstance(value, str | bytes) or not isinstance(value, Sequence | np.ndarray)):
        return False
    items = option.items * len(value) if option.repeats else option.items
    return len(items) == len(value) and all(
        not options or _is_of_any(item, options) for item, options in zip(value, items, strict=True)
    )


def _describe(option: _Option) -> str:
    if option.name in NUMBER_NAMES:
        return "a number"
    if option.name == "str":
        return "a text"
    if option.name == "tuple":
        count = "" if option.repeats else f"{len(option.items)} "
        return f"a tuple of {count}{_plural(option.items[0]) if option.items else 'items'}"
    return option.name if option.name == "None" else f"{'an' if option.name[0] in 'AEIOU' else 'a'} {option.name}"


def _plural(options: tuple[_Option, ...]) -> str:
    if len(options) != 1:
        return "items"
    name = options[0].name
    return "numbers" if name in NUMBER_NAMES else "texts" if name == "str" else f"{name} objects"
