"""Figures fit to print: millimetres on paper, arrows to their tips, nothing clipped, the same bytes every time."""

import hashlib
import os
import subprocess
import sys
from io import BytesIO
from itertools import pairwise
from math import cos, hypot, radians, sin

import numpy as np
import pypdfium2
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planar.drawing.labels.fonts import UNKNOWN_CHARACTER
from planar.drawing.labels.placement import place_labels
from planar.drawing.output.matplotlib_figure import PAGE_WIDTH, draw_pictures, encode_figure, encode_pages
from planar.drawing.output.solution_pages import encode_sheets
from planar.drawing.paper.pens import ARROW_HEAD_LENGTH, ARROW_HEAD_WIDTH, FILL_COLOURS, PEN_STYLES, require_matplotlib
from planar.drawing.paper.picture import Arrow, Circle, Fill, Label, Pen, Picture, Polyline
from planar.foundation.errors import BadInput
from tests.draws import draws
from tests.fonts import own_fonts  # noqa: F401
from tests.hostile import TEXTS

INCH = 25.4
FINE = 508.0
"Dots to an inch: 20 to a millimetre."


def pdf_pixels(content: bytes, page: int = 0) -> np.ndarray:
    """The grey of a PDF page, 20 pixels to a millimetre, its lower left corner first."""
    document = pypdfium2.PdfDocument(content)
    grey = np.array(document[page].render(scale=FINE / 72.0).to_pil().convert("L"))
    document.close()
    return grey[::-1]


def png_pixels(content: bytes) -> np.ndarray:
    """Colours of a PNG file (rows from below, columns, 3)."""
    from PIL import Image

    return np.array(Image.open(BytesIO(content)).convert("RGB"))[::-1]


def drawn(made, about):
    """The artists with that gid."""
    return [each for each in made.findobj() if each.get_gid() == about]


def axes_of(made, title=""):
    return next(each for each in made.axes if each.get_label() == title)


def on_sheet(made, spot, title=""):
    """Where a spot of a picture lies on the sheet (mm from its lower left corner)."""
    axes = axes_of(made, title)
    return tuple(axes.transData.transform(spot) / made.dpi * INCH)


def box_of(made, artist):
    """An artist's extent on the sheet (mm): left, bottom, right, top."""
    return tuple(value / made.dpi * INCH for value in artist.get_window_extent().extents)


def bent(artist):
    """Points close together along an artist's curve (mm)."""
    from matplotlib.transforms import Affine2D

    return artist.get_path().cleaned(transform=Affine2D().scale(100.0), curves=False).vertices[:-1] / 100.0


def apart(one, other):
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


def scheme():
    """A four-bar chain, drawn by hand."""
    a, d, b, c = (0.0, 0.0), (60.0, 0.0), (15.0, 26.0), (54.0, 38.0)
    marks = [
        Polyline((a, b), Pen.LINK, "link AB"),
        Polyline((b, c), Pen.LINK, "link BC"),
        Polyline((c, d), Pen.LINK, "link DC"),
    ]
    marks += [Polyline(((x - 3, -4.5), (x - 4.5, -6.0)), Pen.HATCH, "ground") for x in (0.0, 2.0, 60.0, 62.0)]
    marks += [
        Circle(at, 1.2, Pen.PIN, f"pin {name}", Fill.PAPER) for name, at in zip("ABCD", (a, b, c, d), strict=True)
    ]
    marks += [Circle(a, 8.0, Pen.INPUT, "input A", start=70.0, stop=190.0, arrow_end=1)]
    marks += [Label(name, at, f"point {name}", clearance=1.6) for name, at in zip("ABCD", (a, b, c, d), strict=True)]
    return Picture(tuple(marks), "Space diagram", ("1 cm = 10 mm",))


def polygon():
    pole, b, c = (0.0, 0.0), (-40.0, 25.0), (-20.0, 50.0)
    marks = [
        Arrow(pole, b, Pen.VELOCITY, "v_B"),
        Arrow(pole, c, Pen.VELOCITY, "v_C"),
        Arrow(b, c, Pen.VELOCITY, "v_CB"),
    ]
    named = (("a", pole), ("d", pole), ("b", b), ("c", c))
    marks += [Label(text, at, text, slanted=True) for text, at in named]
    return Picture(tuple(marks), "Velocity polygon", ("1 cm = 0.1 m/s",))


