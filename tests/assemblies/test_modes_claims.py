"""What a list of assemblies claims: which are double, that these are all, or why there is none."""

from math import pi

import pytest

import planar
from planar.assemblies.polynomial.completeness import Completeness
from tests.builders import bar_linkage, bare_four_bar, tower


def test_without_certifying_nothing_is_called_proved():
    modes = planar.modes(planar.load("watt-six-bar"), certify=False)
    assert modes.complete is Completeness.NUMERICALLY
    assert not any(mode.certified for mode in modes)


def test_without_the_library_of_intervals_that_is_said(monkeypatch):
    monkeypatch.setattr("planar.assemblies.modes.find_spec", lambda name: None)
    modes = planar.modes(planar.load("four-bar"))
    assert modes.complete is Completeness.NUMERICALLY
    assert any("planar-linkages[modes]" in sentence for sentence in modes.remarks)


def test_a_dead_point_is_an_assembly_without_rates():
    # B at (0, 3), D at (4, 0), so that coupler and rocker are in line
    stretched = bare_four_bar(3.0, 2.0, 3.0, 4.0, pi / 2.0)
    modes = planar.modes(stretched)
    assert modes
    assert all(mode.state is None and mode.outcome is planar.Outcome.DEAD_POINT for mode in modes)
    assert all("cannot move" in mode.reason for mode in modes)
    assert modes[0].points["C"] == pytest.approx([1.6, 1.8], abs=1e-6)
    assert [mode.double for mode in modes] == [True]


def test_what_cannot_be_assembled_has_none_and_a_sentence():
    mechanism = bare_four_bar(1.0, 0.5, 0.5, 3.2, 0.8)
    modes = planar.modes(mechanism)
    assert not modes
    assert len(modes) == 0
    assert list(modes) == []
    assert modes.nearest is None
    with pytest.raises(planar.NoAnswer) as refused:
        planar.solve(mechanism)
    assert modes.reason == refused.value.reason
    assert [group.real for group in modes.groups] == [(0, 0)]


def test_two_assemblies_that_lie_very_near_are_two():
    modes = planar.modes(bare_four_bar(1.0, 1.7, 1.3 + 1e-11, 4.0, 0.0))
    assert [(mode.certified, mode.double) for mode in modes] == [(True, False)] * 2
    assert modes.complete.value == "complete"


def test_a_double_root_that_rounding_does_not_explain_is_none():
    """Coupler and rocker are 1e-11 too short to meet: what comes nearest is no assembly, as `solve` says too."""
    short = bare_four_bar(1.0, 1.7, 1.3 - 1e-11, 4.0, 0.0)
    modes = planar.modes(short)
    assert list(iter(modes)) == []
    assert modes.complete is Completeness.PROVED
    with pytest.raises(planar.NoAnswer) as refused:
        planar.solve(short)
    assert modes.reason == refused.value.reason
    assert [mode.double for mode in planar.modes(bare_four_bar(1.0, 1.7, 1.3, 4.0, 0.0))] == [True]


def test_two_assemblies_beside_a_curve_are_far_apart_and_not_double():
    for certify in (True, False):
        modes = planar.modes(bare_four_bar(1.0, 2.0, 2.0, 1.0, 1e-7), certify=certify)
        assert [mode.double for mode in modes] == [False] * 2
        assert sorted(mode.points["C"][0] for mode in modes) == pytest.approx([-1.0, 3.0])


def hung_on_a_kite(more: dict | None = None) -> planar.Mechanism:
    """A kite folded on itself, C anywhere on a circle about D, and two bars from there to a pin on the frame."""
    frame = {"A": [0.0, 0.0], "D": [1.0, 0.0], "Q": [3.5, 0.0], "G": [0.0, 2.0], "H": [0.0, 3.0]}
    links = {
        "crank": ("A", "B", 1.0),
        "c": ("B", "C", 1.0),
        "r": ("D", "C", 1.0),
        "e": ("C", "E", 0.9),
        "f": ("Q", "E", 0.9),
    }
    return bar_linkage(frame, links | (more or {}), ("A", 0.0), {"C": [2.0, 0.0]})


def test_a_curve_ahead_of_another_group_leaves_the_list_open():
    modes = planar.modes(hung_on_a_kite(), certify=False)
    list(iter(modes))
    assert modes.complete.value == "not known to be complete"


def test_where_one_place_of_a_curve_leads_to_nothing_no_more_is_said():
    mechanism = hung_on_a_kite()
    assert planar.solve(mechanism).point("C").position == pytest.approx([2.0, 0.0])  # there is one
    refused = planar.modes(mechanism).refusal()
    assert refused.outcome is planar.Outcome.CHANGE_POINT
    assert "may with others" in refused.reason


def test_what_does_not_hang_on_a_curve_cannot_be_assembled_all_the_same():
    short = {"g": ("G", "I", 0.1), "h": ("H", "I", 0.1)}
    refused = planar.modes(hung_on_a_kite(short)).refusal()
    assert refused.outcome is planar.Outcome.CANNOT_BE_ASSEMBLED


def test_what_is_said_of_the_list_does_not_depend_on_how_far_it_was_read():
    for many, said in ((5, "complete"), (9, "numerically complete")):  # up to 256 are certified for the claim
        modes = planar.modes(tower(many))
        assert modes[0].certified
        assert modes.complete.value == said
    long_list = planar.modes(tower(13), certify=False)  # up to 4096 are solved for their number
    assert long_list[0].number == 1
    assert len(long_list) == 2**13
    assert long_list.complete is Completeness.NUMERICALLY
