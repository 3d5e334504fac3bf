"""What is said of a mechanism in words: numbers, orders, pairs, motions, whether it is a mechanism or a linkage."""

import copy
import json
from dataclasses import asdict

import numpy as np
import pytest
from rich.console import Console

import planar
from planar.document import files
from planar.document.files import to_dict
from planar.drawing.forces.free_bodies import free_bodies
from planar.drawing.paper.picture import Label
from planar.drawing.scheme.scheme import scheme
from planar.model.link_graph import link_numbers
from planar.model.mechanism import pair_entries
from planar.pages.data.page_data import page_data
from planar.reports.tables.inspection import inspection_tables, link_orders_text
from tests.builders import four_bar_document
from tests.closed_forms import between
from tests.command import ROOT, run, written
from tests.draws import first_cases
from tests.known import MODELS, some_models

SLOW = {"chain-42", "rolling-wheel"}
"""Seconds each; the others take a tenth."""


@pytest.fixture(scope="module")
def found():
    """Each model inspected once."""
    known = {}

    def inspected(name):
        if name not in known:
            known[name] = planar.inspect(MODELS[name])
        return known[name]

    return inspected


def lettered_four_bar(**top):
    return four_bar_document(0.3, 0.9, 0.7, 1, 0.8, names=["f", *"abc"], sketch={"C": [0.9, 0.7]}) | top


def inspected(**top):
    return planar.inspect(files.from_dict(copy.deepcopy(lettered_four_bar(**top))))


# the textbook's own listing


def test_the_slider_crank_is_listed_as_in_the_textbook(tmp_path):
    """Machine Elements: one ground pair numbered O-1, then 1-2, 2-3 turning and 3-4 sliding."""
    out = run(tmp_path, "inspect", "slider-crank").done()
    lines = [line.strip() for line in out.splitlines()]
    assert "3 turning: O-1, 1-2, 2-3" in lines
    assert "1 sliding: 3-4" in lines
    assert any(line.split(None, 1) == ["links", "4 binary"] for line in lines)
    assert any("4 lower pairs, 0 higher pairs" in line for line in lines)
    assert any("slider-crank chain; slider-crank; in-line slider-crank" in line for line in lines)
    assert any("1: 1 by count (Gruebler, Kutzbach), 1 in this position, 1 in motion" in line for line in lines)
    rows = [line.split(None, 3) for line in lines if line[:1].isdigit() and line.split()[1] in MODELS_LINKS]
    assert rows == [
        ["1", "crank", "binary", "turns fully"],
        ["2", "rod", "binary", "general plane motion"],
        ["3", "piston", "binary", "translates"],
        ["4", "frame", "binary", "fixed"],
    ]


MODELS_LINKS = {link.name for link in MODELS["slider-crank"].links}


@pytest.mark.parametrize("model", ["slider-crank", "double-butterfly", "planetary-gear-set"])
def test_inspect_as_json_is_what_the_library_says(model, found, tmp_path):
    told = json.loads(run(tmp_path, "inspect", model, "--json").done())
    assert told == json.loads(json.dumps(asdict(found(model))))


@pytest.mark.parametrize("name", sorted(set(some_models(3)) - SLOW))
def test_every_model_is_inspected_and_shown(name, found):
    mechanism, each = MODELS[name], found(name)
    assert each.is_mechanism, each.mechanism_reason
    assert {*each.links} == {link.name for link in mechanism.links}
    # numbered 1 to n, the frame last
    assert [link.number for link in each.links.values()] == [str(k + 1) for k in range(len(each.links))]
    assert [*each.links][-1] == mechanism.frame
    assert each.links[mechanism.frame].motion == "fixed"
    # a pin of n links is n - 1 pairs, and every pair is listed once
    assert sum(len(pairs) for _, pairs in each.pairs) == each.lower + each.higher == len(mechanism.pairs)
    assert each.is_linkage == (each.higher == 0)
    assert each.mobility is not None
    assert each.mobility.finite == len(mechanism.inputs)
    # Kutzbach's count from the listing alone: a lower pair holds two motions, a higher one holds one
    count = 3 * (len(each.links) - 1) - 2 * each.lower - each.higher
    assert each.gruebler == each.mobility.gruebler
    if not any(pair.keyword in ("belt", "chain", "rack", "gear") for pair in mechanism.pairs):
        assert each.gruebler == count
    console = Console(width=140, file=None, record=True, quiet=True)
    console.print(inspection_tables(each))