def test_a_ruler_on_the_printed_page_agrees():
    across = Polyline(((0.0, 0.0), (100.0, 0.0)), Pen.GROUND, "across")
    up = Polyline(((3.0, 7.0), (3.0, 57.0)), Pen.GROUND, "up")
    made = draw_pictures([Picture((across, up), "Ruler", ("1 cm = 1 cm",))], "A heading")
    grey = pdf_pixels(encode_figure(made, "pdf"))
    x, y = on_sheet(made, (0.0, 0.0), "Ruler")
    row = np.flatnonzero(grey[round(y * 20.0)] < 128)
    assert (row[-1] - row[0] + 1) / 20.0 == pytest.approx(100.0, abs=0.1)
    assert row[0] / 20.0 == pytest.approx(x, abs=0.1)
    column = np.flatnonzero(grey[:, round((x + 3.0) * 20.0)] < 128)
    column = column[column > (y + 5.0) * 20.0]
    column = column[column < (y + 60.0) * 20.0]
    assert (column[-1] - column[0] + 1) / 20.0 == pytest.approx(50.0, abs=0.1)
    assert column[0] / 20.0 == pytest.approx(y + 7.0, abs=0.1)


def test_the_widths_of_lines_on_the_printed_page_are_those_of_the_pens():
    pens = [Pen.LINK, Pen.PIN, Pen.HATCH, Pen.PATH, Pen.POSITION]
    lines = tuple(Polyline(((0.0, 10.0 * n), (40.0, 10.0 * n)), pen, pen.value) for n, pen in enumerate(pens))
    made = draw_pictures([Picture(lines)])
    grey = pdf_pixels(encode_figure(made, "pdf")).astype(float)
    for n, pen in enumerate(pens):
        x, y = (round(value * 20.0) for value in on_sheet(made, (20.0, 10.0 * n)))
        strip = 255.0 - grey[y - 30 : y + 30, x]
        assert strip.sum() / strip.max() / 20.0 == pytest.approx(PEN_STYLES[pen].width, abs=0.06)


def test_data_of_all_axes_are_millimetres():
    made = draw_pictures([scheme(), polygon(), Picture(())], "All")
    assert [axes.get_label() for axes in made.axes] == ["Space diagram", "Velocity polygon", ""]
    width, height = made.get_size_inches() * INCH
    for axes in made.axes:
        place = axes.get_position()
        assert place.width * width == pytest.approx(np.ptp(axes.get_xlim()))
        assert place.height * height == pytest.approx(np.ptp(axes.get_ylim()))
        assert not axes.axison


def test_pens_that_meet_in_a_drawing_differ_in_width_or_dashes_or_much_in_grey():
    assert set(PEN_STYLES) == set(Pen)

    def grey(colour):
        red, green, blue = (int(colour[n : n + 2], 16) for n in (1, 3, 5))
        return 0.3 * red + 0.59 * green + 0.11 * blue

    same = {frozenset({Pen.PIN, Pen.GROUND})}
    for one in Pen:
        for other in Pen:
            a, b = PEN_STYLES[one], PEN_STYLES[other]
            told = abs(a.width - b.width) > 0.045 or a.dashes != b.dashes or abs(grey(a.colour) - grey(b.colour)) > 60
            assert told or one is other or frozenset({one, other}) in same, (one, other)
    assert set(FILL_COLOURS) == set(Fill) - {Fill.NONE}


arrows = st.tuples(*[st.floats(-60.0, 60.0)] * 4)


@settings(max_examples=draws(10), deadline=None)
@given(arrows)
def test_an_arrow_has_its_tip_at_its_head_and_its_line_ends_inside(ends):
    tail, tip = ends[:2], ends[2:]
    far = hypot(tip[0] - tail[0], tip[1] - tail[1])
    made = draw_pictures([Picture((Arrow(tail, tip, Pen.VELOCITY, "v"),))])
    if far < 1e-9:
        assert not drawn(made, "v")
        return
    (line,), (top,) = drawn(made, "v"), drawn(made, "v head")
    corners = top.get_xy()
    assert tuple(corners[0]) == tip
    assert tuple(line.get_xydata()[0]) == tail
    length = min(ARROW_HEAD_LENGTH, far / 2.0)
    assert np.linalg.norm(corners[1:3].mean(axis=0) - tip) == pytest.approx(length, abs=1e-9)
    assert np.linalg.norm(corners[1] - corners[2]) == pytest.approx(
        length * ARROW_HEAD_WIDTH / ARROW_HEAD_LENGTH, abs=1e-9
    )
    rest = np.linalg.norm(line.get_xydata()[1] - tip)
    assert 0.0 < rest < length
    # where the line ends the head is at least as wide as the line
    assert line.get_linewidth() / 72.0 * INCH <= rest * ARROW_HEAD_WIDTH / ARROW_HEAD_LENGTH + 1e-9


