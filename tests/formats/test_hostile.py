"""Files that are broken, or made to do harm: one sentence with the place, and nothing of them is run."""

import json
import pickle
from random import Random

import pytest

import planar
from planar.document.files import _read_foreign
from planar.formats.kinds.parts.ondsel_motion import motion_formula
from tests.foreign_samples import (
    FOUR_BARS,
    LINKAGE_SIM,
    OLD_PLUS_SLIDER,
    SLIDER_CRANKS,
    linkage2,
    mutated,
    pmksplus,
    pmksplus_cylinder,
)
from tests.round_trips import read_text

BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]><linkage2><connector id="&b;"/></linkage2>'


class Harm:
    def __reduce__(self):
        return (exec, ("raise SystemExit('run')",))


def changed(name, **more):
    return json.dumps(json.loads(FOUR_BARS[name]) | more)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.linkage2", BOMB, ["declares a type of document"]),
        ("a.linkage2", '<!doctype x SYSTEM "file:///etc/passwd"><linkage2/>', ["declares a type of document"]),
        ("a.linkage2", "<linkage2><connector id='1'", ["not XML", "line 1"]),
        ("a.linkage2", "<linkage2></linkage2>", ["no connector"]),
        ("a.linkage2", "<linkage2>" + "<a>" * 200 + "</a>" * 200 + "</linkage2>", ["nested deeper"]),
        ("a.linkage2", '<linkage2><connector id="1" x="1e999" y="0"/></linkage2>', ["connector 1", "'x'", "1e999"]),
        (
            "a.linkage2",
            '<linkage2><connector id="1" x="0" y="0"/><Link id="4"><connector id="9"/></Link></linkage2>',
            ["Link 4", "'9'"],
        ),
        (
            "a.linkage2",
            linkage2('A 9 0 anchor="true"\nB 9 0 anchor="true"\nC 5 0 slider="true" slideradius="8" ~A ~B', "C A"),
            ["connector 2", "coincide"],
        ),
        ("a.txt", "ground,a,R,0,0\nground,a,Q,0,0\nx\n", ["no mechanism"]),
        ("a.txt", "mech=ground,a,R,0,0\nfoo bar\n", ["joint 2", "foo bar"]),
        ("a.txt", "a,ground,R,0,0\nb,ground,R,10,0\na,b,G,5,4\n", ["joint 3", "cannot touch"]),
        ("a.txt", "a,ground,R,0,0\nb,c,R,10,0\na,b,G,5,0\n", ["joint 3", "no common link"]),
        (
            "a.pmks",
            changed("pmks-file", Joints=[{"X": "import os", "Y": 0, "TypeOfJoint": "R", "Links": ["a"]}]),
            ["$.Joints[0].X", "number"],
        ),
        (
            "a.pmks",
            changed("pmks-file", Joints=[{"X": 0, "Y": 0, "TypeOfJoint": "Z", "Links": ["a"]}]),
            ["TypeOfJoint", "'Z'"],
        ),
        ("a.url", pmksplus("1G.Fe.K,0.1011.MA,A,0,0,0.Gx..YRAB,AB,0,0,0,0,c,A,B,,...N_"), ["too few parts"]),
        ("a.url", pmksplus("1G.Fe.K,0.1011.MA,A,0,0,0..YRAB,AB,0,0,0,0,c,A,B,,...N_"), ["'B'", "not there"]),
        (
            "a.motiongen",
            json.dumps({"name": "motiongen-pro", "mechanism": {"joints": [{"id": "1", "x": None}], "links": []}}),
            ["joints[0]", "'x'"],
        ),
        (
            "a.motiongen",
            json.dumps({"joints": [], "links": [{"joints": ["q"]}], "slots": [], "actuators": []}),
            ["links[0]", "'q'"],
        ),
        ("a.pyslvs", "M[J[R, P[0, __import__('os')], L[a]]]", ["line 1", "number is wanted"]),
        ("a.pyslvs", "M[J[R, P[0, 0], L[ground, a]]", ["']'"]),
        ("a.pyslvs", "mechanism: !!python/object/apply:os.system ['M[x']\n", ["no mechanism"]),
        ("a.pyslvs", "mechanism: M[J[Q, P[0, 0], L[a]]]\n", ["type R, P or RP", "'Q'"]),
        (
            "a.json",
            changed("pylinkage", links=[{"id": "a", "type": "exec", "joints": []}]),
            ["links[0].type", "'exec'"],
        ),
        (
            "a.json",
            FOUR_BARS["pylinkage"].replace("[90.0, 70.0]", "[null, null]"),
            ["position", "before it was solved"],
        ),
        ("a.json", json.dumps(LINKAGE_SIM | {"schema_version": "9"}), ["schema_version", "'9'"]),
        (
            "a.json",
            json.dumps(LINKAGE_SIM | {"joints": {"J": {"type": "revolute", "body_i": "no"}}}),
            ["$.joints.J.body_i", "'no'"],
        ),
        ("a.asmt", FOUR_BARS["ondsel"].replace("0.03 0.04 0.0", "0.03 a 0.0", 1), ["line", "3 numbers"]),
        ("a.asmt", FOUR_BARS["ondsel"].replace("/Asm/AB/b", "/Asm/AB/z", 1), ["joint B", "marker"]),
        ("a.asmt", FOUR_BARS["ondsel"].replace("2.0d*pi*time", "__import__('os').system('x')"), ["formula"]),
        ("a.asmt", FOUR_BARS["ondsel"].replace("0.09 0.07 0.0", "0.08 0.07 0.0", 1), ["joint", "apart"]),
    ],
)
def test_it_ends_with_one_sentence_that_names_the_place(name, content, words, tmp_path):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(planar.BadInput) as raised:
        planar.load(path)
    told = str(raised.value)
    assert [word for word in words if word not in told] == []
    assert "\n" not in told


