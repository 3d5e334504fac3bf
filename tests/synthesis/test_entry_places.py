"""On which branch and circuit entries are met, against Grashof's condition, discriminants and signs of sines."""

import re

import numpy as np
import pytest

import planar
from planar.document.revised.changed_numbers import with_values
from planar.synthesis.exact import exact_synthesis
from planar.synthesis.judgement.judgement import DesignJudge, check_file
from tests.builders import four_bar_document, slider_crank_document
from tests.closed_forms import PARALLELOGRAM, TRIPLE, TURN, rocker

COUPLER_POINT = 0.3 + 0.2j
"""In the axes of the coupler, whose length is 1 there."""
CIRCUIT, BRANCH = "one circuit", "one branch"


def defects_of(document, wanted, inputs, places, size=1.0):
    """Of an exact design the demands and entries (from 1) of the sentences that say where entries are met."""
    value = {"planar": 1, "units": {"angle": "rad"}, "start": document, "wanted": [wanted]}
    judge = DesignJudge(planar.read_task(value), size, is_exact=True)
    found = judge.judge(planar.from_dict(document), [np.array(inputs)], [np.array(places)])
    told = {}
    for each in found.defects:
        named = re.search(r"meets entr(?:y|ies) ([\d, and]+) at", each.sentence)
        assert named, each.sentence
        told |= {int(entry): (each.demand, each.sentence) for entry in re.findall(r"\d+", named[1])}
    return told, found


def expected_of(keys):
    """By the circuit and the branch (circuit, branch) of every entry: the demands that they fall short of."""
    first = keys[0]
    return {
        number: BRANCH if circuit == first[0] else CIRCUIT
        for number, (circuit, branch) in enumerate(keys, start=1)
        if (circuit, branch) != first
    }


class FourBar:
    """A four-bar by its lengths a, b, c, d, and closed forms for it."""

    def __init__(self, *lengths):
        self.lengths = lengths

    def radicand(self, theta):
        """Positive where it can be assembled: of the least cosine and sine of the angle at C."""
        a, b, c, d = self.lengths
        return 1.0 - ((b * b + c * c - a * a - d * d + 2 * a * d * np.cos(theta)) / (2 * b * c)) ** 2

    def place(self, theta, side):
        a, b, c, d = self.lengths
        phi = rocker(a, b, c, d, theta, side)
        start = a * np.exp(1j * theta)
        return start + COUPLER_POINT * (d + c * np.exp(1j * phi) - start)

    def circuit_and_branch(self, theta, side):
        """By the sign of the sine of an angle that is never 0 on the circuit: of Grashof's linkages one between links
        none of which is the least."""
        a, _, _, d = self.lengths
        least, *_, greatest = sorted(self.lengths)
        if least + greatest > 0.5 * sum(self.lengths):
            return 0, side
        if least in (a, d):
            return side, side
        return np.sign(np.sin(theta)), side

    def judged(self, entries):
        document = four_bar_document(*self.lengths, *entries[0], points={"E": self.point})
        places = [self.place(*each) for each in entries]
        values = [[each.real, each.imag] for each in places]
        through = [{"at": at, "input": theta} for at, (theta, _) in zip(values, entries, strict=True)]
        wanted = {"point": "E", "through": through, "absolute": True}
        return defects_of(document, wanted, [theta for theta, _ in entries], values)

    @property
    def point(self):
        return [COUPLER_POINT.real * self.lengths[1], COUPLER_POINT.imag * self.lengths[1]]


