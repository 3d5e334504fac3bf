"""Every assembly at given inputs: as many as closed forms say, each solved by its number, listed as it is read."""

import json
import pickle
from itertools import islice
from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from PIL import Image

import planar
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.search_tree import _Count
from planar.drawing.paper.picture import Circle, Label
from planar.drawing.paper.scales import parse_scale
from planar.drawing.scheme import symbol_table
from planar.drawing.scheme.assemblies import ASSEMBLIES_PER_SHEET, assembly_sheets
from tests import command, known
from tests.builders import bar_linkage, bare_four_bar, lift_document, tower
from tests.draws import is_exhaustive, part
from tests.linkages import conditioning, determinate, random_linkage

MODELS = [*known.MODELS.items()]


def meeting(p, q, r, s) -> list[np.ndarray]:
    """Where circles about p and q with radii r and s meet, to the left of the way from p to q first."""
    p, q = np.array(p), np.array(q)
    far = hypot(*(q - p))
    if not abs(r - s) < far < r + s:
        return []
    way = (q - p) / far
    along = (r * r - s * s + far * far) / (2.0 * far)
    up = sqrt(r * r - along * along) * np.array([-way[1], way[0]])
    return [p + along * way + up, p + along * way - up]


def same_places(state: planar.State, mode: planar.Mode, off: float = 1e-9) -> bool:
    size = max(float(np.abs(at).max()) for at in mode.points.values()) or 1.0
    return all(np.abs(state.point(name).position - at).max() < off * size for name, at in mode.points.items())


def test_a_four_bar_has_its_two_mirror_images_and_no_more():
    modes = planar.modes(bare_four_bar(1.0, 3.0, 2.5, 3.2, 0.8))
    assert len(modes) == modes.bound == 2
    b, d = np.array([cos(0.8), sin(0.8)]), np.array([3.2, 0.0])
    expected = meeting(b, d, 3.0, 2.5)
    found = [mode.points["C"] for mode in modes]
    assert np.array(sorted(map(tuple, found))) == pytest.approx(np.array(sorted(map(tuple, expected))), abs=1e-12)
    way = (d - b) / hypot(*(d - b))
    mirrored = b + 2.0 * ((found[0] - b) @ way) * way - (found[0] - b)
    assert found[1] == pytest.approx(mirrored, abs=1e-12)


def test_the_number_of_an_assembly_stays_as_the_crank_turns():
    sides = []
    for at in np.linspace(0.0, 2.0 * pi, 13):
        mode = planar.modes(bare_four_bar(1.0, 3.0, 2.5, 3.2, float(at)), certify=False)[0]
        b, c, d = (mode.points[name] for name in "BCD")
        sides.append(np.sign((d - b)[0] * (c - b)[1] - (d - b)[1] * (c - b)[0]))
    assert abs(sum(sides)) == 13


def test_a_slider_crank_has_two_by_the_closed_form():
    mechanism = planar.load("slider-crank")
    r, rod = (next(link.length for link in mechanism.links if link.name == name) for name in ("crank", "rod"))
    at = mechanism.inputs[0].position
    modes = planar.modes(mechanism)
    half = sqrt(rod**2 - (r * sin(at)) ** 2)
    assert len(modes) == 2
    assert sorted(mode.points["B"][0] for mode in modes) == pytest.approx([r * cos(at) - half, r * cos(at) + half])


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "stephenson-3-five-bar", "jansen-leg", "scotch-yoke"])
def test_where_all_complex_solutions_are_certified_the_list_is_called_complete(name):
    modes = planar.modes(planar.load(name))
    assert modes.complete is Completeness.PROVED
    assert all(mode.certified for mode in modes)
    assert all(group.found == (group.expected,) * 2 for group in modes.groups)


def test_a_watt_six_bar_has_four_two_for_each_of_the_first_loop():
    links = {
        "crank": ("A", "B", 1.0),
        "coupler": ("B", "C", 3.0),
        "rocker": ("D", "C", 2.5),
        "link": ("C", "E", 3.0),
        "last": ("F", "E", 3.0),
    }
    frame = {"A": [0.0, 0.0], "D": [3.2, 0.0], "F": [5.0, 0.3]}
    modes = planar.modes(bar_linkage(frame, links, ("A", 0.8)))
    assert len(modes) == modes.bound == 4
    expected = [
        (*c, *e) for c in meeting([cos(0.8), sin(0.8)], frame["D"], 3.0, 2.5) for e in meeting(c, frame["F"], 3.0, 3.0)
    ]
    found = [(*mode.points["C"], *mode.points["E"]) for mode in modes]
    assert np.array(sorted(found)) == pytest.approx(np.array(sorted(expected)), abs=1e-12)
    assert [mode.choices for mode in modes] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert [mode.number for mode in modes] == [1, 2, 3, 4]


