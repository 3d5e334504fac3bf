"""Places the elements of pairs in a mechanism: by the operations that their formulas perform."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

from planar.equations.elements import Element, ElementKey, PlacedElement
from planar.equations.known_types import known_text
from planar.equations.pair_formulas import recorded_pair_formula
from planar.model.pairs import Pair

MAX_ELEMENTS = 1024


@lru_cache(maxsize=MAX_ELEMENTS)
def element_of_key(key: ElementKey) -> Element:
    """The element of a formula; pairs of the same formula share it."""
    text = known_text(key.fingerprint)
    if text is not None:
        return Element.from_text(key.fingerprint, text)
    from planar.equations.element_derivation import derive_element  # most are known

    return derive_element(key)


class ElementPlacement:
    """Finds the elements of pairs: `frame_columns` are the coordinates x, y, angle of every link that moves,
    `own_columns` and `number_columns` those of every pair."""

    def __init__(
        self,
        frame_columns: Mapping[str, Sequence[int]],
        own_columns: Mapping[str, Sequence[int]],
        number_columns: Mapping[str, Sequence[int]],
    ):
        self._frame_columns, self._own_columns, self._number_columns = frame_columns, own_columns, number_columns

    def residual_of(self, pair: Pair, first_row: int) -> PlacedElement:
        """The element of a pair's residual; its rows begin with a row."""
        return self._place(pair, False, range(first_row, first_row + len(pair.residual_kinds)))

    def input_position_of(self, pair: Pair, row: int) -> PlacedElement:
        """The element of the position of a relative motion."""
        return self._place(pair, True, range(row, row + 1))

    def _place(self, pair: Pair, is_input: bool, rows: range) -> PlacedElement:
        is_moving = tuple(link in self._frame_columns for link in pair.bodies)
        own, numbers = self._own_columns.get(pair.name, ()), self._number_columns.get(pair.name, ())
        formula = recorded_pair_formula(pair, is_input, is_moving, len(own), len(numbers))
        key = ElementKey(formula, sum(is_moving), len(own), len(numbers))
        columns = [column for link in pair.bodies for column in self._frame_columns.get(link, ())]
        return PlacedElement(element_of_key(key), (*columns, *own), tuple(numbers), rows)