class SliderCrank:
    """A slider-crank by its crank r, its rod l and its offset e, driven by the crank."""

    def __init__(self, r, l, e):  # noqa: E741 - the letters of textbooks
        self.lengths = r, l, e

    def radicand(self, theta):
        r, l, e = self.lengths  # noqa: E741
        return 1.0 - ((e - r * np.sin(theta)) / l) ** 2

    def end(self, theta, side):
        """The rod's end, ahead of the crank's pin or behind it."""
        r, l, e = self.lengths  # noqa: E741
        return r * np.cos(theta) + side * l * np.sqrt(self.radicand(theta)) + 1j * e

    def circuit_and_branch(self, theta, side):
        r, l, e = self.lengths  # noqa: E741
        limits = int(r > l + e) + int(r > l - e)
        if not limits:
            return side, side
        return (0 if limits == 1 else np.sign(np.cos(theta))), side

    def judged(self, entries):
        ends = [self.end(*each) for each in entries]
        r, l, e = self.lengths  # noqa: E741
        document = slider_crank_document(
            r, l, entries[0][0], e, 0, sketch={"B": [float(ends[0].real), float(ends[0].imag)]}
        )
        pins = [r * np.exp(1j * theta) for theta, _ in entries]
        values = [[p.real, p.imag, np.angle(q - p)] for p, q in zip(pins, ends, strict=True)]
        poses = [
            {"at": at, "angle": angle, "input": theta} for (*at, angle), (theta, _) in zip(values, entries, strict=True)
        ]
        return defects_of(
            document, {"link": "rod", "poses": poses, "absolute": True}, [theta for theta, _ in entries], values
        )


def random_entries(rng, linkage, count=6):
    entries = []
    while len(entries) < count:
        theta = float(rng.uniform(-np.pi, np.pi))
        if linkage.radicand(theta) > 1e-4:
            entries.append((theta, int(rng.choice([-1, 1]))))
    return entries


def random_linkage(rng, kind):
    while True:
        linkage = FourBar(*rng.uniform(0.3, 1.0, 4)) if kind == "four-bar" else SliderCrank(*rng.uniform(0.1, 1.0, 3))
        if np.mean(linkage.radicand(np.linspace(0.0, TURN, 200)) > 1e-4) > 0.1:
            return linkage


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["four-bar", "slider-crank"])
def test_circuits_and_branches_of_entries_are_those_of_closed_forms(kind, seed):
    rng = np.random.default_rng([seed, len(kind)])
    linkage = random_linkage(rng, kind)
    entries = random_entries(rng, linkage)
    told, found = linkage.judged(entries)
    keys = [linkage.circuit_and_branch(*each) for each in entries]
    assert {entry: demand for entry, (demand, _) in told.items()} == expected_of(keys), (linkage.lengths, entries)
    is_first = np.array([key == keys[0] for key in keys])
    assert np.nanmax(found.misses[0][is_first]) < 1e-9
    for entry, (demand, sentence) in told.items():
        if demand == BRANCH:
            (point,) = re.findall(r"beyond the dead point at [AO] = ([-+.\de]+) rad;", sentence)
            assert abs(linkage.radicand(float(point))) < 1e-4, (entry, sentence)


def test_a_triple_rocker_has_one_circuit_and_its_dead_point_is_where_crank_and_frame_are_stretched():
    linkage = FourBar(*TRIPLE)
    told, found = linkage.judged([(0.3, 1), (0.5, 1), (0.7, -1), (-0.6, -1)])
    a, b, c, d = TRIPLE
    limit = np.arccos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
    assert [demand for demand, _ in told.values()] == [BRANCH, BRANCH]
    assert f"on the same circuit beyond the dead point at A = {limit:.6g} rad" in told[3][1]
    assert f"on the same circuit beyond the dead point at A = {-limit:.6g} rad" in told[4][1]
    assert "meets entry 3 at A = 0.7 rad" in told[3][1] and "on the branch of entry 1 the miss is" in told[3][1]
    assert not any("nowhere near" in each.sentence for each in found.defects)


def test_the_open_and_the_crossed_assembly_of_a_crank_rocker_are_two_circuits():
    told, _ = FourBar(0.3, 0.9, 0.7, 1.0).judged([(0.3, 1), (2.5, 1), (0.7, -1)])
    assert [*told] == [3] and told[3][0] == CIRCUIT and "on another circuit" in told[3][1]


