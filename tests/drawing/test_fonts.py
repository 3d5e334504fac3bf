"""Texts are set in fonts that have their characters, and formulas as matplotlib would set them."""

import json

import pypdfium2
import pytest

import planar
from planar.drawing.labels.fonts import DRAWING_FAMILY, UNKNOWN_CHARACTER, font_families, printable_text, select_fonts
from planar.drawing.labels.text_line import text_line
from planar.drawing.labels.text_metrics import text_size
from planar.drawing.output.matplotlib_figure import draw_pictures, encode_figure
from planar.drawing.output.solution_pages import encode_sheets, solution_pages
from planar.drawing.paper.pens import MM_PER_POINT
from planar.drawing.paper.picture import Label, Pen, Picture, Polyline
from planar.foundation.errors import MissingGlyphs
from tests.builders import four_bar_document
from tests.command import run
from tests.fonts import ADVANCE, EM, HEIGHT, made, own_fonts  # noqa: F401

LINE = Polyline(((0.0, 0.0), (40.0, 0.0)), Pen.LINK)


def table(**fonts):
    return [(name, characters.__contains__) for name, characters in fonts.items()]


@pytest.mark.parametrize(
    ("fonts", "wanted", "found"),
    [
        ({"one": "ab", "two": "abc", "three": "abcd"}, "abc", ["two"]),
        ({"one": "ab", "two": "bcd", "three": "cd"}, "abcd", ["two", "one"]),
        ({"one": "a", "two": "bc", "three": "bd"}, "abc", ["two", "one"]),
        ({"one": "a", "two": "a"}, "ab", ["one"]),
        ({"one": "x"}, "ab", []),
        ({}, "a", []),
    ],
)
def test_the_fewest_fonts_that_have_what_any_has_are_chosen(fonts, wanted, found):
    assert select_fonts(frozenset(wanted), table(**fonts)) == found


def test_no_font_is_opened_after_one_that_has_everything():
    opened = []

    def fonts():
        for name, characters in (("one", "a"), ("two", "ab"), ("three", "ab")):
            opened.append(name)
            yield name, characters.__contains__

    assert select_fonts(frozenset("ab"), fonts()) == ["two"]
    assert opened == ["one", "two"]


def test_what_no_font_has_is_named_once_and_shown_as_unknown(own_fonts):  # noqa: F811
    with pytest.warns(MissingGlyphs, match=r"no installed font has 曲 \(U\+66F2\) and 柄 \(U\+67C4\), so ") as told:
        assert printable_text("the 曲柄曲 A") == f"the {UNKNOWN_CHARACTER * 3} A"
    assert len(told) == 1
    assert told[0].message.characters == ("曲", "柄")
    assert font_families("crank") == (DRAWING_FAMILY,)
    assert printable_text("Kurbel ω₁ γωνία кривошип مرفق") == "Kurbel ω₁ γωνία кривошип مرفق"


def test_a_font_that_was_installed_after_matplotlib_listed_them_is_used(own_fonts, tmp_path):  # noqa: F811
    file = made(tmp_path, "Planar Squares", "鑿齒")
    own_fonts.setattr("matplotlib.font_manager.findSystemFonts", lambda: [str(file)])
    assert printable_text("A 齒鑿") == "A 齒鑿"
    assert font_families("A 齒鑿") == (DRAWING_FAMILY, "Planar Squares")


@pytest.mark.parametrize(("outlines", "embedded"), [("glyf", b"/CIDFontType2"), ("CFF ", b"/Type3")])
def test_texts_are_measured_and_drawn_in_the_font_that_has_them(outlines, embedded, own_fonts, tmp_path):  # noqa: F811
    family, text = f"Planar {outlines.strip()}", "鑄" if outlines == "glyf" else "鑰"
    own_fonts.setattr("matplotlib.font_manager.findSystemFonts", lambda: [str(made(tmp_path, family, text, outlines))])
    picture = Picture((LINE, Label(text * 3, (20.0, 5.0), "named")), text, (text,))
    drawn = draw_pictures([picture])
    # by the font's own tables
    size = text_size(text * 3, 10.0)
    assert size.width == pytest.approx(3 * ADVANCE / EM * 10.0 * MM_PER_POINT, rel=1e-3)
    assert size.height == pytest.approx(HEIGHT / EM * 10.0 * MM_PER_POINT, rel=1e-2)
    assert size.descent == pytest.approx(0.0, abs=0.01)
    page = encode_figure(drawn, "pdf")
    assert embedded in page
    with pypdfium2.PdfDocument(page) as document:
        assert document[0].get_textpage().get_text_bounded().count(text) == 5
        ink = document[0].render(scale=4.0).to_pil().convert("L")
    (axes,) = drawn.axes
    (letter,) = axes.texts
    left, low, right, high = (4.0 * 72.0 / drawn.dpi * each for each in letter.get_window_extent().extents)
    square = ink.crop((round(left), round(ink.height - high), round(right), round(ink.height - low)))
    # three filled squares of 800 x 800 in 900 each
    dark = sum(count for level, count in enumerate(square.histogram()) if level < 128)
    assert dark / (square.width * square.height) == pytest.approx(800 / 900, abs=0.08)
    svg = encode_figure(drawn, "svg").decode()
    assert f">{text * 3}</text>" in svg
    assert f"'{DRAWING_FAMILY}', '{family}', sans-serif" in svg
    assert encode_figure(drawn, "png")