def test_a_pickled_project_is_not_unpickled(tmp_path):
    path = tmp_path / "a.pyslvs"
    path.write_bytes(pickle.dumps(Harm()))
    with pytest.raises(planar.BadInput, match=r"UTF-8|no mechanism"):
        planar.load(path)


@pytest.mark.parametrize(
    "formula", ["().__class__", "time**9**9**9", "(" * 500 + "1" + ")" * 500, "1/0", "sin", "9^9^9^9^9", "1e400"]
)
def test_a_formula_is_arithmetic_or_refused(formula):
    with pytest.raises(planar.BadInput, match="formula"):
        motion_formula(formula, "here")


@pytest.mark.parametrize(
    ("formula", "at", "value"),
    [
        ("2.0d*pi*time", 0.5, 3.141592653589793),
        ("-(1 + 2*time)^2/4", 1.0, -2.25),
        ("70*sin((360*time - 90)*pi/180.0d)", 0.5, 70.0),
    ],
)
def test_formulas_are_worked_out_by_the_rules_of_arithmetic(formula, at, value):
    assert motion_formula(formula, "here")(at) == pytest.approx(value)


def test_names_that_would_be_marks_are_plain_here():
    mechanism = read_text("ground,a.b,R,0,0\na.b,c:d,R,10,0\nground,c:d,R,20,5\n")
    assert [link.name for link in mechanism.links] == ["ground", "a_b", "c_d"]


def test_texts_that_are_cut_short_anywhere_are_refused_in_a_sentence(tmp_path):
    for name, text in FOUR_BARS.items():
        for cut in range(1, len(text), max(1, len(text) // 23)):
            path = tmp_path / f"cut-{name}"
            path.write_text(text[:cut])
            try:
                planar.load(path)
            except planar.BadInput as problem:
                assert "\n" not in str(problem)


def slices(count):
    """Some mutations of each sample, always the same ones."""
    texts = [*FOUR_BARS.items(), *SLIDER_CRANKS.items(), ("linkage_sim", json.dumps(LINKAGE_SIM))]
    texts += [("pmksplus", OLD_PLUS_SLIDER), ("pmksplus", pmksplus_cylinder(0.7, 4.0, 2.0, 4.0))]
    draw = Random(20)
    return [(name, mutated(text, draw)) for name, text in texts for _ in range(count)]


def with_last_sign(name, text):
    """A link of PMKS+ with the sign that fits its length, so that its parts are read."""
    code = text.partition("?")[2]
    return pmksplus(code[:-1]) if name == "pmksplus" and code and "j=" not in code else text


def test_mutated_files_of_every_program_are_read_or_refused_in_a_sentence():
    read = 0
    for name, text in slices(8):
        content = with_last_sign(name, text).encode()
        try:
            mechanism = _read_foreign(content, "a.txt", name, None)[0]
        except planar.BadInput as problem:
            assert "\n" not in str(problem)
            continue
        read += 1
        assert mechanism.links and mechanism.pairs
    assert read > 10


JOINT_TWICE = """mech=
ground,crank,R,0.0,0.0,0.0,tfft
ground,hip,c,R,-38.0,-7.8,0.0,tfff
crank,j,c,R,-38.0,-7.8,0.0,tfff
j,hip,R,-38.0,33.7,0.0,tfff
"""


def test_an_input_between_links_that_share_two_pins_is_refused(tmp_path):
    path = tmp_path / "twice.txt"
    path.write_text(JOINT_TWICE)
    with pytest.raises(planar.BadInput, match="the input at 'A' cannot move: the two links that it drives share two"):
        planar.load(path)


@pytest.mark.parametrize(
    "address",
    [
        "https://example.org/mechanisms/4?id=7",
        "http://example.org",
        "www.example.org/x",
        "ftp://example.org/a.linkage2",
        "app.pmksplus.com/?something",
    ],
)
def test_an_address_that_no_reader_knows_is_called_a_link(address):
    with pytest.raises(planar.BadInput) as raised:
        planar.load(address)
    message = str(raised.value)
    assert message.startswith(f"link {address}: no reader knows this link")
    assert all(form in message for form in ("?mech=...", "?j=...&l=...", "?CODE", "planar:..."))
    assert "no such file" not in message
