"""The worked solution on pages: everything inside the margins, nothing over anything else, drawings to scale."""

from __future__ import annotations

from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from matplotlib.figure import Figure
from PIL import Image

import planar
from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.analysis.polygons.polygon import Meeting
from planar.analysis.rich_text import Chord, Fraction, MeasuredValue, Name, PolygonLetter, Power, Symbol
from planar.analysis.worked.published import compare_published
from planar.drawing.labels.mathtext import formula
from planar.drawing.labels.typesetting import BODY_STYLE, split_words, typeset_lines
from planar.drawing.output.page_layout import (
    MARGIN,
    PAGE_NUMBER_HEIGHT,
    TEXT_WIDTH,
    PageColumn,
    lay_out_pages,
    paragraph,
    table_strips,
)
from planar.drawing.output.solution_pages import encode_sheets, solution_pages
from planar.drawing.paper.scales import parse_scale, parse_scales
from planar.foundation.errors import BadInput
from tests.command import run
from tests.draws import first_cases
from tests.hostile import NAMES, hostile_document

A4 = (210.0, 297.0)
POINT = 25.4 / 72.0
FAR = 1e-6
TABLES = ("glyf", "GSUB", "GPOS", "GDEF", "BASE", "MATH", "kern")


@cache
def pages(model: str) -> list[Figure]:
    state = planar.solve(planar.load(model))
    return solution_pages(state, compare_published(state))


@cache
def document(model: str) -> bytes:
    return encode_sheets(pages(model), ".pdf")


def characters(page: pypdfium2.PdfPage) -> np.ndarray:
    """The boxes of all inked characters (n, 4): left, bottom, right, top in mm."""
    text = page.get_textpage()
    told = text.get_text_range(0, text.count_chars())
    boxes = [text.get_charbox(k) for k in range(text.count_chars()) if told[k : k + 1].strip()]
    # the characters of a ligature have one box
    alone = dict.fromkeys(box for box in boxes if box[2] > box[0] and box[3] > box[1])
    return POINT * np.array(list(alone)).reshape(-1, 4)


def covered(boxes: np.ndarray) -> np.ndarray:
    """For every two boxes, how much of the smaller one the other covers; none where both are in one formula."""
    left, low, right, high = boxes.T
    across = np.minimum.outer(right, right) - np.maximum.outer(left, left)
    up = np.minimum.outer(high, high) - np.maximum.outer(low, low)
    both = across.clip(0.0) * up.clip(0.0)
    area = (right - left) * (high - low)
    part = both / np.minimum(area[:, None], area[None, :])
    index = np.arange(len(boxes))
    part[np.abs(index[:, None] - index[None, :]) <= 4] = 0.0
    return part


@pytest.mark.parametrize("model", first_cases(["double-butterfly", "planetary-gear-set", "002-E3.1", "004-OABQ"], 2))
def test_texts_are_inside_the_margins_and_none_is_over_another(model: str) -> None:
    for page in pypdfium2.PdfDocument(document(model)):
        assert np.array(page.get_size()) * POINT == pytest.approx(A4, abs=0.1)
        boxes = characters(page)
        assert len(boxes) > 30
        assert boxes[:, 0].min() >= MARGIN - 0.2
        assert boxes[:, 2].max() <= A4[0] - MARGIN + 0.2
        assert boxes[:, 1].min() >= MARGIN - 0.2
        assert boxes[:, 3].max() <= A4[1] - MARGIN + 0.2
        over = covered(boxes)
        assert over.max() < 0.45, (boxes[np.unravel_index(over.argmax(), over.shape)[0]], over.max())


def test_formulas_stand_on_the_base_line_of_their_sentence() -> None:
    """The letters of "Vel. of C rel. to D" have one base line, upright and slanted ones."""
    found = 0
    for page in pypdfium2.PdfDocument(document("002-E3.1")):
        text = page.get_textpage()
        told = text.get_text_range(0, text.count_chars())
        start = told.find("Vel. of C rel. to D")
        if start >= 0:
            found += 1
            bottoms = [
                text.get_charbox(start + k)[1] for k, each in enumerate("Vel. of C rel. to D") if each in "VlfrD"
            ]
            assert np.ptp(bottoms) * POINT < 0.15
    assert found


def axes_of(figures: list[Figure], title: str) -> tuple[Figure, object]:
    (found,) = [(figure, axes) for figure in figures for axes in figure.axes if axes.get_label() == title]
    return found


