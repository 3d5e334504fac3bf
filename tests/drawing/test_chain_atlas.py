"""The atlas of chains: sheets, and an index with every fact; a folder of something else is left alone."""

import json
import re

import pytest

import planar
from planar import plot
from planar.drawing.output.grid_sheets import GRID_PICTURE_SIZE
from planar.drawing.paper.picture import Circle, Fill, Polyline, extent
from planar.drawing.structures.chain_pictures import chain_picture, draw_chain, inversion_picture
from planar.reports.tables.design.structures import record
from tests.command import run
from tests.draws import part


@pytest.fixture(scope="module")
def atlas(tmp_path_factory):
    folder = tmp_path_factory.mktemp("atlas") / "six"
    run(folder.parent, "chains", "6", "--mechanisms", "-o", str(folder)).done()
    return folder


def test_the_index_tells_every_fact_of_every_chain(atlas):
    told = json.loads((atlas / "chains.json").read_text())
    assert (told["links"], told["freedom"], told["count"], told["drawn"]) == (6, 1, 2, 2)
    for chain, own in zip(planar.chains(6), told["chains"], strict=True):
        assert record(chain, True).items() <= own.items()
        assert sum(own["classes"].values()) == len(chain.mechanisms())
        assert len(own["places"]) == chain.joints
        assert [sorted(each) for each in own["outlines"]] == [
            [number for number, joint in enumerate(chain.edges) if link in joint] for link in range(6)
        ]
        assert own["crossings"] == 0
        assert [*map(int, own["inversion_sheets"])] == [*chain.inversions]
    assert told["chains"][1]["classes"] == {"II": 2, "III": 2, "IV": 1}
    assert [each["class"] for each in told["chains"][0]["mechanisms"]] == ["II"] * 4


def test_every_sheet_of_the_index_is_there_and_nothing_else(atlas):
    told = json.loads((atlas / "chains.json").read_text())
    named = {f"{name}{suffix}" for name in told["sheets"] for suffix in (".svg", ".png")}
    assert {path.name for path in atlas.iterdir()} == named | {"chains.json"}
    for each in told["chains"]:
        assert {each["sheet"], *each["inversion_sheets"].values()} <= {*told["sheets"]}
    text = (atlas / "inversions-1.svg").read_text()
    assert all(name in text for name in ("Watt II six-bar", "Stephenson III six-bar", "Stephenson II six-bar"))


def test_an_atlas_is_written_anew_and_other_files_beside_it_stay(tmp_path):
    for links in (8, 4):
        run(tmp_path, "chains", str(links), "--limit", "3", "--mechanisms", "-o", "atlas").done()
        (tmp_path / "atlas" / "notes.txt").write_text("mine")
    held = sorted(path.name for path in (tmp_path / "atlas").iterdir())
    assert held == ["chains-1.png", "chains-1.svg", "chains.json", "inversions-1.png", "inversions-1.svg", "notes.txt"]
    assert json.loads((tmp_path / "atlas" / "chains.json").read_text())["links"] == 4


def test_a_folder_that_holds_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    done = run(tmp_path, "chains", "4", "-o", str(tmp_path))
    assert done.status == 2
    assert "thesis.txt" in done.err and "new folder" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_sheets_go_to_one_file_too(tmp_path):
    run(tmp_path, "chains", "4", "-o", "four.svg").done()
    assert "four-bar chain" in (tmp_path / "four.svg").read_text()
    run(tmp_path, "chains", "6", "--mechanisms", "-o", "six.pdf").done()
    assert (tmp_path / "six.pdf").read_bytes().startswith(b"%PDF")


def test_each_chain_has_its_picture_of_all_links_and_joints_within_its_frame():
    for chain in (*part(planar.chains(8), 1), *planar.chains(7, 2)):
        picture = chain_picture(draw_chain(chain), GRID_PICTURE_SIZE)
        bars = [mark for mark in picture.marks if isinstance(mark, Polyline)]
        assert sorted(mark.about for mark in bars) == sorted(f"link {link}" for link in range(chain.links))
        assert {mark.about: len(mark.points) for mark in bars} == {
            f"link {link}": degree for link, degree in enumerate(chain.degrees)
        }
        circles = [mark for mark in picture.marks if isinstance(mark, Circle)]
        assert [mark.about for mark in circles] == [f"joint {number}" for number in range(chain.joints)]
        (left, low), (right, high) = extent(bars)
        assert right - left <= GRID_PICTURE_SIZE[0] + 1e-9
        assert high - low <= GRID_PICTURE_SIZE[1] + 1e-9
        assert picture.title.startswith(f"{chain.number}: ")
        assert ("fractionated" in " ".join(picture.notes)) == chain.is_fractionated


def test_an_inversion_has_its_fixed_link_hatched_and_its_driven_joints_black():
    chain = planar.chains(6)[0]
    for frame in chain.inversions:
        own = [each for each in chain.mechanisms() if each.frame == frame]
        picture = inversion_picture(draw_chain(chain), frame, own, GRID_PICTURE_SIZE)
        hatched = {mark.about for mark in picture.marks if mark.about.endswith(" fixed")}
        assert hatched == {f"link {frame} fixed"}
        black = {mark.about for mark in picture.marks if isinstance(mark, Circle) and mark.fill is Fill.SOLID}
        assert black == {f"joint {joint}" for each in own for joint in each.drives}
        assert len(re.findall(r"\d-\d:\sII", " ".join(picture.notes))) == len(own)


def test_figures_are_a_sheet_for_twenty_chains():
    assert [len(figure.axes) for figure in plot.chains([planar.chains(6)[0]] * 21)] == [20, 1]
    assert [len(figure.axes) for figure in plot.chains(planar.chains(6)[0], mechanisms=True)] == [2]


@pytest.mark.parametrize("wrong", [[], ["four-bar"], [3]], ids=repr)
def test_what_are_no_chains_is_bad_input(wrong):
    with pytest.raises(planar.BadInput, match="is wanted, not"):
        plot.chains(wrong)
