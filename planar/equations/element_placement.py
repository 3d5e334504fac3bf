"""Places the elements of pairs in a mechanism: by the operations that their formulas perform."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

from planar.equations.elements import PARTS_OF_FRAME, Element, ElementKey, PlacedElement
from planar.equations.known_types import known_text
from planar.foundation.geometry import GROUND, Frame
from planar.foundation.jets import Scalar
from planar.foundation.recorded_formula import RecordedNumber, record_formula
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


Formula = Callable[[Sequence[Frame], Sequence[Scalar], Sequence[Scalar]], Sequence[Scalar]]


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
        return self._place(pair, pair.residual, first_row, len(pair.residual_kinds))

    def input_position_of(self, pair: Pair, row: int) -> PlacedElement:
        """The element of the position of a relative motion."""

        def position(*arguments: Sequence[Scalar]) -> Sequence[Scalar]:
            return (pair.input_position(*arguments),)

        return self._place(pair, position, row, 1)

    def _place(self, pair: Pair, formula: Formula, first_row: int, row_count: int) -> PlacedElement:
        moving = [link for link in pair.bodies if link in self._frame_columns]
        own, numbers = self._own_columns.get(pair.name, ()), self._number_columns.get(pair.name, ())

        def recorded(arguments: Sequence[RecordedNumber]) -> Sequence[Scalar]:
            count = PARTS_OF_FRAME * len(moving)
            parts = (arguments[PARTS_OF_FRAME * k : PARTS_OF_FRAME * (k + 1)] for k in range(len(moving)))
            frames = {link: Frame(x, y, c, s, angle) for link, (x, y, c, s, angle) in zip(moving, parts, strict=True)}
            own_values, number_values = arguments[count : count + len(own)], arguments[count + len(own) :]
            return formula([frames.get(link, GROUND) for link in pair.bodies], number_values, own_values)

        count = PARTS_OF_FRAME * len(moving) + len(own) + len(numbers)
        key = ElementKey(record_formula(recorded, count), len(moving), len(own), len(numbers))
        columns = [column for link in moving for column in self._frame_columns[link]]
        rows = range(first_row, first_row + row_count)
        return PlacedElement(element_of_key(key), (*columns, *own), tuple(numbers), rows)
