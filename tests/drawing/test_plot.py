"""Every drawing of the textbook's examples and of ten other models, read back, and made by the command."""

import json
import re
from itertools import combinations

import pypdfium2
import pytest
from PIL import Image

import planar
from planar import plot
from planar.drawing.output import animation
from tests.builders import four_bar_document
from tests.command import run
from tests.contact_sheet import DRAWINGS, MODELS, drawn
from tests.draws import part
from tests.figures import visible_texts

RUNS = ("positions", "loci", "diagrams")
# velocity is part of acceleration; of the drawings of a run, which take long, every model has one after the other
CELLS = [
    (model, what)
    for index, model in enumerate(MODELS)
    for what in ("scheme", "acceleration", "centres", RUNS[index % len(RUNS)])
]


@pytest.mark.parametrize(("model", "what"), part(sorted(CELLS, key=lambda cell: cell[1]), 7))
def test_texts_lie_on_the_sheet_and_apart_and_axes_have_units(model, what):
    figure = drawn(model, what)
    width, height = figure.get_size_inches() * figure.dpi
    found = visible_texts(figure)
    assert found
    for text, box in found:
        assert box.x0 > -1.0, text
        assert box.y0 > -1.0, text
        assert box.x1 < width + 1.0, text
        assert box.y1 < height + 1.0, text
    for (one, a), (other, b) in combinations(found, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        along = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(across, along) < 1.0, f"{one!r} lies on {other!r}"
    if what == "diagrams":
        axes_have_units(figure)


def axes_have_units(figure):
    labels = [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()]
    assert len(labels) == 3
    for label in labels:
        assert re.search(r"\((mm|m|cm|deg|rad|m/s|m/s²|rad/s|rad/s²|m/rad|m/rad²|rad/rad|[^)]+)\)$", label)


@pytest.mark.parametrize("what", DRAWINGS)
def test_the_command_writes_what_it_is_asked_for(what, tmp_path):
    done = run(tmp_path, "plot", "002-E3.2", what, "-o", "drawing.png")
    assert (done.status, done.out, done.err) == (0, "", "")
    with Image.open(tmp_path / "drawing.png") as picture:
        assert min(picture.size) > 300


def test_a_ruler_on_the_printed_page_agrees(tmp_path):
    # the pins of the frame are 100 mm apart; at 1:1 so are the centres of their circles on paper
    done = run(tmp_path, "plot", "four-bar", "scheme", "--scale", "1:1", "-o", "page.pdf")
    assert done.status == 0, done.err
    page = pypdfium2.PdfDocument(tmp_path / "page.pdf")[0]
    figure = plot.scheme(planar.solve(planar.load("four-bar")), "1:1")
    points = 72.0
    assert page.get_width() / points == pytest.approx(figure.get_size_inches()[0], abs=1e-3)
    axes = figure.axes[0]
    low, high = axes.get_xlim()
    mm = axes.get_position().width * figure.get_size_inches()[0] * 25.4
    assert mm == pytest.approx(high - low, rel=1e-9)
    pins = {each.get_gid(): each for each in axes.findobj(lambda e: e.get_gid() in ("pin A", "pin D"))}
    a, d = (pins[f"pin {name}"].get_path().vertices for name in "AD")
    centres = [0.5 * (each.max(axis=0) + each.min(axis=0)) for each in (_shown(pins, "A", a), _shown(pins, "D", d))]
    assert centres[1][0] - centres[0][0] == pytest.approx(100.0, abs=1e-6)


def _shown(pins, name, vertices):
    """Vertices in the axes' data, mm."""
    artist = pins[f"pin {name}"]
    if hasattr(artist, "get_patch_transform"):
        return artist.get_patch_transform().transform(vertices)
    return vertices


def test_scales_are_taken_by_what_they_measure(tmp_path):
    state = planar.solve(planar.load("002-E3.1"))
    figure = plot.acceleration(state, ["1 cm = 50 mm", "1 cm = 2 m/s^2", "1 cm = 0.2 m/s"])
    said = " ".join(text for text, _ in visible_texts(figure))
    for scale in ("1 cm = 50 mm", "1 cm = 0.2 m/s", "1 cm = 2 m/s²"):
        assert scale in said
    for wrong in ("1 cm = 3 kg", "3", "0:1", "1 cm = 0 m", "1 s = 2 m"):
        with pytest.raises(planar.BadInput, match="scale"):
            plot.scheme(state, wrong)
    for make in (plot.scheme, plot.centres, plot.velocity):
        with pytest.raises(planar.BadInput, match="not of acceleration"):
            make(state, "1 cm = 2 m/s^2")
    with pytest.raises(planar.BadInput, match="two scales of length"):
        plot.scheme(state, ["1:2", "1:3"])
    done = run(tmp_path, "plot", "002-E3.1", "scheme", "--scale", "1 cm = 3 s", "-o", "a.png")
    assert done.status == 2
    assert done.err == "planar: scale: this drawing has a scale of length, not of time\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("scheme", "-o", "a.bmp"), "a drawing can be written to files that end in .png, .svg, .pdf or .dxf"),
        (("scheme", "--input", "A", "-o", "a.png"), "--input: this option is for positions"),
        (("loci", "--at", "A=60deg", "-o", "a.png"), "--from says where a run starts"),
        (("loci", "--point", "nothing", "-o", "a.png"), "there is no point 'nothing'"),
        (("diagrams", "--of", "nothing", "-o", "a.png"), "there is no pair, point or link of this name"),
        (("positions", "--steps", "0", "-o", "a.png"), "a whole number of positions"),
        (("circles", "-o", "a.png"), "is not one of 'scheme'"),
        (("scheme",), "missing option '-o'"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(words, said, tmp_path):
    done = run(tmp_path, "plot", "002-E3.1", *words)
    assert done.status == 2
    assert said in done.err
    assert len(done.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_dead_point_has_no_polygon_but_says_why(tmp_path):
    model = four_bar_document(1, 1, 1, 3, 0, sketch={"C": [2, 0.1]})
    (tmp_path / "m.json").write_text(json.dumps(model))
    done = run(tmp_path, "plot", "m.json", "velocity", "-o", "a.png")
    assert done.status == 1
    assert len(done.err.splitlines()) == 1
    assert not (tmp_path / "a.png").exists()


def test_a_moving_picture_comes_from_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "PIXELS_PER_MM", 1.0)
    monkeypatch.setattr(animation, "DPI", 25.0)
    done = run(tmp_path, "animate", "four-bar", "--point", "E", "-o", "a.gif")
    assert (done.status, done.out, done.err) == (0, "", "")
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames > 50


def test_the_models_own_file_is_not_written_over(tmp_path):
    (tmp_path / "m.json").write_text("{}")
    text = planar.dumps(planar.load("four-bar"))
    (tmp_path / "m.png").write_text(text)
    done = run(tmp_path, "plot", "m.png", "scheme", "-o", "m.png")
    assert done.status == 2
    assert (tmp_path / "m.png").read_text() == text
