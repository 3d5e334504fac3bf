"""Strips of a page: lines, tables and pictures one below the other, broken over as many pages as they take."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from planar.analysis.rich_text import PaperScale, Phrase
from planar.drawing.labels.typesetting import (
    BODY_STYLE,
    TextStyle,
    TypesetLine,
    TypesetPage,
    baseline_offset,
    blank_page,
    line_height,
    typeset_lines,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH, PAGE_HEIGHT = 210.0, 297.0
"""mm: A4, upright."""
MARGIN = 18.0
"""mm on every side."""
PAGE_NUMBER_HEIGHT = 8.0
"""mm above the lower margin, kept for the number of the page."""
TEXT_WIDTH = PAGE_WIDTH - 2.0 * MARGIN
"""mm that a line may be wide."""
USABLE_HEIGHT = PAGE_HEIGHT - 2.0 * MARGIN - PAGE_NUMBER_HEIGHT
"""mm of a page that strips may take."""
COLUMN_GAP = 4.0
"""mm between the columns of a table."""
DRAWING_GAP = 5.0
"""mm below a drawing on top of a page."""
UNBROKEN_TABLE_HEIGHT = 70.0
"""mm: rows of a table that take no more stay on one page."""
THICK_RULE, THIN_RULE = 0.35, 0.18
"""mm: the rules above and below a table, and those inside it."""


class Strip(NamedTuple):
    """What takes the width of the page and is not broken: drawn from its upper left corner (mm on the sheet)."""

    height: float
    draw: Callable[[TypesetPage, float, float], None]
    keep_with_next: bool = False
    "stays on one page with the next"
    space_before: float = 0.0
    "mm above it, unless it begins a page"
    repeated_head: Strip | None = None
    "stands above it once more where it begins a page: the head of a table"
    is_float: bool = False
    "waits for the next page where it does not fit, and lets what follows go first: a drawing"


def lay_out_pages(strips: Iterable[Strip]) -> list[Figure]:
    """Strips on pages with numbers. A strip higher than a page is the caller's fault."""
    book = _PageFiller()
    for group in _kept_groups(strips):
        book.add(group)
    while book.waiting:
        book.start_page()
    for number, page in enumerate(book.pages, 1):
        (row,) = typeset_lines((f"{number} / {len(book.pages)}",), TEXT_WIDTH, TextStyle(9.0))
        page.draw_line(row, (PAGE_WIDTH - row.width) / 2.0, MARGIN + row.descent)
    return [page.figure for page in book.pages]


class _PageFiller:
    """Pages while they are filled: `y` is how far down the last one is full (mm from below)."""

    def __init__(self) -> None:
        self.pages: list[TypesetPage] = []
        self.waiting: list[Strip] = []
        self.y = self.page_top = 0.0

    def add(self, group: Sequence[Strip]) -> None:
        """Strips that stay together."""
        if not self.pages:
            self.start_page()
        if group[0].is_float and (self.waiting or not self._fits(group)):
            self.waiting.append(group[0])
            return
        while not self._fits(group):
            self.start_page()
            if group[0].repeated_head is not None:
                self._draw_strip(group[0].repeated_head)
                self.page_top = self.y
        for strip in group:
            self._draw_strip(strip)

    def start_page(self) -> None:
        """A new page, with as many waiting drawings on top as it holds."""
        self.pages.append(blank_page(PAGE_WIDTH, PAGE_HEIGHT))
        self.y = self.page_top = PAGE_HEIGHT - MARGIN
        while self.waiting and self._fits(self.waiting[:1]):
            self._draw_strip(self.waiting.pop(0))
            self.y -= DRAWING_GAP

    def _fits(self, group: Sequence[Strip]) -> bool:
        tall = sum(strip.height + strip.space_before for strip in group)
        if self.y == self.page_top:
            tall -= group[0].space_before
        # what is higher than an empty page has to go somewhere
        return self.y - tall >= MARGIN + PAGE_NUMBER_HEIGHT - 1e-6 or (
            self.y == self.page_top and tall > self.page_top - MARGIN - PAGE_NUMBER_HEIGHT
        )

    def _draw_strip(self, strip: Strip) -> None:
        self.y -= 0.0 if self.y == self.page_top else strip.space_before
        strip.draw(self.pages[-1], MARGIN, self.y)
        self.y -= strip.height


def _kept_groups(strips: Iterable[Strip]) -> Iterator[tuple[Strip, ...]]:
    """Strips that stay together; a group that no page could hold is let go."""
    group: list[Strip] = []
    for strip in strips:
        group.append(strip)
        if not strip.keep_with_next:
            yield from _fitting_group(group)
            group = []
    yield from _fitting_group(group)


def _fitting_group(group: Sequence[Strip]) -> Iterator[tuple[Strip, ...]]:
    if group and sum(strip.height + strip.space_before for strip in group) <= USABLE_HEIGHT:
        yield tuple(group)
    else:
        yield from ((strip,) for strip in group)


