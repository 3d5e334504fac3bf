"""The numbers of a mechanism's file by name, and the mechanism with some of them changed, checked as a file is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from numbers import Real
from typing import Any

from planar.document.cursor import Cursor, FileContext
from planar.document.dimensions import (
    Address,
    Dimension,
    change_dimensions,
    file_dimensions,
    find_dimension,
    replace_value,
    value_at,
)
from planar.document.first_argument import takes_mechanism
from planar.document.reader import read_mechanism
from planar.document.writer import write_mechanism
from planar.foundation.errors import BadInput
from planar.model.file_units import FileUnits
from planar.model.mechanism import Mechanism, find_law_problem


@takes_mechanism
def dimensions(mechanism: Mechanism) -> dict[str, float]:
    """Every number of a mechanism's file by name (SI: m, rad, s, N, kg), those left out with their defaults.

    >>> import planar
    >>> planar.dimensions(planar.load("four-bar"))["BC.length"]
    0.066
    """
    return {name: each.value for name, each in file_dimensions(mechanism).items()}


@takes_mechanism
def with_values(mechanism: Mechanism, values: Mapping[str, Any], units: FileUnits | None = None) -> Mechanism:
    """The mechanism with some numbers of its file changed, checked as a file is.

    `values` by name as in `dimensions`: a number (SI, or in `units`), or a text with a unit as "400 mm". What a book
    prints of the mechanism is left out where one changes. Raises BadInput with the number's name.
    """
    if not isinstance(values, Mapping):
        raise BadInput("values", f"give the numbers by name, as {{'BC.length': 0.4}}, not {values!r:.60}")
    known = file_dimensions(mechanism)
    chosen = {name: find_dimension(known, name) for name in values}
    changed = change_dimensions(
        mechanism,
        ((number, _read_value(name, values[name], number.kind, units)) for name, number in chosen.items()),
    )
    for index, given in enumerate(changed.inputs):
        if given.law and any(
            each.address[:2] == ("inputs", index) and len(each.address) == 3 for each in chosen.values()
        ):
            moved = given._replace(law=given.law.start_at(given.position, given.velocity))
            changed = replace_value(changed, ("inputs", index), moved)
    _check_as_file(changed, chosen)
    same = all(value_at(changed, each.address) == each.value for each in chosen.values())
    return changed if same else replace(changed, published=())


def _read_value(name: str, value: Any, kind: str, units: FileUnits | None) -> float:
    if isinstance(value, Real) and not isinstance(value, bool):
        value = float(value)
        if not isfinite(value):
            raise BadInput(name, f"a finite number is wanted, not {value!r}")
    cursor = Cursor(value, name, FileContext(units or FileUnits()))
    if kind == "count" and not float(cursor.as_number()).is_integer():
        raise cursor.error_at(None, f"a whole number is wanted here, not {value!r}")
    if kind in ("number", "count"):
        return cursor.as_number()
    return cursor.as_quantity(kind)


def _check_as_file(changed: Mechanism, chosen: Mapping[str, Dimension]) -> None:
    """Refuse what a file would be refused for; the place is the number whose place in the file that is."""
    wrong = find_law_problem(changed)
    try:
        if wrong:
            raise BadInput(*wrong)
        read_mechanism(write_mechanism(changed))
    except BadInput as problem:
        at = [name for name, each in chosen.items() if problem.place == _json_place(each.path)]
        raise BadInput(at[0] if at else ", ".join(chosen), problem.sentence) from None


def _json_place(path: Address) -> str:
    """A place in a file as the reader says it."""
    cursor = Cursor(None)
    for key in path:
        place = f"{cursor.path}[{key}]" if isinstance(key, int) else cursor.place_of(key)
        cursor = Cursor(None, place)
    return cursor.path