def test_the_order_does_not_depend_on_the_sketch():
    mechanism = planar.load("jansen-leg")
    first = planar.modes(mechanism, certify=False)
    for mode in first:
        again = planar.modes(mode.mechanism, certify=False)
        assert again.nearest.number == mode.number
        assert all(np.array_equal(a.z, b.z) for a, b in zip(first, again, strict=True))


@pytest.mark.parametrize(("name", "mechanism"), part([each for each in MODELS if each[1].closes_within is None], 3))
def test_of_every_model_the_solved_assembly_is_listed_and_is_the_nearest(name, mechanism):
    modes = planar.modes(mechanism, certify=False)
    near = modes.nearest
    assert same_places(planar.solve(mechanism), near)
    assert modes[near.number - 1].choices == near.choices
    shown = list(modes[:6])
    assert len({mode.z.round(7).tobytes() for mode in shown}) == len(shown)
    for mode in shown if len(mechanism.links) < 10 else shown[:2]:
        if mode.state is not None:  # its own sketch leads back to it
            assert same_places(mode.state, mode)
            assert same_places(planar.solve(mode.mechanism), mode)


@pytest.mark.parametrize("seed", range(30))
def test_of_random_linkages_the_assembly_that_was_built_is_listed(seed):
    built = random_linkage(seed, 2 + seed % 5, higher=0.3 * (seed % 3 == 2))
    mechanism = planar.from_dict(built.value)
    if not determinate(mechanism, built):
        return
    modes = planar.modes(mechanism, certify=False)
    solver = modes._solver
    names = {name: frame for name, frame in built.frames.items() if name in dict.fromkeys(mode_links(mechanism))}

    def apart(mode: planar.Mode) -> float:
        gaps = [
            max(abs(at.x - frame.x), abs(at.y - frame.y), abs(np.exp(1j * at.angle) - np.exp(1j * frame.angle)))
            for at, frame in ((mode.frames[name], frame) for name, frame in names.items())
        ]
        return float(max(gaps))

    nearest = min(modes, key=apart)
    assert apart(nearest) < 1e-6 or conditioning(solver, nearest.z) < 1e-4


def mode_links(mechanism: planar.Mechanism) -> list[str]:
    return [link.name for link in mechanism.links]


def test_several_inputs_and_moved_ones_are_heeded():
    mechanism = planar.load("excavator-arm")
    assert len(mechanism.inputs) == 3
    modes = planar.modes(mechanism, certify=False)
    assert len(modes) == 16
    given = mechanism.inputs[0]
    moved = {given.pair: given.position * 1.02}
    there = planar.modes(mechanism, moved, certify=False)
    assert there.mechanism.inputs[0].position == moved[given.pair]
    assert same_places(planar.solve(mechanism, moved), there.nearest)


def test_what_the_inputs_leave_free_is_refused():
    five = bar_linkage(
        {"A": [0.0, 0.0], "E": [3.0, 0.0]},
        {"1": ("A", "B", 1.0), "2": ("B", "C", 2.0), "3": ("C", "D", 2.0), "4": ("D", "E", 1.0)},
        ("A", 1.0),
    )
    with pytest.raises(planar.NoAnswer) as refused:
        planar.modes(five)
    assert refused.value.outcome is planar.Outcome.TOO_FEW_INPUTS


def test_a_chain_of_twenty_dyads_is_listed_lazily_from_its_start():
    modes = planar.modes(tower(20), certify=False)
    assert modes.bound == 2**20
    first = list(islice(modes, 5))
    assert [mode.choices[-3:] for mode in first] == [(1, 1, 1), (1, 1, 2), (1, 2, 1), (1, 2, 2), (2, 1, 1)]
    assert sum(group.solved for group in modes.groups) < 40
    assert len(modes) == modes.total == 2**20
    for mode in first:
        b, p, q = (mode.points[name] for name in ("B", "P0", "P1"))
        assert hypot(*(p - b)) == pytest.approx(0.9)
        assert hypot(*(q - p)) == pytest.approx(0.9)


def test_groups_that_hang_on_one_another_are_counted_by_listing():
    modes = planar.modes(tower(7), certify=False)
    assert len(modes) == modes.bound == 2**7
    assert len({mode.z.round(9).tobytes() for mode in modes}) == 2**7