@pytest.mark.parametrize("kind", ["velocity", "acceleration"])
def test_vectors_are_as_long_on_the_page_as_their_scale_says(kind: str) -> None:
    state = planar.solve(planar.load("002-E3.1"))
    told = {"velocity": "1 cm = 0.08 m/s", "acceleration": "1 cm = 1.25 m/s^2"}
    used = parse_scales(tuple(told.values()))
    figure, axes = axes_of(solution_pages(state, (), used), f"{kind.capitalize()} polygon")
    polygon = velocity_polygon(state) if kind == "velocity" else acceleration_polygon(state)
    box = axes.get_position()
    across, up = figure.get_size_inches() * 25.4
    assert box.width * across == pytest.approx(np.ptp(axes.get_xlim()), abs=FAR)
    assert box.height * up == pytest.approx(np.ptp(axes.get_ylim()), abs=FAR)
    assert (box.x0 * across, box.y0 * up) >= (MARGIN, MARGIN + PAGE_NUMBER_HEIGHT)
    parts = {"rotation": "velocity"}
    drawn = {each.get_gid(): each for each in axes.get_children() if each.get_gid()}
    per_mm = {"velocity": 0.008, "acceleration": 0.125}[kind]
    vectors = [
        v for stage in polygon.stages if isinstance(stage, Meeting) for side in stage.sides for v in side.vectors
    ]
    assert vectors
    for vector in vectors:
        name = f"{parts.get(vector.part.value, vector.part.value)} {vector.of}/{vector.against}"
        tail = drawn[name].get_xydata()[0]
        tip = drawn[f"{name} head"].get_xy()[0]
        assert tip - tail == pytest.approx(vector.value / per_mm, abs=1e-6)


def test_lengths_on_paper_follow_the_given_scale() -> None:
    state = planar.solve(planar.load("002-E3.1"))
    figures = solution_pages(state, (), {"acceleration": parse_scale("1 cm = 2 m/s^2")})
    text = " ".join(
        page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(encode_sheets(figures, ".pdf"))
    ).replace("\r\n", " ")
    for words_ in ("5.51 m/s² (27.6 mm)", "1 cm = 2 m/s²", "Four-bar chain, crank slowing down", "To find", "Results"):
        assert words_ in text


def test_pages_of_one_solution_are_one_picture_or_one_document() -> None:
    figures = pages("double-butterfly")
    picture = Image.open(BytesIO(encode_sheets(figures, ".png")))
    assert picture.size == (1240, 1753 * len(figures)) or picture.size == (1240, 1754 * len(figures))
    ink = np.asarray(picture.convert("L"))
    assert ink.min() < 60
    height = picture.size[1] // len(figures)
    for k in range(len(figures)):
        part = ink[k * height : (k + 1) * height]
        assert (part < 128).any()
        edge = int(17.0 / 25.4 * 150)
        assert (part[:, :edge] > 200).all()
    assert len(pypdfium2.PdfDocument(document("double-butterfly"))) == len(figures)


def test_no_formula_is_read_by_matplotlib_and_words_are_drawn_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """That takes milliseconds for each of some hundreds, and a text of its own for every word nearly as long."""

    def parse(*words: object) -> None:
        raise AssertionError(words)

    monkeypatch.setattr("matplotlib.mathtext.MathTextParser.parse", parse)
    figures = solution_pages(planar.solve(planar.load("ten-link")))
    assert len(encode_sheets(figures, ".pdf")) > 1000
    texts = [text.get_text() for figure in figures for text in figure.texts]
    assert any(r"\omega" in text for text in texts)
    assert len(texts) < sum(len(text.split()) for text in texts) / 2.0


def test_the_same_solution_is_the_same_file() -> None:
    first, second = (encode_sheets(solution_pages(planar.solve(planar.load("single-link"))), ".pdf") for _ in range(2))
    assert first == second


def test_a_scale_too_large_for_a_page_is_refused() -> None:
    state = planar.solve(planar.load("002-E3.1"))
    with pytest.raises(BadInput, match=r"velocity polygon takes .* more than a page"):
        solution_pages(state, (), parse_scales(["1 cm = 0.01 m/s"]))


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
def test_hostile_names_are_set_as_they_are() -> None:
    figures = solution_pages(planar.solve(planar.from_dict(hostile_document())))
    text = "".join(
        page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(encode_sheets(figures, ".pdf"))
    )
    for name in NAMES[:4]:
        assert name in text
    encode_sheets(figures, ".png")