@pytest.mark.parametrize("pen", [Pen.VELOCITY, Pen.ACCELERATION, Pen.PART])
def test_a_printed_arrow_ends_in_a_sharp_tip_where_it_should(pen):
    made = draw_pictures([Picture((Arrow((0.0, 0.0), (40.0, 0.0), pen, "v"),))])
    grey = pdf_pixels(encode_figure(made, "pdf")).astype(float)
    x, y = on_sheet(made, (40.0, 0.0))
    band = 255.0 - grey[round(y * 20.0) - 30 : round(y * 20.0) + 30]
    assert np.flatnonzero(band.max(axis=0) > 60.0)[-1] / 20.0 == pytest.approx(x, abs=0.3)
    dark = 255.0 - min(grey.min(), 200.0)
    wide = band.sum(axis=0) / dark / 20.0
    for back in (0.5, 1.0, 2.0, 2.5):
        assert wide[round((x - back) * 20.0)] == pytest.approx(back * ARROW_HEAD_WIDTH / ARROW_HEAD_LENGTH, abs=0.08)


def test_an_arrow_of_no_length_draws_nothing():
    marks = (Arrow((1.0, 2.0), (1.0, 2.0), Pen.VELOCITY, "v"), Circle((0.0, 0.0), 3.0, Pen.INPUT, "i", start=5, stop=5))
    made = draw_pictures([Picture((*marks, Polyline(((1.0, 1.0),), Pen.LINK, "l"), Polyline((), Pen.LINK, "l", True)))])
    assert not drawn(made, "v")
    assert not drawn(made, "v head")
    assert not drawn(made, "i")
    assert not drawn(made, "l")


@pytest.mark.parametrize("pointed", [-1, 1])
@pytest.mark.parametrize(("start", "stop"), [(20.0, 110.0), (300.0, 60.0), (-90.0, 180.0), (0.0, 360.0), (10.0, 14.0)])
def test_an_arc_ends_in_a_head_whose_tip_is_on_the_arc(pointed, start, stop):
    arc = Circle((5.0, -3.0), 9.0, Pen.INPUT, "input", start=start, stop=stop, arrow_end=pointed)
    made = draw_pictures([Picture((arc,))])
    (line,), (top,) = drawn(made, "input"), drawn(made, "input head")
    at = radians(stop if pointed == 1 else start)
    tip = np.array([5.0 + 9.0 * cos(at), -3.0 + 9.0 * sin(at)])
    corners = top.get_xy()
    assert corners[0] == pytest.approx(tip)
    middle = corners[1:3].mean(axis=0)
    # along the arc and in its sense: anticlockwise towards where it stops
    forwards = np.array([-sin(at), cos(at)]) * pointed
    assert (tip - middle) @ forwards > 0.95 * np.linalg.norm(tip - middle)
    points = bent(line)
    assert np.linalg.norm(points - (5.0, -3.0), axis=1) == pytest.approx(9.0, abs=0.05)
    reached = np.linalg.norm(points - tip, axis=1).min()
    assert 0.0 < reached < np.linalg.norm(tip - middle)


def test_an_arc_goes_anticlockwise_from_start_to_stop():
    made = draw_pictures([Picture((Circle((0.0, 0.0), 10.0, Pen.PATH, "arc", start=350.0, stop=20.0),))])
    points = bent(drawn(made, "arc")[0])
    assert points[:, 0].min() > 9.0
    assert points[0] == pytest.approx((10.0 * cos(radians(350.0)), 10.0 * sin(radians(350.0))))
    assert points[-1] == pytest.approx((10.0 * cos(radians(20.0)), 10.0 * sin(radians(20.0))))


