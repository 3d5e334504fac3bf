"""Folders of designs: every link leads somewhere, drawings stand over what is wanted, tables agree with the designs."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from urllib.parse import unquote

import numpy as np
import pytest

import planar
from planar.drawing.designs.design_picture import closeup_picture, design_picture
from planar.drawing.designs.function_picture import function_picture
from planar.drawing.paper.picture import Circle, Label, Pen, Polyline
from planar.synthesis.judgement.defects import Defect
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign
from planar.synthesis.task.starts import miss_kind
from tests.page_scripts import watched_window

HOSTILE = "<script>alert(1)</script> & \"Lid\" 'x'"
OFF = 1e-3 * np.array([[0.2, 0.1], [-0.3, 0.0], [0.0, 0.4], [0.1, -0.1]])
"""m by which the entries are missed."""
ROWS = [5, 15, 25, 40]


def designed(wanted, values, name, start="four-bar", **more):
    """The model as a design for a task of which it has `values` at the inputs of ROWS, and as one rejected."""
    task = planar.read_task(
        {"planar": 1, "name": name, "units": {"length": "mm", "angle": "deg"}, "start": start, "wanted": wanted} | more
    )
    mechanism, motion = planar.load(start), planar.cycle(start, 90)
    inputs = tuple(motion.inputs[mechanism.inputs[0].pair].position[ROWS] for _ in wanted)
    found = DesignJudge(task, 0.05).judge(mechanism, inputs, values)
    every = np.concatenate(found.misses)
    numbers = {each: planar.dimensions(mechanism)[each] for each in ("AB.length", "DC.length", "AD.D.x")}
    design = SynthesisedDesign(
        replace(mechanism, name=name),
        float(np.sqrt(np.mean(every**2))),
        float(every.max()),
        found.misses,
        found.inputs,
        found.defects,
        f"{start} & <i>",
        numbers,
        tuple(planar.cognates(mechanism, "E")[1:]),
    )
    refused = replace(design, shortages=(Defect("one branch", "branch defect: <b>entry</b> 1"),), cognates=())
    unsolved = replace(
        refused, error=np.nan, greatest_miss=np.nan, misses=tuple(np.full_like(each, np.nan) for each in found.misses)
    )
    return Synthesis(task, (design,), (refused, unsolved), 0.05, ("a < remark",), seed=3)


@pytest.fixture(scope="module")
def path():
    own = planar.cycle("four-bar", 90).point("E").position[ROWS]
    through = (1e3 * (own + OFF)).tolist()
    wanted = [{"point": "E", "through": through, "in_order": True}]
    return designed(wanted, [own], HOSTILE, demands=[{"inside": [[-50, -50], [150, 150]]}])


@pytest.fixture(scope="module")
def function():
    motion = planar.cycle("four-bar", 90)
    values = motion.link("DC").angle[ROWS]
    off = np.radians([0.5, -0.25, 0.0, -0.25])
    pairs = np.degrees(np.column_stack([motion.inputs["A"].position[ROWS] + 0.3, values + off - 1.0]))
    return designed([{"from": "A", "to": "D", "pairs": pairs.tolist()}], [values[:, None]], "Function")


@pytest.fixture(scope="module")
def folder(path, tmp_path_factory):
    made = tmp_path_factory.mktemp("designs") / "new" / "folder"
    told = []
    assert planar.write_designs(path, made, progress=lambda *done: told.append(done)) == made / "index.html"
    assert told == [(1, 1)]
    return made


class Links(HTMLParser):
    """The links, ids and texts of a page, and the elements that it is made of."""

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.tags, self.texts = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        known = dict(attrs)
        self.tags.append(tag)
        self.links += [known["href"]] if "href" in known else []
        self.ids += [known["id"]] if "id" in known else []

    def handle_data(self, data):
        self.texts.append(data)


def test_every_link_leads_to_a_file_or_a_part(folder):
    read = Links((folder / "index.html").read_text())
    assert len(read.ids) == len({*read.ids})
    for link in read.links:
        assert link[1:] in read.ids if link.startswith("#") else (folder / unquote(link)).is_file(), link
    files = {each.name for each in folder.iterdir()}
    assert files - {"index.html"} == {unquote(each) for each in read.links if not each.startswith("#")}
    assert {"01.json", "01.html", "01-cognate-1.json", "rejected-01.json", "designs.csv", "task.json"} <= files
    planar.load(folder / "01.json"), planar.load(folder / "01-cognate-1.json")
    assert planar.write_task(planar.read_task(folder / "task.json"))["name"] == HOSTILE


def test_hostile_names_are_texts(folder):
    text = (folder / "index.html").read_text()
    read = Links(text)
    assert not {"script", "i", "b"} & ({*read.tags} - {"i"})
    assert read.tags.count("i") == 2, "those of the legend"
    assert "".join(read.texts).count(HOSTILE) == 2, "title and heading"
    assert "branch defect: <b>entry</b> 1" in "".join(read.texts)
    assert "default-src 'none'" in unescape(text)


def test_each_design_is_drawn_and_said(path, folder):
    text = (folder / "index.html").read_text()
    cards = re.findall(r'<li id="([^"]+)">(.*?)<ul class="files">', text, re.DOTALL)
    assert [name for name, _ in cards] == ["01", "rejected-01", "rejected-02"]
    assert all(card.count("<svg") == 2 for _, card in cards), "the places of E once more, enlarged"
    own = cards[0][1]
    assert "0.4 mm, 0.8 % of the size" in own, "the third entry, of a size of 50 mm"
    low, high = np.degrees(path[0].motion[1:3])
    assert f"A {low:g} deg to {high:g} deg" in own and "transmission angle at D, least" in own
    assert "AB.length</dt><dd>50 mm" in own
    assert text.index('id="designs"') < text.index('id="rejected"') < text.index('id="table"')


def test_the_table_has_all_numbers_with_units(path, folder):
    with (folder / "designs.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert len(rows) == 3
    own = dict(zip(head, rows[0], strict=True))
    design = path[0]
    assert float(own["greatest miss [mm]"]) == pytest.approx(1e3 * design.greatest_miss)
    assert float(own["of the extent [%]"]) == pytest.approx(0.8)
    for entry, (miss, at) in enumerate(zip(design.misses[0], design.inputs[0], strict=True), start=1):
        assert float(own[f"miss of E {entry} [mm]"]) == pytest.approx(1e3 * miss)
        assert float(own[f"input at E {entry} [deg]"]) == pytest.approx(np.degrees(at))
    used = planar.cycle(design.mechanism, 90, design.inputs[0].min(), design.inputs[0].max())
    least = planar.transmission(used, "D").least.value
    assert float(own["least transmission angle [deg]"]) == pytest.approx(np.degrees(least))
    assert (own["whole turn"], own["AD.D.x [mm]"], own["defects"]) == ("no", "100.0", "")
    lost = dict(zip(head, rows[2], strict=True))
    assert lost["greatest miss [mm]"] == "" and lost["defects"] == "branch defect: <b>entry</b> 1"


def test_what_is_no_more_goes_and_what_is_another_s_stays(path, tmp_path):
    planar.write_designs(path, tmp_path)
    (tmp_path / "07.json").write_text("{}")
    (tmp_path / "07-cognate-1.json").write_text("{}")
    (tmp_path / "my-07.json").write_text("{}")
    planar.write_designs(path, tmp_path)
    assert {each.name for each in tmp_path.glob("*07*")} == {"my-07.json"}
    with pytest.raises(planar.BadInput, match="designs of another task"):
        planar.write_designs(replace(path, task=replace(path.task, name="Another")), tmp_path)
    (other := tmp_path / "other").mkdir()
    (other / "01.json").write_text("mine")
    with pytest.raises(planar.BadInput, match=r"holds '01.json' and no designs"):
        planar.write_designs(path, other)
    assert [each.name for each in other.iterdir()] == ["01.json"]


def test_the_drawing_is_to_one_scale_with_what_is_wanted(path):
    design, wanted = path[0], path.task.wanted[0]
    drawn = design_picture(design, path.task)
    by_name = {each.text: each.at for each in drawn.marks if isinstance(each, Label) and len(each.text) == 1}
    per_mm = 0.1 / (np.array(by_name["D"]) - by_name["A"])[0]
    (curve,) = (each for each in drawn.marks if isinstance(each, Polyline) and each.about == "wanted curve of E")
    np.testing.assert_allclose(np.array(curve.points) * per_mm, wanted.places, atol=1e-9)
    circles = [each for each in drawn.marks if isinstance(each, Circle) and each.about.startswith("entry")]
    there = np.array([each.centre for each in circles]) * per_mm
    np.testing.assert_allclose(np.hypot(*(there - wanted.places).T), design.misses[0], atol=1e-9)
    (line,) = (each for each in drawn.marks if isinstance(each, Polyline) and each.about == "path E")
    far = [np.hypot(*(np.array(line.points) * per_mm - at).T).min() for at in there]
    assert max(far) < 1e-3, "entries lie on the path"
    (region,) = (each for each in drawn.marks if each.about == "region")
    np.testing.assert_allclose(np.ptp(np.array(region.points), axis=0) * per_mm, 0.2)
    width, height = np.ptp(np.concatenate([curve.points, line.points, [*by_name.values()]]), axis=0)
    assert width <= 84.0 + 1e-9 and height <= 66.0 + 1e-9


def test_a_small_curve_is_shown_once_more_enlarged(path):
    task = planar.read_task(planar.write_task(path.task))
    own = path.task.wanted[0].places
    turned = 5e-3 * np.column_stack([np.cos(np.arange(30.0)), np.sin(np.arange(30.0))])
    many = task.wanted[0]._replace(places=own[0] + turned, weights=np.ones(30))
    design = replace(path[0], inputs=(np.full(30, path[0].inputs[0][0]),))
    task = replace(task, wanted=(many,))
    drawn = design_picture(design, task)
    assert not [each for each in drawn.marks if each.about.startswith(("wanted E", "entry"))], "the curve alone"
    closeup = closeup_picture(design, task, drawn)
    (curve,) = (each for each in closeup.marks if each.about == "wanted curve of E")
    width, height = np.ptp(np.array(curve.points), axis=0)
    assert max(width / 84.0, height / 50.0) == pytest.approx(1.0)
    lines = [each for each in closeup.marks if each.about == "path E"]
    assert lines
    low, high = np.array(curve.points).min(axis=0) - 8.0 - 1e-6, np.array(curve.points).max(axis=0) + 8.0 + 1e-6
    every = np.concatenate([each.points for each in lines])
    assert (every >= low).all() and (every <= high).all()


def test_poses_are_drawn_as_their_link():
    motion = planar.cycle("four-bar", 90)
    link = motion.link("BC")
    own = np.column_stack([motion.point("B").position, link.angle])[ROWS]
    poses = [{"at": (1e3 * each[:2]).tolist(), "angle": float(np.degrees(each[2]))} for each in own]
    found = designed([{"link": "BC", "poses": poses}], [own], "Poses")
    assert found[0].greatest_miss < 1e-9
    drawn = design_picture(found[0], found.task)
    assert closeup_picture(found[0], found.task, drawn) is None, "large enough"
    wanted = [each for each in drawn.marks if each.about.startswith("pose of BC")]
    made = [each for each in drawn.marks if each.about.startswith("link BC ") and each.pen is Pen.POSITION]
    assert len(wanted) == len(made) == len(ROWS)
    for one, other in zip(wanted, made, strict=True):
        np.testing.assert_allclose(one.points, other.points, atol=1e-6)


def test_a_function_is_shown_with_its_errors(function):
    """The zeros of both scales are free: errors are those put in, less their mean, which is none."""
    assert miss_kind(function.task) == "angle"
    drawn = function_picture(function[0], function.task, 0)
    stems = [each for each in drawn.marks if each.about == "error of D"]
    heights = np.array([each.points[1][1] - each.points[0][1] for each in stems])
    np.testing.assert_allclose(heights / heights[1], [-2.0, 1.0, 0.0, 1.0], atol=1e-4)
    np.testing.assert_allclose(function[0].misses[0], np.radians([0.5, 0.25, 0.0, 0.25]), atol=1e-9)
    crosses = [each for each in drawn.marks if each.about == "wanted D"]
    assert len(crosses) == 2 * len(ROWS)
    (curve,) = (each for each in drawn.marks if each.about == "made D")
    middles = np.array([np.mean(each.points, axis=0) for each in crosses[::2]])
    below = np.interp(middles[:, 0], *np.array(curve.points).T)
    assert np.abs(below - middles[:, 1]).max() < 1.0, "mm: the curve goes by the crosses"


def test_sheets_of_drawings(path, function):
    for found, pictures in ((path, 1), (function, 2)):
        (sheet,) = planar.plot.designs(found)
        assert len(sheet.axes) == pictures
    with pytest.raises(planar.BadInput, match="no design without a defect"):
        planar.plot.designs(replace(path, designs=()))
    with pytest.raises(planar.BadInput, match=r"what planar\.synthesise found is wanted"):
        planar.plot.designs([])


def test_the_gallery_in_a_browser(folder, chromium):
    for scheme in ("light", "dark"):
        context = chromium.new_context(viewport={"width": 390, "height": 800}, color_scheme=scheme)
        window, wrong = watched_window(context)
        window.goto((folder / "index.html").as_uri())
        assert window.evaluate("document.documentElement.scrollWidth") <= 390, "only the table is scrolled"
        line = window.locator("#designs svg [stroke*='--pen-c2185b']").first
        colour = line.evaluate("each => getComputedStyle(each).stroke")
        assert colour == {"light": "rgb(194, 24, 91)", "dark": "rgb(255, 138, 180)"}[scheme]
        window.get_by_role("link", name="Page").click()
        window.locator("#drawing .wanted path.cross").first.wait_for()
        window.get_by_role("link", name="All designs").click()
        window.locator("#designs").wait_for()
        assert wrong == []