def test_the_kinds_of_pairs_and_orders_of_links_are_those_of_the_graph(found):
    """Counted again from the file: a pin of three links is one joint of each of them."""
    for name in first_cases(("double-butterfly", "scissor-lift", "stephenson-3-five-bar", "peaucellier-lipkin"), 2):
        joints = {}
        for group in pair_entries(MODELS[name]):
            for link in {link for pair in group for link in pair.links}:
                joints[link] = joints.get(link, 0) + 1
        words = {1: "unary", 2: "binary", 3: "ternary", 4: "quaternary", 5: "quinary"}
        assert {link: each.order for link, each in found(name).links.items()} == {
            link: words[count] for link, count in joints.items()
        }
    assert link_orders_text(found("double-butterfly")) == "4 binary and 4 ternary"
    assert found("rotary-engine").links["cylinders"].order == "of 8 pairs"


# motions

KNOWN = [
    ("crank-rocker", "crank", "turns fully"),
    ("crank-rocker", "coupler", "general plane motion"),
    ("crank-rocker", "rocker", "rocks"),
    ("triple-rocker", "driver", "rocks"),
    ("triple-rocker", "follower", "rocks"),
    ("drag-link", "driver", "turns fully"),
    ("drag-link", "follower", "turns fully"),
    ("double-rocker", "left rocker", "rocks"),
    ("three-parallel-cranks", "crank C", "turns fully"),
    ("three-parallel-cranks", "rod", "translates"),
    ("scissor-lift", "platform", "translates"),
    ("scissor-lift", "a1", "rocks"),
    ("scotch-yoke", "yoke", "translates"),
    ("whitworth", "slotted link", "turns fully"),
    ("crank-and-slotted-lever", "lever", "rocks"),
    ("oldham", "disc 2", "turns fully"),
    ("oldham", "cross", "general plane motion"),
    ("planetary-gear-set", "arm", "turns fully"),
    ("planetary-gear-set", "planet", "general plane motion"),
    ("rotary-engine", "cylinders", "turns fully"),
    ("band-drafting-machine", "head", "translates"),
    ("elliptical-trammel", "block P", "translates"),
]


@pytest.mark.parametrize(("model", "link", "motion"), KNOWN)
def test_how_links_of_known_mechanisms_move(model, link, motion, found):
    assert found(model).links[link].motion == motion


def test_a_link_that_is_held_stands_still():
    links = lettered_four_bar()["links"] | {
        "f": {"points": {"A": [0, 0], "D": [1, 0], "U": [0, -1], "V": [1, -1]}},
        "p": {"ends": ["U", "P"], "length": 0.8},
        "q": {"ends": ["V", "P"], "length": 0.9},
    }
    pairs = [{"turning": name} for name in "ABCDUVP"]
    each = inspected(links=links, pairs=pairs, sketch={"C": [0.9, 0.7], "P": [0.5, -0.4]})
    assert each.is_mechanism
    assert [each.links[name].motion for name in "abcpq"] == [
        "turns fully",
        "general plane motion",
        "rocks",
        "stands still",
        "stands still",
    ]


def test_steering_arms_on_a_rack_only_rock(found):
    """A pinion's turn moves the rack on, and does not bring the arms round."""
    each = found("rack-steering")
    motion = planar.cycle(MODELS["rack-steering"], 120)
    for arm in ("left arm", "right arm"):
        assert np.ptp(motion.link(arm).angle) < np.pi
        assert each.links[arm].motion == "rocks"
    assert each.links["pinion"].motion == "turns fully"