def named(name: str) -> dict:
    texts = {"name": f"{name}机", "units": {"length": "mm", "angle": "deg"}, "sketch": {"C": [80, 50]}}
    names = {"pins": ["O", name, "C", "D"], "names": ["frame", "crank", "rod", "rocker"]}
    return four_bar_document(50, 66, 56, 100, 60, omega="10.5 rad/s", **names, **texts)


@pytest.mark.parametrize(
    "words", [("plot", "m.json", "velocity", "-o", "a.svg"), ("explain", "m.json", "-o", "a.pdf")], ids=lambda w: w[0]
)
def test_the_command_names_what_no_font_has_in_one_line(words, own_fonts, tmp_path):  # noqa: F811
    (tmp_path / "m.json").write_text(json.dumps(named("甲")), encoding="utf-8")
    ended = run(tmp_path, *words)
    assert (ended.status, ended.out) == (0, "")
    (line,) = ended.err.splitlines()
    assert line.startswith("planar: no installed font has 机 (U+673A) and 甲 (U+7532), so ")
    assert (tmp_path / words[-1]).exists()


def test_names_in_any_script_have_indices(own_fonts):  # noqa: F811
    state = planar.solve(planar.from_dict(named("Ж") | {"name": "α"}))
    document = pypdfium2.PdfDocument(encode_sheets(solution_pages(state), ".pdf"))
    text = "".join(page.get_textpage().get_text_range() for page in document)
    assert "_" not in text
    letters = [each.get_text() for each in planar.plot.acceleration(state).axes[-1].texts]
    assert "$ж_{1}$" in letters


# formulas


def test_a_formula_is_as_large_as_matplotlib_would_set_it():
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    looks = FontProperties(family=DRAWING_FAMILY, size=10.0, math_fontfamily="dejavusans")
    for text in ("$A_{12}$", r"$\omega_{BC}$", "$b_1$", r"$\mu_s$ = 2 mm/mm", r"$\infty$", "$F_{32}$ and $a_{c}$"):
        width, height, down = (
            each * MM_PER_POINT for each in text_to_path.get_text_width_height_descent(text, looks, True)
        )
        size = text_size(text, 10.0, math=True)
        # half a millimetre: matplotlib counts in whole pixels, and its indices are a little lower
        assert size.width == pytest.approx(width, abs=0.5), text
        assert size.height == pytest.approx(height, abs=0.6), text
        assert size.descent == pytest.approx(down, abs=0.5), text


def test_indices_and_powers_are_small_and_a_bar_parts_a_fraction():
    base, index, power = text_line("$A_{12}^{c}$", True).pieces
    assert (base.text, base.slanted, base.size, base.y) == ("A", True, 1.0, 0.0)
    assert (index.text, index.slanted, power.text) == ("12", False, "c")
    assert index.size == power.size < 0.8
    assert index.y < 0.0 < power.y
    assert index.x == pytest.approx(power.x)
    assert index.x > text_line("A", slanted=True).width
    line = text_line(r"$\dfrac{\mathit{ab}}{\mathrm{0.12}}=3$", True)
    over, under, equals, three = line.pieces
    ((left, low, right, high),) = line.bars
    assert over.y > high > low > under.y
    assert low > 0.0 > under.y
    middles = [each.x + text_line(each.text, slanted=each.slanted).width / 2.0 for each in (over, under)]
    assert middles == pytest.approx([(left + right) / 2.0] * 2)
    assert right < equals.x < three.x
    assert line.ascent > over.y
    assert line.descent > -under.y


def test_operators_between_terms_have_room_and_signs_have_none():
    assert text_line("$a-b$", True).width > text_line("$a$", True).width + text_line("$-b$", True).width + 0.3
    assert text_line("$-b$", True).pieces[0].text == "−"
    assert text_line("$A_{a-b}$", True).width < text_line("$A_{ab}$", True).width + 0.7 * 0.84


@pytest.mark.parametrize(
    "text", ["$x", "x$", r"$\frac{1}{2}$", "$x_1_2$", "$a_{1$", "$a}$", "$a_$", "a $x$ $", r"$\dfrac{1}$"]
)
def test_a_formula_with_a_fault_is_refused(text):
    with pytest.raises(ValueError, match=r"dollar|formula|letter"):
        text_line(text, True)