def test_congruent_positions_are_counted_once_and_to_the_same_number():
    """A scissor lift: counted by listing, and by how the links lie to each other."""
    for stages in (3, 6 if is_exhaustive() else 4):
        modes = planar.modes(planar.from_dict(lift_document(stages)), certify=False)
        tree = modes._uncertified_tree
        z = np.zeros(len(tree.setup.equations.unknowns))
        counted = _Count(tree, tree._congruence_key, [{} for _ in tree.stages], [100]).count_from(0, z)
        assert counted == len(list(modes)) == 2**stages
    modes = planar.modes(planar.from_dict(lift_document(20)), certify=False)
    assert len(modes) == modes.bound == 2**20
    lines = str(modes).splitlines()
    assert lines[0].endswith("1048576>")
    assert (len(lines), lines[-1]) == (7, "and 1048571 more")
    assert modes.nearest.number is not None


def test_a_list_that_cannot_be_counted_has_a_bound_and_is_read_one_by_one():
    """Dyads from pin to pin and to pivots of the frame, none congruent to another."""
    frame, links = {"A": [0.0, 0.0]}, {"crank": ("A", "P0", 1.0)}
    for k in range(20):
        frame[f"O{k}"] = [0.37 * k, 0.1 * k * k % 1.0]
        links |= {f"a{k}": (f"P{k}", f"P{k + 1}", 50.0), f"b{k}": (f"O{k}", f"P{k + 1}", 50.1 + 0.03 * k)}
    modes = planar.modes(bar_linkage(frame, links, ("A", 0.5)), certify=False)
    assert modes.total is None
    with pytest.raises(TypeError, match=f"up to {2**20}"):
        len(modes)
    assert [mode.number for mode in islice(modes, 3)] == [1, 2, 3]


def test_groups_that_do_not_hang_on_each_other_are_counted_without_listing():
    count, frame, links = 20, {"A": [0.0, 0.0]}, {"crank": ("A", "B", 1.0)}
    for k in range(count):
        angle = 2.0 * pi * k / count
        frame[f"O{k}"] = [3.0 * cos(angle), 3.0 * sin(angle)]
        links |= {f"rod{k}": ("B", f"C{k}", 3.0), f"rocker{k}": (f"O{k}", f"C{k}", 2.5)}
    modes = planar.modes(bar_linkage(frame, links, ("A", 0.5)), certify=False)
    assert modes.total == modes.bound == 2**20
    assert [group.solved for group in modes.groups] == [1] * count
    number = sum((choice - 1) << place for place, choice in enumerate(reversed(modes.nearest.choices[-count:])))
    assert modes.nearest.number == 1 + number
    assert modes[3].choices[-2:] == (2, 2)


def test_a_group_that_never_goes_together_ends_the_search_at_once():
    count, frame, links = 30, {"A": [0.0, 0.0]}, {"crank": ("A", "B", 1.0)}
    for k in range(count):
        frame[f"O{k}"] = [3.0, 0.1 * k]
        length = 2.5 if k < count - 1 else 0.1
        links |= {f"rod{k}": ("B", f"C{k}", length), f"rocker{k}": (f"O{k}", f"C{k}", length)}
    modes = planar.modes(bar_linkage(frame, links, ("A", 0.5)), certify=False)
    assert not modes
    assert modes.total == 0
    assert sum(group.solved for group in modes.groups) == count


def test_the_list_is_a_sequence():
    modes = planar.modes(tower(3), certify=False)
    assert modes[-1].number == 8
    assert [mode.number for mode in modes[2:5]] == [3, 4, 5]
    assert [mode.number for mode in modes[::-1]] == [*range(8, 0, -1)]
    assert [mode.number for mode in reversed(modes)] == [*range(8, 0, -1)]
    with pytest.raises(IndexError, match="8 assemblies"):
        _ = modes[8]


def test_the_command_lists_them_in_a_process_of_its_own(tmp_path):
    text = command.process(tmp_path, "modes", "jansen-leg", "--limit", "3", "--point", "foot").done()
    assert "8 assemblies" in text
    assert "the first 3 are listed" in text
    assert "foot" in text
    value = json.loads(command.run(tmp_path, "modes", "four-bar", "--json").done())
    assert (value["assemblies"], value["bound"], value["nearest"]) == (2, 2, 1)
    assert [mode["number"] for mode in value["modes"]] == [1, 2]
    assert [group["links"] for group in value["groups"]] == [["BC", "DC"]]
    text = command.run(tmp_path, "modes", "four-bar", "--at", "A=80deg", "--no-certify").done()
    assert "at A = 80 deg" in text
    assert "the nearest to the sketch" in text


def test_the_command_refuses_in_a_sentence(tmp_path):
    (tmp_path / "far.json").write_text(planar.dumps(bare_four_bar(1.0, 0.5, 0.5, 3.2, 0.8)), encoding="utf-8")
    assert "cannot be joined" in command.run(tmp_path, "modes", "far.json").refused(1)
    assert "cannot be joined" in command.run(tmp_path, "solve", "far.json", "--mode", "1").refused(1)
    assert "there are 2 assemblies" in command.run(tmp_path, "solve", "four-bar", "--mode", "3").refused(2)
    assert "no point 'Z'" in command.run(tmp_path, "modes", "four-bar", "--point", "Z").refused(2)
    words = ("plot", "four-bar", "modes", "-o", "a.png")
    assert "modes does not use it" in command.run(tmp_path, *words, "--mode", "1").refused(2)
    assert "modes does not use it" in command.run(tmp_path, *words, "--input", "A").refused(2)