def test_branches_that_cross_at_a_change_point_are_no_circuits():
    told, _ = FourBar(*PARALLELOGRAM).judged([(0.7, 1), (1.5, 1), (1.2, -1)])
    assert [*told] == [3] and told[3][0] == BRANCH
    assert "on a branch that crosses this one at a change point" in told[3][1]


def test_a_place_that_no_assembly_meets_is_no_defect_of_circuits():
    linkage = FourBar(*TRIPLE)
    document = four_bar_document(*TRIPLE, 0.3, 1, points={"E": linkage.point})
    own = linkage.place(0.3, 1)
    through = [{"at": [own.real, own.imag], "input": 0.3}, {"at": [5.0, 5.0], "input": 0.5}]
    value = {
        "planar": 1,
        "units": {"angle": "rad"},
        "start": document,
        "wanted": [{"point": "E", "through": through, "absolute": True}],
    }
    task = planar.read_task(value)
    judge = DesignJudge(task, 1.0, is_exact=True)
    defects = judge.judge(planar.from_dict(document), [np.array([0.3, 0.5])], [task.wanted[0].places]).defects
    assert defects[0].demand == "the reach" and defects[0].sentence.startswith("no assembly of it meets entry 2 of E")


def checked(scale):
    """The check of a triple rocker's file whose coupler is longer by a part than that which made the entries."""
    linkage, entries = FourBar(*TRIPLE), [(0.3, 1), (0.7, -1), (-0.6, -1)]
    a, b, c, d = TRIPLE
    document = four_bar_document(a, b * scale, c, d, 0.3, 1, points={"E": linkage.point})
    places = [linkage.place(*each) for each in entries]
    through = [{"at": [at.real, at.imag], "input": theta} for at, (theta, _) in zip(places, entries, strict=True)]
    wanted = {"point": "E", "through": through, "absolute": True}
    task = planar.read_task({"planar": 1, "units": {"angle": "rad"}, "start": document, "wanted": [wanted]})
    inputs = [np.array([theta for theta, _ in entries])]
    return check_file(planar.from_dict(document), task.wanted, inputs, 1.0)


@pytest.mark.parametrize("scale", [1.0, 1.0 + 4 * np.finfo(float).eps])
def test_a_file_meets_entries_on_all_branches_to_condition_times_round_off(scale):
    check = checked(scale)
    assert check.is_met and check.misses[0].max() < 1e-13 and check.tolerances[0].max() < 1e-10


def test_a_file_that_differs_says_by_how_much():
    check = checked(1.0 + 1e-8)
    assert not check.is_met and not check.is_rounded
    assert 1e-9 < check.misses[0].max() < 1e-6
    check = checked(0.1)
    assert np.isinf(check.misses[0][0]) and not check.is_met


def test_a_design_whose_file_is_wrong_is_not_called_proved_and_has_no_defect(monkeypatch):
    """A fault of the program is told once, with its size."""
    plain = exact_synthesis.exact_linkage

    def wrong(problem, solution, name):
        found = plain(problem, solution, name)
        longer = planar.dimensions(found.mechanism)["DC.length"] * (2.0 if name.endswith("1") else 1.0)
        return found._replace(mechanism=with_values(found.mechanism, {"DC.length": longer}))

    pairs = [[0, 0], [25, 14], [50, 33], [70, 51], [90, 75]]
    wanted = {"from": "A", "to": "D", "pairs": pairs}
    value = {"planar": 1, "units": {"angle": "deg"}, "start": "four-bar", "wanted": [wanted]}
    sound = planar.synthesise(value, complete=True)
    monkeypatch.setattr(exact_synthesis, "exact_linkage", wrong)
    found = planar.synthesise(value, complete=True)
    assert all(each.certified for each in sound) and len(found) == len(sound)
    last = found[-1]
    assert not last.certified and not last.defects and sum(not each.certified for each in found) == 1
    (remark,) = (each for each in found.remarks if "is not called proved" in each)
    assert remark.startswith(f"design {len(found)} ") and "fault of planar" in remark