def test_the_command_writes_pages(tmp_path: Path) -> None:
    ended = run(tmp_path, "explain", "four-bar", "-o", "solution.pdf")
    assert (ended.status, ended.out, ended.err) == (0, "", "")
    text = "".join(page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(tmp_path / "solution.pdf"))
    assert "assembly 1 of 2" in text
    # what is handed out speaks of no option of a command
    assert "--" not in text
    assert "`" not in text


# formulas and lines


def test_pieces_are_formulas_only_where_their_names_are_simple() -> None:
    fraction = Fraction((Power(("(", Chord(PolygonLetter("a"), PolygonLetter("b")), ")"), 2),), (Name("AB"),))
    assert formula(fraction) == (r"\dfrac{\mathrm{(}\mathit{a}\mathit{b}\mathrm{)}^{\mathrm{2}}}{\mathit{AB}}")
    assert formula(Symbol("f", "cb", "c")) == r"\mathit{f}_{\mathit{cb}}^{c}"
    for piece in (
        Name("$x"),
        Symbol("ω", "a_b^"),
        PolygonLetter("\\frac{"),
        Chord(PolygonLetter("<b>"), PolygonLetter("b")),
        Symbol("ω", "$"),
    ):
        assert formula(piece) is None
        assert not any(each.math for word in split_words((piece,)) for each in word)


@pytest.mark.parametrize("width", [20.0, 60.0, 170.0])
def test_lines_are_no_wider_than_they_may_be(width: float) -> None:
    phrase = (
        "A sentence with ",
        Chord(PolygonLetter("a", "1"), PolygonLetter("b", "a")),
        " = ",
        MeasuredValue(5.51, "m/s^2"),
        " and averyveryverylongwordthatfitsnowhereatallbecauseitgoesonandonandonandon",
        " and an end.",
    )
    rows = typeset_lines(phrase, width, BODY_STYLE)
    assert max(row.width for row in rows) <= width + FAR
    written = "".join(each.text for row in rows for _, each in row.atoms if not each.math)
    assert "longwordthatfitsnowhere" in written
    assert written.endswith("end.")


def test_a_long_table_has_its_head_on_every_page() -> None:
    columns = [PageColumn("Number"), PageColumn("Value", align_right=True)]
    figures = lay_out_pages(table_strips(columns, [((f"row {k}",), (f"{k}",)) for k in range(120)]))
    assert len(figures) > 2
    told = [[text.get_text() for text in figure.texts] for figure in figures]
    for texts in told:
        assert texts.count("Number") == 1
        assert f"/ {len(figures)}" in " ".join(texts)
    assert sum(text.startswith("row ") for texts in told for text in texts) == 120


def test_what_is_higher_than_a_page_ends_nowhere_in_a_loop() -> None:
    cell = ("word " * 3000,)
    figures = lay_out_pages(table_strips([PageColumn("a"), PageColumn("b")], [(("1",), cell), (("2",), ("x",))]))
    assert 1 <= len(figures) <= 4


def test_a_heading_stays_with_what_it_heads() -> None:
    strips = [
        *(
            strip
            for k in range(200)
            for strip in (*paragraph((f"Head {k}",), keep_with_next=True), *paragraph((f"text {k}",)))
        )
    ]
    for figure in lay_out_pages(strips):
        texts = [text.get_text().split()[0] for text in figure.texts[:-1]]
        assert texts[-1] == "text"
        assert texts[0] == "Head"
    assert A4[0] - 2.0 * MARGIN == TEXT_WIDTH


def test_embedded_fonts_hold_outlines_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """No ligatures and no kerning are read, cut down or written: with them fonts take longer than all else."""
    from fontTools.subset import Options, Subsetter
    from fontTools.ttLib import TTFont

    cut: list[set[str]] = []
    subset = Subsetter.subset

    def counted(self: Subsetter, font: TTFont) -> None:
        subset(self, font)
        cut.append({tag for tag in TABLES if tag in font})

    before = list(Options()._drop_tables_default)
    monkeypatch.setattr(Subsetter, "subset", counted)
    figures = solution_pages(planar.solve(planar.load("four-bar")))
    text = pypdfium2.PdfDocument(encode_sheets(figures, ".pdf"))[0].get_textpage().get_text_range()
    # upright, slanted and bold, of the drawings' family and of the pages'
    assert 0 < len(cut) <= 6
    for tables in cut:
        assert tables == {"glyf"}
    assert "Given" in text
    assert "ω" in text
    assert Options()._drop_tables_default == before