def test_marks_are_drawn_in_their_order_and_a_paper_fill_hides_what_lies_below():
    line = Polyline(((-10.0, 0.0), (10.0, 0.0)), Pen.LINK, "line")
    disc = Circle((0.0, 0.0), 4.0, Pen.PIN, "disc", Fill.PAPER)
    plate = Polyline(((-8.0, -8.0), (8.0, -8.0), (0.0, 8.0)), Pen.LINK, "plate", True, Fill.LINK)
    for marks, dark in (((plate, line, disc), False), ((plate, disc, line), True)):
        made = draw_pictures([Picture(marks)])
        pixels = png_pixels(encode_figure(made, "png"))
        x, y = (round(value / INCH * 200.0) for value in on_sheet(made, (0.0, 0.0)))
        assert pixels[y, x].tolist() == ([0, 0, 0] if dark else [255, 255, 255])
        x, y = (round(value / INCH * 200.0) for value in on_sheet(made, (0.0, -6.0)))
        assert pixels[y, x].tolist() == [int(FILL_COLOURS[Fill.LINK][n : n + 2], 16) for n in (1, 3, 5)]


def test_every_artist_is_found_by_what_its_mark_is_about():
    made = draw_pictures([scheme(), polygon()])
    for picture in (scheme(), polygon()):
        inside = axes_of(made, picture.title)
        found = {each.get_gid() for each in inside.findobj()}
        assert {mark.about for mark in picture.marks if not isinstance(mark, Label)} <= found
    assert drawn(made, "a, d")[0].get_text() == "a, d"
    assert drawn(made, "point A")[0].get_text() == "A"


def test_letters_are_drawn_exactly_in_their_boxes():
    letters = [
        Label("block D.B", (0.0, 0.0), "1"),
        Label("A", (20.0, 9.0), "2"),
        Label("gy", (40.0, 0.0), "3", 12.0),
    ]
    letters += [Label("$A_{12}$", (60.0, 0.0), "4", math=True), Label("ω = 10.5 rad/s", (0.0, 20.0), "5", 8.0)]
    letters += [Label("a'", (60.0, 20.0), "6", slanted=True), Label("cost $x_1$", (90.0, 20.0), "7")]
    made = draw_pictures([Picture(tuple(letters))])
    found = place_labels(letters, [])
    extents = [box_of(made, drawn(made, each.label.about)[0]) for each in found]
    content = pdf_pixels(encode_figure(made, "pdf"))
    for each, extent in zip(found, extents, strict=True):
        (left, bottom), (right, top) = on_sheet(made, each.box[:2]), on_sheet(made, each.box[2:])
        assert extent[0] == pytest.approx(left, abs=0.3)
        assert extent[2] == pytest.approx(right, abs=0.3)
        # before matplotlib 3.11 the extent of a text is at least a full line
        assert extent[1] <= bottom + 0.2
        assert extent[3] >= top - 0.2
        wide = (left - 3.0, bottom - 3.0, right + 3.0, top + 3.0)
        x0, y0, x1, y1 = (round(value * 20.0) for value in wide)
        rows, columns = np.nonzero(content[y0:y1, x0:x1] < 160)
        assert rows[0] / 20.0 == pytest.approx(3.0, abs=0.2)
        assert (rows[-1] + 1) / 20.0 == pytest.approx(top - bottom + 3.0, abs=0.2)
        assert columns.min() / 20.0 == pytest.approx(3.0, abs=0.5)
        assert (columns.max() + 1) / 20.0 == pytest.approx(right - left + 3.0, abs=0.5)


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
def test_a_plain_text_is_never_read_as_mathtext(own_fonts):  # noqa: F811
    marks = tuple(Label(text, (0.0, 9.0 * n), f"letter {n}") for n, text in enumerate(TEXTS))
    made = draw_pictures([Picture(marks, "$\\frac{$ <b>", ("a_b^ $x$", "中文 \ud800"))], "$title$ &amp;")
    for kind in ("png", "svg", "pdf"):
        assert encode_figure(made, kind)
    shown = {each.get_text() for each in made.findobj() if hasattr(each, "get_text")}
    assert {
        "$x",
        "$x$",
        "a_b^",
        "\\frac{",
        "<b>",
        "$\\frac{$",
        "a b c",
        UNKNOWN_CHARACTER * 2,
        "$title$ &amp;",
    } <= shown
    page = encode_figure(made, "svg").decode()
    assert ">$x$</text>" in page
    assert "&lt;b&gt;</text>" in page


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
def test_hostile_names_of_marks_leave_a_page_that_can_be_read():
    from xml.etree import ElementTree

    marks = tuple(Polyline(((0.0, n), (9.0, n)), Pen.LINK, f'link "{text}"') for n, text in enumerate(TEXTS))
    page = encode_figure(
        draw_pictures([Picture(marks, "\x00<&>"), Picture((Label("$--_1$", (0.0, 0.0), "--", math=True),))]), "svg"
    )
    assert ElementTree.fromstring(page).get("width").endswith("pt")