def test_the_mode_named_is_the_one_that_is_solved(tmp_path):
    for mode in planar.modes(planar.load("watt-six-bar"), certify=False):
        value = json.loads(command.run(tmp_path, "solve", "watt-six-bar", "--json", "--mode", str(mode.number)).done())
        assert value["points"]["D"]["position"] == pytest.approx(mode.points["D"].tolist(), abs=1e-12)
        assert any(f"assembly {mode.number}: there are 2 assemblies" in each for each in value["remarks"])
    words = ("watt-six-bar", "--mode", "2")
    moved = json.loads(command.run(tmp_path, "cycle", *words, "--steps", "4", "--json").done())
    second = planar.modes(planar.load("watt-six-bar"), certify=False)[1]
    there = planar.cycle(second.mechanism, 4).point("D").position
    assert np.array(moved["points"]["D"]["position"]) == pytest.approx(there)
    command.run(tmp_path, "centres", *words).done()
    command.run(tmp_path, "plot", "watt-six-bar", "scheme", "--mode", "2", "-o", "a.png").done()
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_what_a_book_prints_goes_with_its_own_assembly_only(tmp_path):
    own = planar.modes(planar.load("002-E3.1")).nearest.number
    assert "Published" in command.run(tmp_path, "solve", "002-E3.1", "--mode", str(own)).done()
    assert "Published" not in command.run(tmp_path, "solve", "002-E3.1", "--mode", str(3 - own)).done()


def test_the_sheet_has_a_window_for_each_with_its_number(tmp_path):
    sheets = assembly_sheets(planar.modes(tower(5), certify=False))
    assert [len(pictures) for pictures, _ in sheets] == [16, 16]
    assert ASSEMBLIES_PER_SHEET >= 16
    assert "32 assemblies" in sheets[0][1]
    ((pictures, heading),) = assembly_sheets(planar.modes(planar.load("jansen-leg"), certify=False))
    assert "8 assemblies" in heading
    titles = [picture.title for picture in pictures]
    assert titles == ["1", "2", "3", "4", "5", "6, the nearest to the sketch", "7", "8"]
    scale = parse_scale(pictures[0].notes[0])
    windows = [next(mark for mark in picture.marks if mark.about.startswith("window")) for picture in pictures]
    assert len({window.points for window in windows}) == 1
    pins = [mark.radius for mark in pictures[0].marks if isinstance(mark, Circle) and mark.about.startswith("pin ")]
    assert pins
    assert max(pins) < 0.8 * symbol_table.PIN_RADIUS  # small drawings have small pins
    for picture, mode in zip(pictures, planar.modes(planar.load("jansen-leg"), certify=False), strict=True):
        at = next(np.array(mark.at) for mark in picture.marks if isinstance(mark, Label) and mark.text == "foot")
        assert at * scale.per_mm == pytest.approx(mode.points["foot"])
    command.run(tmp_path, "plot", "stephenson-3-five-bar", "modes", "-o", "modes.png").done()
    with Image.open(tmp_path / "modes.png") as drawn:
        assert drawn.size[0] > 1000
    command.run(tmp_path, "plot", "four-bar", "modes", "--scale", "1:2", "--at", "A=80deg", "-o", "modes.pdf").done()
    assert (tmp_path / "modes.pdf").stat().st_size > 1000


def test_a_list_that_was_interrupted_is_taken_up_again(monkeypatch):
    modes, many = planar.modes(tower(3), certify=False), iter(range(100))
    own = modes._tree.roots

    def interrupted(index, z):
        if next(many) == 4:
            raise KeyboardInterrupt
        return own(index, z)

    monkeypatch.setattr(modes._tree, "roots", interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(iter(modes))
    assert len(list(iter(modes))) == 8


def test_a_mode_and_a_list_go_to_another_process():
    modes = planar.modes(planar.load("watt-six-bar"), {"A0": 1.1})
    again = pickle.loads(pickle.dumps(modes))
    assert [mode.choices for mode in again] == [mode.choices for mode in modes]
    assert again.complete is modes.complete
    sent = pickle.loads(pickle.dumps(modes[1]))
    assert (sent.number, sent.choices, sent.certified) == (2, modes[1].choices, True)
    assert same_places(sent.state, modes[1])
    assert sent.mechanism == modes[1].mechanism
