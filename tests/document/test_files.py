"""Opening files: what is found under a name, what is read from bytes, and every way in which that fails."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

import planar
from planar.document.files import MAX_FILE_BYTES, find_model_file, load_models, model_files
from planar.foundation.errors import BadInput
from tests.watchdog import watched

CRANK: dict[str, Any] = {
    "planar": 1,
    "name": "Kurbel 曲柄",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {"frame": {"points": {"O": [0, 0]}}, "crank": {"ends": ["O", "A"], "length": 50}},
    "pairs": [{"turning": "O"}],
    "inputs": [{"pair": "O", "position": 60, "velocity": "210 rpm"}],
}
TEXT = json.dumps(CRANK)


def refused(model: str | Path) -> BadInput:
    """How a file is refused: in one printable line of a readable length."""
    with watched(), pytest.raises(BadInput) as caught:
        planar.load(model)
    assert str(caught.value).isprintable()
    assert 20 < len(str(caught.value)) < 600
    return caught.value


def written(folder: Path, content: str | bytes, name: str = "crank.json") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


# what reads


def test_a_file_reads_by_its_path_as_text_or_path(tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    assert planar.load(path) == planar.load(str(path)) == planar.loads(TEXT) == planar.from_dict(CRANK)


def test_a_text_may_be_bytes_and_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    assert planar.loads(TEXT.encode()) == planar.loads(TEXT)
    assert planar.load(written(tmp_path, TEXT.encode("utf-8-sig"))) == planar.loads(TEXT)


def test_characters_of_any_language_survive_writing(tmp_path: Path) -> None:
    text = planar.dumps(planar.loads(TEXT))
    assert "Kurbel 曲柄" in text
    assert text.endswith("}\n")
    assert planar.load(written(tmp_path, text)).name == "Kurbel 曲柄"


def test_a_path_need_not_end_in_json(tmp_path: Path) -> None:
    assert planar.load(written(tmp_path, TEXT, "crank 曲柄")) == planar.from_dict(CRANK)


def test_the_largest_file_is_read(tmp_path: Path) -> None:
    assert planar.load(written(tmp_path, TEXT + " " * (MAX_FILE_BYTES - len(TEXT.encode())))) == planar.from_dict(CRANK)


# models that come along


def test_the_models_that_come_along_are_in_the_order_of_their_names() -> None:
    names = [file.stem for file in model_files()]
    assert names == sorted(names)
    assert len(set(names)) == len(names)
    assert [file for file, _ in load_models()] == list(model_files())


def test_a_model_is_found_by_its_name_and_by_its_ids(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for file, mechanism in load_models():
        for name in (file.stem, *mechanism.ids):
            assert find_model_file(name) == file
        assert planar.load(file.stem) == mechanism


def test_a_file_comes_before_a_model_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for file in model_files()[:1]:
        written(tmp_path, TEXT, file.stem)
        assert planar.load(file.stem) == planar.from_dict(CRANK)


def test_a_name_nearly_that_of_a_model_is_refused_with_the_model() -> None:
    for file in model_files()[:1]:
        assert repr(file.stem) in refused(file.stem + "x").sentence


# what does not


def test_what_is_no_file_and_no_model_is_refused_with_where_to_look() -> None:
    problem = refused("qqqqqqqqqqqq")
    assert problem.place == "qqqqqqqqqqqq"
    assert "no such file" in problem.sentence
    assert "`planar models`" in problem.sentence


def test_a_path_that_is_not_there_is_answered_with_the_file_beside_it_and_with_no_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "{}", "hart-inversor2.json")
    assert "did you mean 'hart-inversor2.json'?" in refused("hart-invresor2.json").sentence
    (tmp_path / "hart-inversor2.json").unlink()
    for name in ("hart-invresor2.json", "mechanism.json", "four-barr.json"):
        sentence = refused(name).sentence
        assert "no such file" in sentence
        assert "did you mean" not in sentence
    assert "there is no folder 'elsewhere'" in refused("elsewhere/four-bar.json").sentence


def test_an_ending_that_all_files_have_makes_no_two_alike(tmp_path: Path) -> None:
    written(tmp_path, "{}", "slots.json")
    assert "did you mean" not in refused(tmp_path / "missing.json").sentence
    assert "slots.json" in refused(tmp_path / "slot.json").sentence


def test_a_dash_stands_for_what_is_piped_in(monkeypatch: pytest.MonkeyPatch) -> None:
    def piped(content: bytes) -> None:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))

    piped(TEXT.encode())
    assert planar.load("-").name == CRANK["name"]
    piped(b"")
    assert "it is empty" in refused("-").sentence
    piped(b"[" + b" " * MAX_FILE_BYTES)
    assert "larger than" in refused("-").sentence
    piped(b"{")
    assert refused("-").place == "standard input"
    monkeypatch.setattr("sys.stdin", None)
    assert "it is empty" in refused("-").sentence


def test_a_models_name_in_other_letters_or_with_json_behind_is_answered_with_it() -> None:
    for name in ("FOUR-BAR", "four_bar", "four-bar.json", "four-bra"):
        assert "did you mean the model 'four-bar'?" in refused(name).sentence


@pytest.mark.parametrize("content", [b"PK\x03\x04\x00\xff", b"<svg/>", b"A,B\n1,2\n", b"%PDF-1.4"])
def test_a_file_of_another_kind_is_answered_with_what_is_read(content: bytes, tmp_path: Path) -> None:
    problem = refused(written(tmp_path, content, "x.docx"))
    assert "a .docx file and no mechanism; name a JSON file" in problem.sentence


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    problem = refused(tmp_path)
    assert problem.place == str(tmp_path)
    assert "folder" in problem.sentence


def test_a_link_that_leads_nowhere_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "dangling").symlink_to(tmp_path / "gone")
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    for name in ("dangling", "circle"):
        assert "no such file" in refused(tmp_path / name).sentence


@pytest.mark.parametrize("model", [TEXT, "x" * 5000, "/".join(["x" * 300] * 20), "a\0b", "a\nb"])
def test_what_cannot_be_the_name_of_a_file_is_refused(model: str) -> None:
    refused(model)


def test_a_file_that_may_not_be_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, TEXT)

    def barred(_: Path, *mode: str) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", barred)  # a superuser, as in a container, may read any file
    problem = refused(path)
    assert problem.place == str(path)
    assert "cannot be read: Permission denied" in problem.sentence


def test_a_file_too_large_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "large.json"
    with path.open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    problem = refused(path)
    assert problem.place == str(path)
    assert "8 MiB" in problem.sentence


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["not JSON", "line 1, column 1"]),
        ("   \n ", ["not JSON", "line 2"]),
        ("planar: 1", ["not JSON", "line 1, column 1"]),
        ('{"planar": 1,\n "name" "x"}', ["not JSON", "line 2, column 9"]),
        ("{'planar': 1}", ["not JSON", "line 1, column 2"]),
        ('{"planar": 1,}', ["not JSON", "line 1"]),
        ('{"planar": 1} {}', ["not JSON", "line 1, column 15"]),
        ('{"planar": 1 // format\n}', ["not JSON", "line 1"]),
        ('{"planar": 01}', ["not JSON", "line 1"]),
        ('{"name": "a\nb"}', ["not JSON", "line 1"]),
        ('{"name": "\\x41"}', ["not JSON", "line 1"]),
        ('{"planar": 1', ["not JSON", "line 1"]),
        (b"\x00" * 20, ["not JSON", "line 1"]),
        (b'{"name": "\xff"}', ["not UTF-8", "byte 10"]),
        ("{}".encode("utf-16"), ["not UTF-8", "byte 0"]),
        ("ä".encode("latin-1"), ["not UTF-8"]),
        (b"\x1f\x8b\x08compressed", ["not UTF-8"]),
        ('{"planar": NaN}', ["NaN", "not a number"]),
        ('{"planar": Infinity}', ["Infinity", "not a number"]),
        ('{"planar": -Infinity}', ["-Infinity", "not a number"]),
        ('{"planar": 1, "planar": 1}', ["'planar'", "twice"]),
        ('{"planar": 1, "links": {"AB": {}, "CD": {}, "AB": {}}}', ["'AB'", "twice"]),
        ('{"planar": 1, "links": {"AB": {"ends": 1, "ends": 2}}}', ["'ends'", "twice"]),
        ("[" * 20_000, ["nested too deeply"]),
        ("[" * 20_000 + "]" * 20_000, ["nested too deeply"]),
        ('{"a":' * 20_000 + "1" + "}" * 20_000, ["nested too deeply"]),
        ("9" * 5000, ["digits"]),
        ('{"planar": ' + "9" * 5000 + "}", ["digits"]),
    ],
    ids=lambda value: None if isinstance(value, list) else repr(value[:24]),
)
def test_what_is_not_json_is_refused_where_it_is_not(content: str | bytes, words: list[str], tmp_path: Path) -> None:
    sentence = refused(written(tmp_path, content)).sentence
    for word in words:
        assert word in sentence
    assert "sys." not in sentence  # a remedy for programmers


@pytest.mark.parametrize("depth", [50, 400])
@pytest.mark.parametrize(("left", "inner", "right"), [("[", "1", "]"), ('{"x":', "1", "}")])
def test_what_is_nested_deeply_but_reads_as_json_is_refused_as_a_value(
    left: str, inner: str, right: str, depth: int, tmp_path: Path
) -> None:
    for key in ("links", "pairs", "notes", "sketch", "name"):
        refused(written(tmp_path, TEXT[:-1] + f', "{key}2": ' + left * depth + inner + right * depth + "}"))
        value = json.loads(TEXT) | {key: json.loads(left * depth + inner + right * depth)}
        refused(written(tmp_path, json.dumps(value)))


@pytest.mark.parametrize(
    ("number", "words"),
    [("1e999", "too large"), ("-1e999", "above zero|too large"), ("9" * 400, "too large"), ("1e-999", "above zero")],
)
def test_a_number_out_of_range_is_refused_at_its_place(number: str, words: str, tmp_path: Path) -> None:
    problem = refused(written(tmp_path, TEXT.replace('"length": 50', f'"length": {number}')))
    assert problem.place == "$.links.crank.length"
    assert any(word in problem.sentence for word in words.split("|"))


def test_half_a_character_is_refused_at_its_place(tmp_path: Path) -> None:
    problem = refused(written(tmp_path, TEXT.replace('"name": "', '"name": "\\ud800')))
    assert problem.place == "$.name"
    whole = planar.load(written(tmp_path, TEXT.replace('"name": "', '"name": "\\ud83e\\uddbe')))
    assert whole.name.startswith("\U0001f9be")


def test_one_key_of_very_many_that_stands_twice_is_named(tmp_path: Path) -> None:
    keys = [f'"k{index}":0' for index in range(100_000)]
    assert "'k99999'" in refused(written(tmp_path, "{" + ",".join([*keys, keys[-1]]) + "}")).sentence


def test_very_many_unknown_keys_are_refused_at_the_first(tmp_path: Path) -> None:
    keys = ",".join(f'"k{index}":0' for index in range(30_000))
    assert refused(written(tmp_path, TEXT[:-1] + "," + keys + "}")).place == "$.k0"


@pytest.mark.parametrize("long", ["key", "name", "link", "unit", "frame", "pair"])
def test_a_very_long_word_is_refused_in_a_short_sentence(long: str, tmp_path: Path) -> None:
    word = "x" * 1_000_000
    value = json.loads(TEXT)
    if long == "key":
        value[word] = 1
    elif long == "name":
        value["links"]["frame"]["points"][word + "."] = [0, 0]
    elif long == "link":
        value["pairs"] = [{"turning": "O", "links": ["frame", word]}]
    elif long == "unit":
        value["links"]["crank"]["length"] = "5 " + word
    elif long == "frame":
        value["frame"] = word
    else:
        value["inputs"][0]["pair"] = word
    refused(written(tmp_path, json.dumps(value)))


def test_loads_names_the_place_that_it_is_told() -> None:
    with pytest.raises(BadInput) as caught:
        planar.document.files.loads("{", "a text")
    assert caught.value.place == "a text"