spots = st.tuples(st.floats(-60.0, 60.0), st.floats(-40.0, 40.0))
letters = st.tuples(st.sampled_from(["A", "block D", "y"]), spots).map(lambda pair: Label(*pair))
strokes = st.tuples(spots, spots, st.sampled_from([Pen.LINK, Pen.VELOCITY]))
marks = st.one_of(letters, strokes.map(lambda each: Arrow(*each)), spots.map(lambda at: Circle(at, 7.0, Pen.PIN)))


@settings(max_examples=draws(5), deadline=None)
@given(st.lists(marks, min_size=1, max_size=12))
def test_nothing_is_clipped(some):
    made = draw_pictures([Picture(tuple(some), "Title", ("a note",))])
    grey = png_pixels(encode_figure(made, "png")).min(axis=2)
    assert grey.min() < 128
    edge = round(2.0 / INCH * 200.0)
    inner = np.zeros_like(grey, dtype=bool)
    inner[edge:-edge, edge:-edge] = True
    assert grey[~inner].min() == 255


def test_texts_below_stand_apart_from_each_other_and_from_the_pictures():
    note = "a note that goes on and on about what is to be seen in the picture above and how it was found"
    small = Picture(
        (Polyline(((0.0, 0.0), (12.0, 30.0)), Pen.LINK),), "A title that is much wider than its picture", (note,)
    )
    made = draw_pictures([scheme(), small, polygon(), small._replace(title="W" * 90), small], "All of them together")
    boxes = [box_of(made, text) for text in made.texts]
    assert len(boxes) > 14
    boxes += [box_of(made, axes) for axes in made.axes]
    assert all(apart(one, other) for n, one in enumerate(boxes) for other in boxes[:n])
    width, height = made.get_size_inches() * INCH
    assert all(left > 0 and low > 0 and right < width and top < height for left, low, right, top in boxes)


def test_pictures_stand_in_rows_that_fit_the_page_in_reading_order():
    wide = [
        Picture((Polyline(((0.0, 0.0), (w, 20.0)), Pen.LINK),), f"{w:g}") for w in (120.0, 121.0, 90.0, 400.0, 50.0)
    ]
    made = draw_pictures(wide)
    boxes = [box_of(made, axes_of(made, picture.title)) for picture in wide]
    rows = sorted({round(box[1], 3) for box in boxes}, reverse=True)
    assert [rows.index(round(box[1], 3)) for box in boxes] == [0, 0, 1, 2, 3]
    assert boxes[0][2] < boxes[1][0]
    together = draw_pictures(wide[:3])
    assert together.get_size_inches()[0] * INCH <= PAGE_WIDTH + 10.0


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_the_same_picture_is_the_same_file(kind):
    one, other = (
        encode_figure(draw_pictures([scheme(), polygon()], "Twice"), suffix) for suffix in (kind, f".{kind.upper()}")
    )
    assert one == other
    assert encode_figure(draw_pictures([scheme()]), kind) != one
    assert not any(word in one for word in (b"CreationDate", b"<dc:date>", b"tIME"))


def test_the_same_picture_is_the_same_file_in_another_process():
    code = (
        "import hashlib, sys; from tests.drawing.test_figure import draw_pictures, encode_figure, polygon, scheme"
        "\nmade = draw_pictures([scheme(), polygon()])"
        "\nprint(*[hashlib.sha256(encode_figure(made, kind)).hexdigest() for kind in ('png', 'svg', 'pdf')])"
        "\nassert 'matplotlib.pyplot' not in sys.modules"
    )
    made = draw_pictures([scheme(), polygon()])
    expected = [hashlib.sha256(encode_figure(made, kind)).hexdigest() for kind in ("png", "svg", "pdf")]
    done = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONHASHSEED": "1", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert done.stdout.split() == expected


def test_a_readers_own_settings_of_matplotlib_change_nothing():
    from matplotlib import rc_context, style

    plain = encode_figure(draw_pictures([scheme(), polygon()], "Same"), "svg")
    own = {"savefig.bbox": "tight", "svg.fonttype": "path", "figure.constrained_layout.use": True, "lines.marker": "o"}
    with style.context("dark_background"), rc_context(own):
        assert encode_figure(draw_pictures([scheme(), polygon()], "Same"), "svg") == plain


