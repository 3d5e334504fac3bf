"""A table that fits the width of a terminal with every number and every name whole."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Literal, NamedTuple

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

MAX_HEADING_WIDTH = 13
"""Characters: longer headings stand in several lines, so that the tables of a textbook mechanism fit 80 columns."""
MIN_COLUMN_WIDTH = 5
"""Characters that a column takes where there is room."""
KEPT_TEXT_WIDTH = 20
"""Characters that a long text keeps as long as there is another way to find room."""
COLUMN_GAP, EDGE_WIDTH = 2, 2
"""Characters between two columns, and beside all of them."""

Cell = str | Text


class TableColumn(NamedTuple):
    """A column: its name and its unit, whether words stand in it, and whether it belongs to the one before it."""

    name: str
    unit: str
    has_words: bool
    joins_previous: bool

    @property
    def lines(self) -> list[str]:
        """The heading in lines, the unit last; no word of it is broken."""
        named = wrap(self.name, MAX_HEADING_WIDTH, break_long_words=False, break_on_hyphens=False)
        return [*named, self.unit] if self.unit else named

    @property
    def label(self) -> str:
        """The heading in one line."""
        return ", ".join(filter(None, (self.name, self.unit)))


class ColumnWidths(NamedTuple):
    """Characters that a column takes with nothing broken, with its cells in two lines or so, and at the least."""

    natural: int
    soft: int
    hard: int


@dataclass(frozen=True)
class FittedTable:
    """Rows of cells under headings, which are broken between words alone.

    What is too wide for one table goes into several below each other, each with the first `keys` columns. What is too
    wide for that as well becomes a record for every row. What is too wide even so makes a line longer.
    """

    title: str | None
    columns: tuple[TableColumn, ...]
    keys: int = 1
    rows: list[tuple[Cell, ...]] = field(default_factory=list)

    def add_row(self, *cells: Cell) -> None:
        """A row: a cell for every column."""
        if len(cells) != len(self.columns):
            raise ValueError(f"{len(self.columns)} cells are wanted, not {len(cells)}")
        self.rows.append(cells)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment | RenderableType]:
        if self.title:
            yield Text(self.title, style="bold")
        parts = self._fitting_parts(options.max_width)
        if parts is None:
            for table, width in self._draw_records(options.max_width):
                # a table that cannot be narrower than the terminal is not to be cut by it
                yield from console.render(table, options.update_width(max(width, options.max_width)))
            return
        for part in parts:
            lines = None if console.record else self._plain_lines(part)
            if lines is None:
                width = max(_total_width(part.values()), options.max_width)
                yield from console.render(self._draw_table(part), options.update_width(width))
                continue
            for line, style in lines:
                yield Segment(line, console.get_style(style) if style else None)
                yield Segment.line()

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        parts = self._fitting_parts(options.max_width)
        if parts is None:
            widest = max((width for _, width in self._draw_records(options.max_width)), default=0)
        else:
            widest = max(_total_width(part.values()) for part in parts)
        return Measurement(widest, widest)

    def _fitting_parts(self, width: int) -> list[dict[int, int]] | None:
        """The columns of each table that fits, by number, with their widths; None where only records of rows do."""
        widths = [_column_widths(column, [row[k] for row in self.rows]) for k, column in enumerate(self.columns)]
        return _split_columns(self.columns, self.keys, widths, width)

    def _plain_lines(self, widths: dict[int, int]) -> list[tuple[str, str]] | None:
        """The lines of `_draw_table`, each with the name of its style, many times as fast; None where a cell has a
        style, is broken, or is not of printable characters alone."""
        headings = [self.columns[k].lines for k in widths]
        most = max(map(len, headings), default=0)
        rows = [[([""] * most + lines)[len(lines) + row] for lines in headings] for row in range(most)]
        for row in self.rows:
            cells = [row[k] for k in widths]
            if any(isinstance(cell, Text) and (cell.style or cell.spans) for cell in cells):
                return None
            rows.append([cell.plain if isinstance(cell, Text) else cell for cell in cells])
        lines = []
        for texts in rows:
            line = []
            for text, (k, width) in zip(texts, widths.items(), strict=True):
                room = width - cell_len(text)
                if room < 0 or not text.isprintable():
                    return None
                line.append(text + " " * room if self.columns[k].has_words else " " * room + text)
            lines.append(f" {(' ' * COLUMN_GAP).join(line)} ")
        width = _total_width(widths.values())
        blank, rule = (" " * width, ""), (f" {SIMPLE_HEAD.head_row_horizontal * (width - EDGE_WIDTH)} ", "")
        head = [(line, "table.header") for line in lines[:most]]
        return [blank, *head, rule, *((line, "") for line in lines[most:]), blank]

    def _draw_table(self, widths: dict[int, int]) -> Table:
        """Some of the columns, by their numbers, with the width of each."""
        table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
        for k, width in widths.items():
            column = self.columns[k]
            justify: Literal["left", "right"] = "left" if column.has_words else "right"
            table.add_column("\n".join(column.lines), justify=justify, overflow="fold", width=width)
        for row in self.rows:
            table.add_row(*(row[k] for k in widths))
        return table

    def _draw_records(self, width: int) -> Iterator[tuple[Table, int]]:
        """A table for every row, each with the characters that it takes."""
        return (self._draw_record(row, width) for row in self.rows)

    def _draw_record(self, row: Sequence[Cell], room: int) -> tuple[Table, int]:
        """A row by itself: every cell behind its heading."""
        both = zip(self.columns, row, strict=True)
        told = [(Text(column.label), cell) for column, cell in both if column.label or str(cell)]
        widths = [_cell_widths([each[k] for each in told]) for k in (0, 1)]
        wide = _spread_widths(widths, [each.hard for each in widths], room) or [each.hard for each in widths]
        table = Table(box=None, show_header=False, padding=(0, 1, 0, 1), pad_edge=True)
        for width in wide:
            table.add_column(overflow="fold", width=width)
        for each in told:
            table.add_row(*each)
        table.add_row("", "")
        return table, _total_width(wide)


def plain_table(
    title: str | None, *headings: str | tuple[str, ...], left: tuple[int, ...] = (0,), keys: int = 1
) -> FittedTable:
    """An empty table; of a heading "name, unit" the unit stands below the name.

    Headings in a tuple stand side by side at any width, as a magnitude and its direction. Words stand in the columns of
    the numbers `left`, numbers in the others; the first `keys` columns say what a row is of.
    """
    columns: list[TableColumn] = []
    for group in headings:
        for index, heading in enumerate((group,) if isinstance(group, str) else group):
            name, _, unit = heading.partition(", ")
            words = len(columns) in left or heading == "sense"
            columns.append(TableColumn(name, unit, words, index > 0))
    return FittedTable(title, tuple(columns), keys)


def _split_columns(
    columns: Sequence[TableColumn], keys: int, widths: Sequence[ColumnWidths], room: int
) -> list[dict[int, int]] | None:
    """The columns of each table, by number, with their widths; None where they do not fit in any number of tables."""
    every = list(range(len(columns)))
    soft, hard = ([getattr(each, how) for each in widths] for how in ("soft", "hard"))
    whole = [soft, hard] if all(column.has_words for column in columns) else [soft]
    for least in whole:
        found = _spread_widths(widths, least, room)
        if found is not None:
            return [dict(zip(every, found, strict=True))]
    groups: list[list[int]] = []
    for k in every[keys:]:
        if columns[k].joins_previous and k > keys:
            groups[-1].append(k)
        else:
            groups.append([k])
    return _pack_groups(every[:keys], groups, widths, soft, room) or _pack_groups(
        every[:keys], groups, widths, hard, room
    )


def _pack_groups(
    keys: list[int], groups: Sequence[list[int]], widths: Sequence[ColumnWidths], least: Sequence[int], room: int
) -> list[dict[int, int]] | None:
    """As many groups of columns in each table as fit beside the keys."""
    filled: list[list[int]] = []
    for group in groups:
        if filled and _total_width(least[k] for k in (*filled[-1], *group)) <= room:
            filled[-1] += group
        else:
            filled.append([*keys, *group])
    found = []
    for part in filled:
        spread = _spread_widths([widths[k] for k in part], [least[k] for k in part], room)
        if spread is None:
            return None
        found.append(dict(zip(part, spread, strict=True)))
    return found


def _spread_widths(widths: Sequence[ColumnWidths], least: Sequence[int], room: int) -> list[int] | None:
    """The widths of columns side by side, the widest narrowed first; None where they do not fit."""
    if _total_width(least) > room:
        return None
    most = max((each.natural for each in widths), default=0)
    while True:
        found = [max(low, min(each.natural, most)) for each, low in zip(widths, least, strict=True)]
        if _total_width(found) <= room:
            return found
        most -= 1


def _total_width(widths: Iterable[int]) -> int:
    """The characters that columns of these widths take side by side."""
    told = list(widths)
    return sum(told) + COLUMN_GAP * (len(told) - 1) + EDGE_WIDTH


def _column_widths(column: TableColumn, cells: Sequence[Cell]) -> ColumnWidths:
    found, heading = _cell_widths(cells), max(map(cell_len, column.lines), default=0)
    return ColumnWidths(
        max(found.natural, heading, MIN_COLUMN_WIDTH), max(found.soft, heading), max(found.hard, heading)
    )


def _cell_widths(cells: Sequence[Cell]) -> ColumnWidths:
    texts = [cell.plain if isinstance(cell, Text) else cell for cell in cells]
    natural = max(map(cell_len, texts), default=0)
    hard = max((cell_len(word) for text in texts for word in _words(text)), default=0)
    soft = hard
    while soft < min(natural, KEPT_TEXT_WIDTH) and any(_count_lines(text, soft) > 2 for text in texts):
        soft += 1
    return ColumnWidths(natural, soft, hard)


def _words(text: str) -> list[str]:
    """The words of a text, the first one with what it is set in by."""
    words = text.split()
    if words:
        words[0] = text[: len(text) - len(text.lstrip())] + words[0]
    return words


def _count_lines(text: str, width: int) -> int:
    """How many lines a text takes."""
    count, taken = 1, -1
    for word in _words(text):
        taken += 1 + cell_len(word)
        if taken > width:
            count, taken = count + 1, cell_len(word)
    return count