def test_coupled_wheels_are_not_said_to_rock(found):
    assert found("coupled-wheels").links["wheel A"].motion != "rocks"


# open and closed, mechanism and linkage


def test_open_and_closed_chains(found):
    assert found("four-bar").closed
    for name in ("single-link", "open-arm", "chain-swing-arm"):
        each = found(name)
        assert not each.closed
        assert any(link.order == "unary" for link in each.links.values())
    assert found("single-link").names == ("open chain of 1 moving link",)


@pytest.mark.parametrize(
    ("model", "higher"), [("planetary-gear-set", 2), ("slotted-yoke", 1), ("slotted-lever", 1), ("belt-arm", 1)]
)
def test_with_higher_pairs_it_is_a_mechanism_but_no_linkage(model, higher, found):
    each = found(model)
    assert each.is_mechanism
    assert not each.is_linkage
    assert each.higher == higher
    assert f"{higher} higher pair" in each.linkage_reason


def test_without_a_driver_it_is_no_mechanism():
    each = inspected(inputs=[])
    assert (each.is_mechanism, each.is_linkage) == (False, False)
    assert each.mechanism_reason == "it has 0 driving links, and it moves in 1 way"
    assert each.linkage_reason == "it is no mechanism"
    assert each.mobility.finite == 1
    assert each.links["a"].motion == "unknown"
    assert each.links["f"].motion == "fixed"


def test_with_too_many_drivers_it_is_no_mechanism():
    each = inspected(inputs=[{"pair": "A", "position": 0.8}, {"pair": "D", "position": 2.0}])
    assert not each.is_mechanism
    assert each.mechanism_reason == "it has 2 driving links, and it moves in 1 way"


def test_a_structure_is_no_mechanism():
    links = {
        "f": {"points": {"A": [0, 0], "D": [1, 0]}},
        "a": {"ends": ["A", "C"], "length": 0.8},
        "c": {"ends": ["D", "C"], "length": 0.7},
    }
    each = inspected(links=links, pairs=[{"turning": name} for name in "ACD"], inputs=[], sketch={"C": [0.5, 0.5]})
    assert not each.is_mechanism
    assert "nothing moves: it is a structure of links 'a' and 'c' with the frame 'f'" in each.mechanism_reason
    assert {each.links[name].motion for name in "ac"} <= {"unknown", "stands still"}
    assert (each.gruebler, each.mobility.finite, each.closed) == (0, 0, True)


def test_what_nothing_joins_to_the_frame_is_named():
    each = inspected(links=lettered_four_bar()["links"] | {"x": {"points": {"P": [0, 0]}}})
    assert not each.is_mechanism
    assert "nothing joins 'x' to the frame" in each.mechanism_reason
    assert each.names == ()
    assert not each.closed


def test_what_cannot_be_assembled_is_still_counted_and_named():
    value = lettered_four_bar()["links"]
    for name in "abc":
        value[name]["length"] = 0.1
    each = inspected(links=value)
    assert each.mobility is None
    assert each.gruebler == 1
    assert not each.is_mechanism
    assert each.mechanism_reason == each.open_reason
    assert "cannot be assembled" in each.open_reason
    assert "four-bar chain" in each.names
    assert each.pairs == (("turning", ("A-1", "1-2", "2-3", "D-3")),)


def test_at_a_dead_point_it_is_a_mechanism_with_a_word_of_warning():
    value = lettered_four_bar()["links"]
    for name, length in zip("abc", (0.5, 0.66, 0.56), strict=True):
        value[name]["length"] = length
    limit = float(between(0.5, 1, 1.22))
    each = inspected(links=value, inputs=[{"pair": "A", "position": limit, "velocity": 1.0}])
    assert each.is_mechanism
    assert "but here: at A" in each.mechanism_reason
    assert "cannot move" in each.mechanism_reason