def test_drawing_leaves_the_settings_of_matplotlib_alone():
    from matplotlib import rcParams

    before = dict(rcParams)
    encode_figure(draw_pictures([scheme()]), "svg")
    assert dict(rcParams) == before


def test_fonts_go_along_and_texts_stay_texts():
    made = draw_pictures([scheme()])
    assert b"FontFile2" in encode_figure(made, "pdf")
    text = pypdfium2.PdfDocument(encode_figure(made, "pdf"))[0].get_textpage().get_text_bounded()
    assert "Space diagram" in text
    page = encode_figure(made, "svg").decode()
    assert ">Space diagram</text>" in page
    assert "'DejaVu Sans', sans-serif" in page


def test_a_png_has_two_hundred_dots_to_an_inch():
    made = draw_pictures([scheme()])
    rows, columns, _ = png_pixels(encode_figure(made, "png")).shape
    width, height = made.get_size_inches()
    assert (columns, rows) == (int(width * 200), int(height * 200))


def test_pages_of_a_book_are_the_figures_in_order_each_of_its_own_size():
    made = [draw_pictures([scheme()]), draw_pictures([polygon()], "Second"), draw_pictures([])]
    document = pypdfium2.PdfDocument(encode_pages(made, "pdf"))
    for page, each in zip(document, made, strict=True):
        assert page.get_size() == pytest.approx(tuple(each.get_size_inches() * 72.0), abs=0.01)
    document.close()
    assert encode_pages(made[:1], "svg") == encode_figure(made[0], "svg")


def test_what_cannot_be_saved_is_refused_in_one_sentence():
    made = draw_pictures([scheme()])
    for suffix in ("jpg", ".eps", "", "svgz"):
        with pytest.raises(BadInput, match=r"can be written to files that end in \.png, \.svg, \.pdf or \.dxf"):
            encode_figure(made, suffix)
    for suffix in ("png", ".svg"):
        with pytest.raises(BadInput, match=r"2 sheets need pages, which only \.pdf has"):
            encode_pages([made, made], suffix)
    with pytest.raises(BadInput, match="nothing to draw"):
        encode_pages([], "pdf")


def test_pictures_too_large_for_paper_or_with_no_place_on_it_are_refused():
    def line(far):
        return Picture((Polyline(((0.0, 0.0), (far, far)), Pen.LINK, "link AB"),))

    with pytest.raises(BadInput, match=r"^scale: the drawing would be 9\.02 m on paper"):
        draw_pictures([line(9000.0)])
    with pytest.raises(BadInput, match=r"too many: choose \.pdf, \.svg or a smaller scale"):
        encode_figure(draw_pictures([line(2000.0)]), "png")
    for far in (float("nan"), float("inf")):
        with pytest.raises(BadInput, match="link AB has no place on paper"):
            draw_pictures([line(far)])


def test_without_matplotlib_it_is_said_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for attempt in (
        require_matplotlib,
        lambda: draw_pictures([]),
        lambda: encode_figure(None, "png"),
        lambda: place_labels([Label("A", (0.0, 0.0))], []),
    ):
        with pytest.raises(
            BadInput, match=r"^matplotlib: drawings need matplotlib: pip install \"planar-linkages\[plot\]\"$"
        ):
            attempt()


def test_letters_of_a_figure_stay_clear_of_the_other_axes_and_inside_their_own():
    made = draw_pictures([scheme(), polygon()])
    for axes in made.axes:
        own = box_of(made, axes)
        for text in axes.texts:
            left, low, right, top = box_of(made, text)
            assert own[0] < left and own[1] < low and right < own[2] and top < own[3]
    assert all(apart(one, other) for one, other in pairwise([box_of(made, axes) for axes in made.axes]))


@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 1, 1), (2, 1, 2), (5, 2, 3), (9, 3, 3)])
def test_many_sheets_in_one_picture_are_wrapped(count, columns, rows):
    corners = ((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (0.0, 90.0))
    square = draw_pictures([Picture((Polyline(corners, Pen.LINK, "square", closed=True),))])
    one = png_pixels(encode_sheets([square], ".png"))
    many = png_pixels(encode_sheets([square] * count, ".png"))
    assert many.shape == (rows * one.shape[0], columns * one.shape[1], 3)
    dark = [part.min() < 128 for row in np.vsplit(many[::-1], rows) for part in np.hsplit(row, columns)]
    assert dark == [True] * count + [False] * (rows * columns - count)
