"""Which chain a mechanism is: whatever it is called, with slides and pins of several links."""

import json
from contextlib import suppress
from random import Random

import pytest

import planar
from planar.document.writer import write_mechanism
from planar.model.mechanism import relative_motions
from planar.structures.assur_groups import assur_groups
from tests.command import run
from tests.draws import is_exhaustive
from tests.known import MODELS

NAMES = {
    "four-bar": "four-bar chain",
    "watt-1-six-bar": "Watt I six-bar",
    "watt-six-bar": "Watt II six-bar",
    "stephenson-1-six-bar": "Stephenson I six-bar",
    "stephenson-2-six-bar": "Stephenson II six-bar",
    "klann-leg": "Stephenson III six-bar",
    "double-butterfly": "double butterfly linkage",
    "double-flier": "double flier eight-bar",
}


@pytest.mark.parametrize("model", NAMES)
def test_a_model_is_known_by_its_structure(model):
    assert planar.chain_of(model).name == NAMES[model]


def chain_models():
    for stem, mechanism in MODELS.items():
        if len(mechanism.links) > (10 if is_exhaustive() else 6):  # larger ones take a second each
            continue
        with suppress(planar.BadInput):
            yield stem, mechanism, planar.chain_of(mechanism)


def test_links_and_joints_are_those_of_the_chain():
    seen = 0
    for _, mechanism, found in chain_models():
        assert sorted(found.links.values()) == [*range(found.chain.links)]
        assert found.links[mechanism.frame] == found.frame
        named = relative_motions(mechanism)
        for name, joint in found.joints.items():
            assert tuple(sorted(found.links[link] for link in named[name].links)) == found.chain.edges[joint]
        assert sorted(found.joints[given.pair] for given in mechanism.inputs if given.pair in found.joints) == [
            *found.drives
        ]
        if found.number is not None:
            which = found.chain.mechanisms(moving_drives=True)[found.number]
            assert (which.frame, which.drives) == (found.frame, found.drives)
            sizes = [len(links) for links, _ in found.groups]
            assert sizes == [len(each.links) for each in which.groups]
        seen += 1
    assert seen > (50 if is_exhaustive() else 30)


@pytest.mark.parametrize(
    "model", ["double-butterfly", "stephenson-2-six-bar", "000-P4", "ten-link", "drafting-machine"]
)
def test_other_names_and_another_order_change_nothing(model):
    """Links and pairs in another order; numbers are then the same up to an exchange that keeps frame and drives."""
    mechanism, random = planar.load(model), Random(5)
    found = planar.chain_of(mechanism)
    value = write_mechanism(mechanism)
    links = list(value["links"].items())
    random.shuffle(links)
    random.shuffle(value["pairs"])
    for pair in value["pairs"]:
        if "turning" in pair and "links" in pair:
            random.shuffle(pair["links"])
    again = planar.chain_of(planar.from_dict(value | {"links": dict(links)}))
    for what in ("chain", "frame", "drives", "number", "name"):
        assert getattr(again, what) == getattr(found, what)


def test_a_pin_of_three_links_is_two_pairs_of_its_first_and_other_choices_are_told():
    """Of the toggle press's pin B: two ternary links joined, or apart, as its pairs are chosen."""
    found = planar.chain_of("toggle-press")
    assert found.multiple_pins == ("B",)
    assert {found.chain.name, *(each.name for each in found.others)} == {"Watt chain", "Stephenson chain"}
    pinned = [name for name in found.joints if name.startswith("B:")]
    assert len(pinned) == 2


def test_slides_are_told_as_joints():
    found = planar.chain_of("slider-crank")
    assert found.slides == (found.joints["stroke"],)
    assert planar.chain_of("four-bar").slides == ()


@pytest.mark.parametrize(
    "model, said",
    [
        ("gear-reducer", r"this pair \(gear\).*no chain of lower pairs alone"),
        ("valve-cam", r"this pair \(cam\)"),
        ("slotted-lever", r"this pair \(slot\)"),
        ("open-arm", "have one pair each: the chain is open"),
        ("three-parallel-cranks", "by count some links"),
    ],
)
def test_what_is_no_chain_is_said_why(model, said):
    with pytest.raises(planar.BadInput, match=said):
        planar.chain_of(model)


def test_two_drives_of_one_loop_fit_no_chain_of_two_loops():
    (parted,) = [chain for chain in planar.chains(7, 2) if chain.is_fractionated]
    loop = [number for number, edge in enumerate(parted.edges) if {*edge} <= {0, 1, 2, 3}]
    other = [number for number in range(parted.joints) if number not in loop]
    assert len(loop) == 4
    assert assur_groups(7, parted.edges, 0, (loop[0], loop[1])) is None
    assert assur_groups(7, parted.edges, 0, (loop[0], other[0])) is not None


def test_inspect_tells_the_chain_in_words_and_as_json(tmp_path):
    said = run(tmp_path, "inspect", "toggle-press").done()
    assert "chain 3 of those of 6 links, 1 slide and freedom 1 (Stephenson chain), 2 loops" in said
    assert "other choices give chains 1 and 4" in said
    said = " ".join(run(tmp_path, "inspect", "jansen-leg").done().split())
    assert "others of the same chain: by fixing k, shank, c at Y, A" in said  # that the field has no name for
    told = json.loads(run(tmp_path, "inspect", "double-butterfly", "--json").done())["structure"]
    assert (told["chain"]["number"], told["frame"], told["drives"]) == (8, 0, [1])
    told = json.loads(run(tmp_path, "inspect", "gear-reducer", "--json").done())
    assert told["structure"] is None
    assert "no chain of lower pairs" in told["structure_reason"]