def test_an_input_at_what_is_held_fast_drives_nothing():
    links = lettered_four_bar()["links"] | {
        "f": {"points": {"A": [0, 0], "D": [1, 0], "U": [0, -1], "V": [1, -1]}},
        "p": {"ends": ["U", "P"], "length": 0.8},
        "q": {"ends": ["V", "P"], "length": 0.9},
    }
    given = [{"pair": "U", "position": 1.0}]
    each = inspected(links=links, pairs=[{"turning": name} for name in "ABCDUVP"], inputs=given)
    assert each.gruebler == 1
    assert not each.is_mechanism
    assert "input jammed" in each.mechanism_reason


def test_two_inspections_from_other_names_and_orders_agree():
    """Numbers follow how links are joined to what drives, not how the file lists them."""
    value = lettered_four_bar()
    turned = value | {
        "links": dict(reversed(value["links"].items())),
        "pairs": value["pairs"][::-1],
    }
    one, two = (planar.inspect(files.from_dict(each)) for each in (value, turned))
    assert one == two


NUMBERED = {"OA": "1", "AB": "2", "QB": "4", "BD": "15"}
"""What the links of the README's press are called, instead."""


@pytest.fixture(scope="module")
def renamed():
    """The press whose links its author numbered, with the load that presses."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").split("<!-- file: press.json -->\n```json\n")[1]
    text = text.split("```")[0]
    for old, new in NUMBERED.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    return files.from_dict(json.loads(text) | {"loads": [{"point": "D", "force": [-1000, 0]}]})


def test_links_that_are_numbers_keep_them_in_text_tables_drawings_and_pages(renamed, tmp_path):
    """The others have the numbers that are left, the frame the last of these."""
    expected = {"1": "1", "2": "2", "4": "4", "15": "15", "block D": "3", "frame": "5"}
    inspected = planar.inspect(renamed)
    assert {link: each.number for link, each in inspected.links.items()} == expected
    words = dict(inspected.pairs)
    assert set(words["turning"]) == {"O-1", "1-2", "2-4", "2-15", "Q-4", "3-15"}
    assert set(words["sliding"]) == {"3-5"}
    state = planar.solve(renamed)
    centres = planar.centres(state)
    assert dict(centres.numbers) == expected
    assert centres["2", "frame"].name == "I2,5"
    assert centres["2", "15"].name == "I2,15"
    texts = {mark.about: mark.text for mark in scheme(state).marks if isinstance(mark, Label)}
    assert {link: texts[f"number of {link}"] for link in expected} == expected
    pictures, _ = free_bodies(planar.forces(state))
    titles = [each.title for each in pictures]
    assert {"1", "2", "4", "15", "3 block D"} <= set(titles)
    abouts = {mark.about for each in pictures for mark in each.marks}
    assert {"force F_12", "force F_21", "force F_3,15"} <= abouts
    data, _ = page_data(renamed)
    assert data["numbers"] == expected
    shown = run(tmp_path, "centres", written(tmp_path, to_dict(renamed))).done()
    assert "links: 1, 2, 3 block D, 4, 5 frame and 15" in shown


@pytest.mark.parametrize("name", ["01", "1a", "-1", "½", "２", "99999"])
def test_only_a_plain_number_is_a_links_number(name):
    value = json.loads(json.dumps(lettered_four_bar()).replace('"c"', json.dumps(name)))
    number = link_numbers(files.from_dict(value))
    assert sorted(number.values()) == ["1", "2", "3", "4"]


# the command


def test_inspect_ends_with_0_whatever_it_has_to_say(tmp_path):
    value = lettered_four_bar(inputs=[])
    out = run(tmp_path, "inspect", written(tmp_path, value)).done()
    assert "no: it has 0 driving links, and it moves in 1 way" in out
    told = json.loads(run(tmp_path, "inspect", "m.json", "--json").done())
    assert told["is_mechanism"] is False
    assert told["mobility"]["finite"] == 1
    value["links"]["b"]["length"] = 5.0
    told = json.loads(run(tmp_path, "inspect", written(tmp_path, value), "--json").done())
    assert told["mobility"] is None


def test_inspect_of_bad_input_ends_with_2(tmp_path):
    assert "no such file" in run(tmp_path, "inspect", "nothing.json").refused(2)