def paragraph(
    phrase: Phrase,
    style: TextStyle = BODY_STYLE,
    paper: Mapping[str, PaperScale] | None = None,
    label: str = "",
    indent: float = 0.0,
    space_before: float = 0.0,
    keep_with_next: bool = False,
    centred: bool = False,
) -> Iterator[Strip]:
    """A paragraph, a strip a line; `label` hangs in the indent (mm); `keep` holds it on a page with what follows."""
    rows = typeset_lines(phrase, TEXT_WIDTH - indent, style, paper)
    marks = typeset_lines((label,), TEXT_WIDTH, style) if label else []
    for index, row in enumerate(rows):
        mark = marks[0] if marks and not index else None
        start = (TEXT_WIDTH - row.width) / 2.0 if centred else indent
        # neither the first nor the last line of a paragraph stands alone
        together = keep_with_next or index == 0 < len(rows) - 1 or index == len(rows) - 2
        yield Strip(
            line_height(row, style.size),
            _line_drawer(row, mark, start, style),
            together,
            0.0 if index else space_before,
        )


def _line_drawer(
    row: TypesetLine, mark: TypesetLine | None, start: float, style: TextStyle
) -> Callable[[TypesetPage, float, float], None]:
    def draw(page: TypesetPage, x: float, y: float) -> None:
        page.draw_line(row, x + start, y - baseline_offset(row, style.size))
        if mark is not None:
            page.draw_line(mark, x + start - mark.width - 1.5, y - baseline_offset(row, style.size))

    return draw


class PageColumn(NamedTuple):
    """A column of a table: its heading, and whether its cells stand to the right, as numbers do."""

    heading: str
    align_right: bool = False


def table_strips(
    columns: Sequence[PageColumn],
    cells: Sequence[Sequence[Phrase]],
    size: float = 9.5,
    space_before: float = 2.0,
    title: str = "",
) -> Iterator[Strip]:
    """A table with rules, its head repeated where it goes on to another page."""
    style, heavy = TextStyle(size), TextStyle(size, heavy=True)
    heads: list[Phrase] = [(column.heading,) for column in columns]
    natural = [
        max(_natural_width(heads[k], heavy), *(_natural_width(row[k], style) for row in cells), 5.0)
        for k in range(len(columns))
    ]
    widths = _share_width(natural, TEXT_WIDTH - COLUMN_GAP * (len(columns) - 1))
    if title:
        yield from paragraph((title,), TextStyle(10.0, heavy=True), space_before=space_before, keep_with_next=True)
        space_before = 0.8
    head = _table_row(heads, widths, columns, heavy, (THICK_RULE, THIN_RULE))
    yield head._replace(space_before=space_before, keep_with_next=True)
    rows = [
        _table_row(row, widths, columns, style, (0.0, THICK_RULE if index == len(cells) - 1 else 0.0))
        for index, row in enumerate(cells)
    ]
    short = sum(row.height for row in rows) <= UNBROKEN_TABLE_HEIGHT
    for index, row in enumerate(rows):
        # no row stands alone at the foot of a page, nor on top of one
        yield row._replace(
            repeated_head=head, keep_with_next=index < len(rows) - 1 and (short or index in (0, len(rows) - 2))
        )


def _natural_width(phrase: Phrase, style: TextStyle) -> float:
    return max((row.width for row in typeset_lines(phrase, 1e6, style)), default=0.0)


def _share_width(natural: Sequence[float], width: float) -> list[float]:
    """Widths of columns: as wide as they would be, the widest cut to one width until all fit."""
    low, high = 0.0, max(natural, default=0.0)
    if sum(natural) <= width:
        return list(natural)
    for _ in range(60):
        cut = (low + high) / 2.0
        low, high = (cut, high) if sum(min(each, cut) for each in natural) <= width else (low, cut)
    return [min(each, low) for each in natural]


def _table_row(
    cells: Sequence[Phrase],
    widths: Sequence[float],
    columns: Sequence[PageColumn],
    style: TextStyle,
    rules: tuple[float, float],
) -> Strip:
    """A row of cells, with a rule above and below it where its thickness is not zero."""
    # a hair more, so that a cell as wide as its column is one line
    rows = [typeset_lines(cell, width + 1e-6, style) for cell, width in zip(cells, widths, strict=True)]
    pad = 0.6
    tall = max((sum(line_height(row, style.size) for row in each) for each in rows), default=0.0) + 2.0 * pad
    whole = sum(widths) + COLUMN_GAP * (len(widths) - 1)

    def draw(page: TypesetPage, x: float, y: float) -> None:
        for at, thick in ((y, rules[0]), (y - tall, rules[1])):
            if thick:
                page.draw_rule((x, x + whole), at, thick)
        left = x
        for each, width, column in zip(rows, widths, columns, strict=True):
            down = y - pad - (tall - 2.0 * pad - sum(line_height(row, style.size) for row in each)) / 2.0
            for row in each:
                page.draw_line(
                    row,
                    left + (width - row.width if column.align_right else 0.0),
                    down - baseline_offset(row, style.size),
                )
                down -= line_height(row, style.size)
            left += width + COLUMN_GAP

    return Strip(tall, draw)
