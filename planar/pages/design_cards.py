"""The gallery of the designs for a task: a card each, with its drawing over what was wanted, and a table of all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from math import isnan
from typing import NamedTuple
from urllib.parse import quote

from planar.document.dimensions import file_dimensions
from planar.document.files import read_asset
from planar.drawing.designs.design_picture import closeup_picture, design_picture
from planar.drawing.designs.function_picture import function_picture
from planar.drawing.diagrams.dyad_drawing import drawn_curves, dyad_pictures
from planar.drawing.output.svg import pen_variable, svg
from planar.drawing.paper.pens import PEN_STYLES
from planar.drawing.paper.picture import Pen
from planar.model.wording import amount, count_phrase
from planar.pages.overlay_style import LAYER_COLOURS
from planar.pages.page import fill_template
from planar.reports.number_format import format_number
from planar.reports.tables.design.design_columns import DesignColumn
from planar.reports.tables.design.synthesis import input_text
from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, ExactDesign
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign
from planar.synthesis.task.starts import miss_text
from planar.synthesis.task.synthesis_task import WantedFunction

STYLES = ("page.css", "designs/designs.css", "print.css")
LEGEND = '<span><i class="wanted"></i>wanted</span><span><i class="path"></i>made by the design</span>'
DARK_PENS = {
    Pen.PATH: LAYER_COLOURS["centrode"][1],
    Pen.WANTED: LAYER_COLOURS["wanted"][1],
    Pen.ACCELERATION: LAYER_COLOURS["acceleration"][1],
    Pen.INPUT: "#ffa45c",
    Pen.FIXED_CENTRODE: LAYER_COLOURS["centrode"][1],
    Pen.MOVING_CENTRODE: LAYER_COLOURS["velocity"][1],
    Pen.PITCH: "#a3a9b0",
    Pen.BAND: "#c9ced4",
}
"""Colours of pens where the page is dark."""


class GalleryCard(NamedTuple):
    """A design with its name, and the files that its card leads to."""

    name: str
    design: SynthesisedDesign
    page: str | None
    file: str
    cognates: list[str]


def gallery_page(found: Synthesis, cards: Sequence[GalleryCard], columns: Sequence[DesignColumn], table: str) -> str:
    """The page of all designs: those that do the task, those rejected with their defects, and the table of all."""
    sound = [each for each in cards if not each.design.defects]
    rejected = [each for each in cards if each.design.defects]
    curves = _curves_section(found)
    sections = [curves] if curves else []
    sections += [_cards_section("designs", "Designs", found, sound)] if sound else []
    others = "With a defect" if isinstance(found, CompleteSynthesis) else "Rejected"
    sections += [_cards_section("rejected", others, found, rejected)] if rejected else []
    sections += [_table_section(columns, table)] if cards else []
    links = (
        [("dyads", "Dyads")] * bool(curves)
        + [("designs", "Designs")] * bool(sound)
        + [("rejected", others)] * bool(rejected)
    )
    links += [("table", "Table")] * bool(cards)
    styles = [*map(read_asset, STYLES), _dark_pens()]
    entries = count_phrase(found.task.entry_count, "entry is wanted", "entries are wanted")
    refused = f", the best {len(rejected)} of those rejected" if rejected else ""
    if rejected and isinstance(found, CompleteSynthesis):
        refused = f" and {len(rejected)} with a defect"
    counts = f"{entries}; {count_phrase(len(sound), 'design')}{refused}"
    summary = found.summary if isinstance(found, CompleteSynthesis) else ()
    remarks = "".join(f"<li>{escape(each)}</li>" for each in (*summary, *found.remarks))
    parts = {
        "title": escape(found.task.name),
        "styles": "\n".join(styles),
        "summary": escape(counts),
        "legend": LEGEND if cards else "",
        "links": "".join(f'<a href="#{name}">{told}</a>' for name, told in links) + '<a href="task.json">Task</a>',
        "sections": (f'<ul class="remarks">{remarks}</ul>' if remarks else "") + "\n".join(sections),
    }
    return fill_template(read_asset("designs/designs.html"), parts)


def _dark_pens() -> str:
    """The colours of pens where the page is dark."""
    told = " ".join(f"{pen_variable(PEN_STYLES[pen].colour)}: {dark};" for pen, dark in DARK_PENS.items())
    return f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {told} }} }}"


def _curves_section(found: Synthesis) -> str:
    """The curves of dyads that poses leave."""
    if not isinstance(found, CompleteSynthesis) or not drawn_curves(found):
        return ""
    pictures, heading = dyad_pictures(found)
    figures = "".join(  # without the last note, the scale, which is that of paper
        f"<figure>{svg(each, heading)}<figcaption>{'<br>'.join(map(escape, each.notes[:-1]))}</figcaption></figure>"
        for each in pictures
    )
    return f'<section id="dyads"><h2>Dyads</h2>{figures}</section>'


def _cards_section(name: str, heading: str, found: Synthesis, cards: Sequence[GalleryCard]) -> str:
    items = "\n".join(_card(found, each) for each in cards)
    return f'<section id="{name}"><h2>{heading}</h2><ul class="cards">{items}</ul></section>'


def _card(found: Synthesis, card: GalleryCard) -> str:
    design = card.design
    title = escape(f"{card.name}: {design.start}")
    head = title if card.page is None else f'<a href="{quote(card.page)}">{title}</a>'
    defects = "".join(f"<li>{escape(each)}</li>" for each in design.defects)
    facts = "".join(f"<dt>{escape(name)}</dt><dd>{escape(told)}</dd>" for name, told in _facts(found, design))
    links = [] if card.page is None else [(card.page, "Page")]
    links += [(card.file, "Mechanism file")]
    links += [(file, f"Cognate {number}") for number, file in enumerate(card.cognates, start=1)]
    files = "".join(f'<li><a href="{quote(file)}">{told}</a></li>' for file, told in links)
    return (
        f'<li id="{card.name}"><h3>{head}</h3>{"".join(_figures(found, design))}'
        f"{f'<ul class=defects>{defects}</ul>' if defects else ''}<dl>{facts}</dl>"
        f"{_details('Dimensions', _dimensions(found, design))}{_details('Misses', _misses(found, design))}"
        f'<ul class="files">{files}</ul></li>'
    )


def _figures(found: Synthesis, design: SynthesisedDesign) -> Iterator[str]:
    """The drawing of a design, and the diagrams of its functions."""
    name = design.mechanism.name
    drawing = design_picture(design, found.task)
    yield f"<figure>{svg(drawing, name)}</figure>"
    closeup = closeup_picture(design, found.task, drawing)
    if closeup is not None:
        told = "What is wanted, enlarged"
        yield f'<figure class="closeup">{svg(closeup, told)}<figcaption>{told}</figcaption></figure>'
    for item, wanted in enumerate(found.task.wanted):
        if not isinstance(wanted, WantedFunction):
            continue
        drawn = function_picture(design, found.task, item)
        if drawn is not None:
            told = f"{drawn.title}, wanted and made; below, the error"
            yield f'<figure class="function">{svg(drawn, told)}<figcaption>{escape(told)}</figcaption></figure>'


def _facts(found: Synthesis, design: SynthesisedDesign) -> Iterator[tuple[str, str]]:
    """What is told of a design beside its drawing."""
    units = found.task.units
    if not isnan(design.error):
        share = f", {100.0 * design.greatest_miss / found.size:.3g} % of the size"
        greatest = miss_text(found.task, design.greatest_miss, found.size)
        yield "greatest miss", greatest + (share if found.task.wants_places else "")
        yield "root mean square", miss_text(found.task, design.error, found.size)
    if isinstance(design, ExactDesign):
        yield "proved", "yes" if design.certified else "no"
    if design.motion is None:
        return
    yield "input", input_text(found, design)
    for name, least in design.motion.transmission.items():
        yield f"transmission angle at {name}, least", amount(least.value, "angle", units)


def _dimensions(found: Synthesis, design: SynthesisedDesign) -> Iterator[tuple[str, str]]:
    """The numbers that were sought."""
    known = file_dimensions(design.mechanism)
    for name, value in design.numbers.items():
        kind = known[name].kind
        yield name, amount(value, kind, found.task.units) if kind in ("length", "angle") else format_number(value)


def _misses(found: Synthesis, design: SynthesisedDesign) -> Iterator[tuple[str, str]]:
    """What a design misses of every entry."""
    for wanted, own in zip(found.task.wanted, design.misses, strict=True):
        for number, miss in enumerate(own.tolist(), start=1):
            if not isnan(miss):
                yield f"{wanted.of} {number}", miss_text(found.task, miss, found.size)


def _details(heading: str, rows: Iterator[tuple[str, str]]) -> str:
    told = "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in rows)
    return f"<details><summary>{heading}</summary><dl>{told}</dl></details>" if told else ""


def _table_section(columns: Sequence[DesignColumn], file: str) -> str:
    """All designs in a table, which is also a file."""
    heads = "".join(f"<th{_text_class(each)}>{escape(each.head)}</th>" for each in columns)
    rows = []
    for row in zip(*(each.values for each in columns), strict=True):
        first, *rest = row
        cells = "".join(_cell(each, value) for each, value in zip(columns[1:], rest, strict=True))
        rows.append(f'<tr><th class="text"><a href="#{first}">{first}</a></th>{cells}</tr>')
    return (
        f'<section id="table"><h2>Table</h2><p><a href="{quote(file)}">{escape(file)}</a></p><div class="scroll">'
        f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def _cell(column: DesignColumn, value: str | float | None) -> str:
    if column.name == "defects":
        return f'<td class="defect">{escape(str(value or ""))}</td>'
    told = "" if value is None else value if isinstance(value, str) else format_number(value)
    return f"<td{_text_class(column)}>{escape(told)}</td>"


def _text_class(column: DesignColumn) -> str:
    return ' class="text"' if any(isinstance(each, str) for each in column.values) else ""
