"""`planar convert`, and other programs' files where a MODEL is wanted."""

import json

import numpy as np
import pytest

import planar
from tests import command
from tests.foreign_samples import FOUR_BARS, LINKAGE_SIM


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "crank.linkage2").write_text(FOUR_BARS["linkage2"])
    (tmp_path / "mech.txt").write_text(FOUR_BARS["pmks"])
    return tmp_path


def test_a_file_becomes_planars_own_and_says_what_is_left_out(folder):
    done = command.run(folder, "convert", "mech.txt", "-o", "mech.json")
    assert (done.status, done.out) == (0, "")
    assert done.err == "planar: the file names no unit of length; its numbers are taken as mm\n"
    value = json.loads((folder / "mech.json").read_text())
    assert value["notes"] == ["the file names no unit of length; its numbers are taken as mm"]
    assert planar.solve(planar.load(folder / "mech.json")).residual < 1e-12


def test_every_command_takes_such_files(folder):
    shown = json.loads(command.run(folder, "solve", "crank.linkage2", "--json").done())
    assert shown["points"]["E"]["position"] == pytest.approx([0.06, 0.09])
    assert "four-bar" in command.run(folder, "inspect", "mech.txt").done()
    other = json.loads(command.run(folder, "solve", "crank.linkage2", "--set", "A.position=60deg", "--json").done())
    assert other["links"]["L0"]["angle"] == pytest.approx(np.radians(60))


def test_the_ending_chooses_the_program_and_a_name_does(folder):
    told = command.run(folder, "convert", "four-bar", "-o", "four.pyslvs")
    assert told.status == 0 and "velocity of the input is not said" in told.err
    assert (folder / "four.pyslvs").read_text().startswith('mechanism: "M[J[R, P[0.0, 0.0], L[ground, AB]]')
    shown = command.run(folder, "convert", "slider-crank", "--to-format", "linkage_sim", "--json").done()
    assert json.loads(json.loads(shown)["text"])["joints"]["stroke"]["type"] == "prismatic"
    assert json.loads(shown)["from"] == "planar"


def test_what_cannot_be_said_names_the_pair_and_writes_nothing(folder):
    sentence = command.run(folder, "convert", "valve-cam", "-o", "cam.linkage2").refused(2)
    assert sentence == "Linkage (Rector): the cam 'lift' cannot be said in this format"
    assert not (folder / "cam.linkage2").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["convert"], "name the MODEL"),
        (["convert", "four-bar", "-o", "x.foo"], "ends in '.foo'"),
        (["convert", "four-bar", "--to-format", "autocad"], "there is no such format; formats are linkage2"),
        (["convert", "four-bar", "--to-format", "ondsel"], "is only read"),
        (["convert", "mech.txt", "--from-format", "pyslvs"], "no entry 'mechanism'"),
        (["convert", "mech.txt", "-o", "mech.txt"], "would be lost"),
        (["convert", "--formats", "--set", "a=1"], "name the MODEL"),
    ],
)
def test_wrong_words_are_answered_in_a_sentence(words, told, folder):
    assert told in command.run(folder, *words).refused(2)


def test_the_formats_are_listed(folder):
    listed = json.loads(command.run(folder, "convert", "--formats", "--json").done())
    assert {"linkage2", "pmks", "pmksplus", "motiongen", "pyslvs", "pylinkage", "linkage_sim", "ondsel"} <= {
        each["format"] for each in listed
    }
    assert all(each["source"] for each in listed)
    assert "MotionGen" in command.run(folder, "convert", "--formats").done()


def test_python_gives_the_mechanism_and_what_is_left_out(folder):
    found = planar.convert(folder / "mech.txt", folder / "mech.linkage2")
    assert (found.source_format, found.target_format) == ("pmks", "linkage2")
    assert found.notes and found.mechanism.name == "mech"
    assert repr(found) == "<Conversion of 'mech' from pmks to linkage2, 1 notes>"
    assert planar.load(folder / "mech.linkage2").links[1].name == "AB"
    sim = folder / "slider.json"
    sim.write_text(json.dumps(LINKAGE_SIM))
    with pytest.raises(planar.NoAnswer, match="too few inputs"):
        planar.cycle(sim)
