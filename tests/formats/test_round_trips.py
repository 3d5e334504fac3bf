"""A mechanism written for another program, and read again, moves the same; or a sentence says what cannot be said."""

import re

import numpy as np
import pytest

import planar
from planar.formats.known_formats import file_formats
from planar.reports.files.converted import written_text
from tests.draws import part
from tests.known import MODELS
from tests.round_trips import read_back, worst_deviation

WRITTEN = [name for name, each in file_formats().items() if each.write]
ROUNDED = {"pmksplus": 5e-4}
"""Of the mechanism's size; its lengths are rounded to 10 um, which a small mechanism feels."""


@pytest.mark.parametrize(("model", "name"), part([(m, n) for m in MODELS for n in WRITTEN], 4, 3))
def test_it_moves_the_same_after_a_round_trip_or_is_refused_by_name(model, name):
    mechanism = MODELS[model]
    try:
        written_text(mechanism, name)
    except planar.BadInput as problem:
        assert "cannot be said in this format" in problem.sentence
        assert re.search(r"'[^']+'", problem.sentence)
        return
    assert worst_deviation(mechanism, name) < ROUNDED.get(name, 1e-9)


def test_masses_go_through_linkage_sim():
    engine = planar.load("two-stroke-engine")
    back = {mass.link: mass for mass in read_back(engine, "linkage_sim").masses}
    for given in engine.masses:
        assert back[given.link].mass == given.mass
        assert back[given.link].inertia == pytest.approx(given.inertia)


def test_what_is_not_said_is_told():
    told = planar.convert("door-closer", to_format="pmks").notes
    assert any("springs" in each for each in told)
    assert any(
        "masses are left out" in each for each in planar.convert("two-stroke-engine", to_format="linkage2").notes
    )


def test_links_of_pmksplus_are_whole_by_their_last_sign():
    text = written_text(MODELS["four-bar"], "pmksplus").text.strip()
    body = text.partition("?")[2]
    assert "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"[(len(body) - 1) % 62] == body[-1]
    with pytest.raises(planar.BadInput, match="cut short or changed"):
        planar.convert(f"{text[:-3]}{text[-2:]}", from_format="pmksplus")


def test_a_link_is_a_model_by_itself():
    text = written_text(MODELS["four-bar"], "pmksplus").text.strip()
    state = planar.solve(text)
    assert np.allclose(state.point("C").position, planar.solve("four-bar").point("C").position, atol=1e-5)
