"""Equations and functions on disk: the same as those that are derived, and derived again where anything is amiss."""

import json
import os
from dataclasses import dataclass, replace

import pytest

import planar
from planar.equations import functions, mechanism_numbers
from planar.equations.functions import KEPT_EQUATIONS, EquationFunctions, equation_functions
from planar.equations.mechanism_numbers import equation_structure, structure_fingerprint
from planar.foundation import kept_texts, private_cache
from planar.foundation.kept_texts import KeptTexts, write_added_texts
from planar.model.pairs.turning import TurningPair
from tests.draws import first_cases

MODELS = ("four-bar", "planetary-gear-set", "scotch-yoke", "stephenson-3-five-bar", "balanced-lamp", "jansen-leg")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder of equations."""
    write_added_texts()
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path / "cache"))
    yield tmp_path / "cache" / KEPT_EQUATIONS.folder_name
    kept_texts._added.clear()


@pytest.fixture
def derived(monkeypatch):
    """The names of the functions that are derived from now on."""
    names, kept = [], EquationFunctions.kept

    def recording(program, name, make):
        return kept(program, name, lambda: names.append(name) or make())

    monkeypatch.setattr(EquationFunctions, "kept", recording)
    return names


def in_a_new_process(mechanism) -> EquationFunctions:
    """The functions of a mechanism, derived from the start, as a process has them that starts after this one."""
    write_added_texts()
    functions._cached_equation_functions.cache_clear()
    found = equation_functions(mechanism)
    found.compile()
    return found


def texts_of(program: EquationFunctions) -> list[str | None]:
    """The functions of the whole of a structure, as casadi writes them."""
    found = [program.kinematics_function, program.coordinate_function, program._residual_function]
    found += map(program.block_function, program.equations.blocks)
    if program.is_square:
        found.append(program.newton_function)
    return [each.serialize() for each in found]


def files(place):
    return [path for path in place.iterdir() if path.suffix == KEPT_EQUATIONS.suffix]


@pytest.mark.parametrize("name", first_cases(MODELS, 4))
def test_what_is_read_is_what_was_derived_to_the_last_digit(name, place, derived):
    mechanism = planar.load(name)
    first = texts_of(in_a_new_process(mechanism))
    count = len(derived)
    assert count
    assert texts_of(in_a_new_process(mechanism)) == first
    assert len(derived) == count
    assert len(files(place)) == 1
    # what is derived again is the same, too
    again = EquationFunctions(in_a_new_process(mechanism).equations)
    again.compile()
    assert texts_of(again) == first


def coordinates_in_a_new_process(mechanism):
    """The function of the coordinates of a mechanism."""
    return in_a_new_process(mechanism).coordinate_function


def test_mechanisms_that_differ_in_numbers_alone_share_a_file(place, derived):
    one = planar.load("four-bar")
    length = planar.dimensions(one)["BC.length"]
    for each in (one, one.with_values({"BC.length": 1.1 * length})):
        coordinates_in_a_new_process(each)
    assert derived == ["coordinate_function"]


@pytest.mark.parametrize("where", [0, 40, 100, -1])
def test_a_damaged_file_is_not_read_and_replaced(where, place, derived):
    mechanism = planar.load("slider-crank")
    coordinates_in_a_new_process(mechanism)
    write_added_texts()
    (path,) = files(place)
    right = path.read_bytes()
    wrong = bytearray(right)
    wrong[where] ^= 1
    path.write_bytes(wrong)
    coordinates_in_a_new_process(mechanism)
    write_added_texts()
    assert len(derived) == 2
    assert path.read_bytes() == right


def test_a_text_that_casadi_does_not_read_is_made_again(place, derived):
    mechanism = planar.load("slider-crank")
    first = texts_of(in_a_new_process(mechanism))
    write_added_texts()
    (path,) = files(place)
    KEPT_EQUATIONS.write(
        path.stem, json.dumps(dict.fromkeys(json.loads(KEPT_EQUATIONS.read(path.stem)), "other")).encode()
    )
    count = len(derived)
    assert texts_of(in_a_new_process(mechanism)) == first
    assert len(derived) == 2 * count
    assert texts_of(in_a_new_process(mechanism)) == first
    assert len(derived) == 2 * count


def test_nothing_is_kept_where_that_is_not_wanted_or_cannot_be(place, derived, tmp_path, monkeypatch):
    mechanism = planar.load("slider-crank")
    (tmp_path / "file").write_text("")
    for told in ("off", str(tmp_path / "file" / "below")):
        monkeypatch.setenv("PLANAR_CACHE", told)
        coordinates_in_a_new_process(mechanism)
        coordinates_in_a_new_process(mechanism)
    assert len(derived) == 4
    assert {path.name for path in tmp_path.iterdir()} == {"file"}


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="there are no users")
def test_what_another_user_could_have_written_is_not_read(place, derived):
    mechanism = planar.load("slider-crank")
    coordinates_in_a_new_process(mechanism)
    write_added_texts()
    files(place)[0].chmod(0o622)
    coordinates_in_a_new_process(mechanism)
    assert len(derived) == 2


def test_another_version_or_other_formulas_have_another_fingerprint(monkeypatch):
    structure = equation_structure(planar.load("slider-crank"))
    found = {structure_fingerprint(structure), structure_fingerprint(equation_structure(planar.load("four-bar")))}
    for holder, name, value in (
        (mechanism_numbers, "source_stamp", lambda rooms: "0.0"),
        (mechanism_numbers.ca.CasadiMeta, "version", lambda: "0.0"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(holder, name, value)
            found.add(structure_fingerprint(structure))
    assert len(found) == 4
    rooms = mechanism_numbers.EQUATION_ROOMS
    assert planar.__version__ in private_cache.source_stamp(rooms)
    assert all(f"{name}.py " in private_cache.source_stamp(rooms) for name in ("elimination", "turning", "jets"))


def test_a_pair_type_from_elsewhere_is_derived_each_time():
    @dataclass(frozen=True)
    class OwnPair(TurningPair):
        pass

    structure = equation_structure(planar.load("four-bar"))
    first, *others = structure.pairs
    assert structure_fingerprint(structure) is not None
    own = OwnPair(first.name, first.links, first.points, first.pin)
    assert structure_fingerprint(replace(structure, pairs=(own, *others))) is None


def test_nothing_is_written_out_for_a_folder_that_takes_nothing(place, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(private_cache.os, "access", lambda path, mode: False)
    KeptTexts(KEPT_EQUATIONS, "0" * 64).add("a", lambda: made.append(1) or "1")
    write_added_texts()
    assert (made, files(place)) == ([], [])
    monkeypatch.undo()
    monkeypatch.setenv("PLANAR_CACHE", "here")
    monkeypatch.chdir(tmp_path)
    KeptTexts(KEPT_EQUATIONS, "0" * 64).add("a", lambda: made.append(1) or "1")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    write_added_texts()
    assert made == list((tmp_path / "elsewhere").iterdir()) == []


def test_what_two_processes_add_is_there_and_no_more_than_has_room(place, monkeypatch):
    one, other = (KeptTexts(KEPT_EQUATIONS, "0" * 64) for _ in range(2))
    assert one.take("a") is None
    assert other.take("b") is None
    one.add("a", lambda: "1")
    other.add("b", lambda: "2")
    monkeypatch.setattr(kept_texts, "MAX_SUBJECTS", 2)
    KeptTexts(KEPT_EQUATIONS, "1" * 64).add("c", lambda: "3")
    write_added_texts()
    third = KeptTexts(KEPT_EQUATIONS, "0" * 64)
    assert (third.take("a"), third.take("b"), third.take("a")) == ("1", "2", None)
    assert len(files(place)) == 1
    monkeypatch.setattr(kept_texts, "MAX_TEXT_LENGTH", 4)
    third.add("d", lambda: "long")
    third.add("e", lambda: "4")
    write_added_texts()
    assert KeptTexts(KEPT_EQUATIONS, "0" * 64).take("d") is None
    assert KeptTexts(KEPT_EQUATIONS, "0" * 64).take("e") is None
