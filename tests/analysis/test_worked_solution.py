"""The worked solution: against the chapter's tables, against the state, for every model, in a terminal."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import planar
from planar.analysis.rich_text import Chord, MeasuredValue, PolygonLetter, Symbol, format_number, plain_text
from planar.analysis.worked.published import compare_published
from planar.analysis.worked.sections import Section
from planar.analysis.worked.solution import WorkedSolution, worked_solution
from planar.drawing.paper.scales import parse_scale
from planar.foundation.errors import PlanarError
from planar.model.file_units import rate_unit
from planar.reports.tables.worked_solution import record, solution_text
from tests.builders import four_bar_document
from tests.command import run
from tests.draws import first_cases
from tests.hostile import NAMES, hostile_document
from tests.known import MODELS, some_models, state_of
from tests.linkages import random_linkage

ROOT = Path(__file__).parents[2]
DRAWN = 0.03
"""What a drawing may be off, where the model's file states no other tolerance."""


def solved(model: str) -> WorkedSolution:
    return worked_solution(state_of(model))


def shown(solution: WorkedSolution, width: int = 100, scales: Any = None) -> str:
    with Path(os.devnull).open("w") as nowhere:
        console = Console(record=True, width=width, file=nowhere, markup=False, emoji=False, highlight=False)
        console.print(solution_text(solution, scales))
        return console.export_text()


def rows(section: Section) -> dict[str, tuple[str, str, str, str]]:
    """The vector table by symbol: letters, magnitude, direction, sense."""
    return {
        plain_text((row.symbol,)): (
            plain_text((row.chord,)),
            plain_text(row.magnitude),
            plain_text(row.direction),
            plain_text(row.sense),
        )
        for row in section.rows
    }


def sentences(section: Section) -> list[str]:
    return [plain_text(each) for each in (*section.known, *section.steps, *section.images, *section.results)]


def everything(solution: WorkedSolution) -> list[str]:
    return [each for half in solution.worked_polygons for section in half.sections for each in sentences(section)]


# numbers and symbols


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (5.5125, "5.51"),
        (0.339915, "0.340"),
        (26.0, "26"),
        (0.05, "0.05"),
        (1.3, "1.3"),
        (3418.9, "3419"),
        (0.400471, "0.400"),
        (99.96, "99.96"),
        (999.96, "1000"),
        (0.0, "0"),
        (-0.863417, "−0.863"),
        (1.2345e-7, "1.23·10⁻⁷"),
        (4.0e9, "4.00·10⁹"),
    ],
)
def test_numbers_are_printed_as_a_chapter_prints_them(value: float, text: str) -> None:
    assert format_number(value) == text


def test_symbols_letters_and_chords_are_written_plainly() -> None:
    assert plain_text((Symbol("f", "cb", "c"),)) == "f_cb^c"
    assert plain_text((Symbol("ω", "boom rod"),)) == "ω(boom rod)"
    assert plain_text((Chord(PolygonLetter("a", "1"), PolygonLetter("b", "a")),)) == "a₁b_a"
    assert plain_text((Chord(PolygonLetter("b", "a"), PolygonLetter("b", "1")),)).replace("\xa0", " ") == "b_a b₁"
    assert plain_text((Chord(PolygonLetter("g″"), PolygonLetter("f")),)) == "g″f"
    assert plain_text((Chord(PolygonLetter("o"), PolygonLetter("foot")),)) == "o–foot"


def test_what_is_drawn_has_its_length_on_paper_beside_it_where_there_is_a_scale() -> None:
    scale = {"acceleration": parse_scale("1 cm = 2 m/s^2")}
    assert plain_text((MeasuredValue(5.5125, "m/s^2", "acceleration"),), scale) == "5.51 m/s² (27.6 mm)"
    assert plain_text((MeasuredValue(5.5125, "m/s^2", "velocity"),), scale) == "5.51 m/s²"


# the chapter's tables, row by row: letters, magnitude (None where it is not known beforehand), direction, sense

TABLE_3_3 = {
    "f_ba^c": ("a₁b_a", 5.51, "∥ AB", "→ A"),
    "f_ba^t": ("b_a b₁", 1.3, "⊥ AB", "→ a"),
    "f_cb^c": ("b₁c_b", 1.75, "∥ BC", "→ B"),
    "f_cb^t": ("c_b c₁", None, "⊥ BC", "—"),
    "f_cd^c": ("d₁c_d", 2.72, "∥ DC", "→ D"),
    "f_cd^t": ("c_d c₁", None, "⊥ DC", "—"),
}
TABLE_3_4 = {
    "f_ao^c": ("o₁a₁", 192.0, "∥ OA", "→ O"),
    "f_ba^c": ("a₁b_a", 17.2, "∥ AB", "→ A"),
    "f_ba^t": ("b_a b₁", None, "⊥ AB", "—"),
    "f_bg": ("g₁b₁", None, "∥ line of motion of B", "—"),
}
TABLE_3_5 = {
    "f_ao^c": ("o₁a₁", 5.92, "∥ OA", "→ O"),
    "f_ca^c": ("a₁c_a", 1.79, "∥ AC", "→ A"),
    "f_ca^t": ("c_a c₁", None, "⊥ AC", "—"),
    "f_cq^c": ("q₁c_q", 8.96, "∥ QC", "→ Q"),
    "f_cq^t": ("c_q c₁", None, "⊥ QC", "—"),
}
TABLE_3_6 = {
    "f_dq": ("q₁d₁", "already drawn", "—", "—"),
    "f_bd^c": ("d₁b_d", 0.49, "∥ DB", "→ D"),
    "f_bd^t": ("b_d b₁", None, "⊥ DB", "—"),
    "f_bg": ("g₁b₁", None, "∥ line of motion of B", "—"),
}
# rows 5 and 6 print a_b for the head that the other tables, and the rows below, call b_a
TABLE_3_8 = {
    "f_ao^c": ("o₁a_o", 96.8, "∥ OA", "→ O"),
    "f_ao^t": ("a_o a₁", 12.0, "⊥ OA", "→ a"),
    "f_bq^c": ("q₁b_q", 38.3, "∥ QB", "→ Q"),
    "f_bq^t": ("b_q b₁", None, "⊥ QB", "—"),
    "f_ba^c": ("a₁b_a", 5.93, "∥ AB", "→ A"),
    "f_ba^t": ("b_a b₁", None, "⊥ AB", "—"),
    "f_db^c": ("b₁d_b", 20.0, "∥ BD", "→ B"),
    "f_db^t": ("d_b d₁", None, "⊥ BD", "—"),
    "f_dg": ("g₁d₁", None, "∥ line of motion of D", "—"),
}


@pytest.mark.parametrize(
    ("model", "parts", "table"),
    [
        ("002-E3.1", slice(None), TABLE_3_3),
        ("002-E3.2", slice(None), TABLE_3_4),
        ("002-E3.3", slice(0, 1), TABLE_3_5),
        ("002-E3.3", slice(1, 2), TABLE_3_6),
        ("002-E3.5", slice(None), TABLE_3_8),
    ],
    ids=["3.3", "3.4", "3.5", "3.6", "3.8"],
)
def test_the_vector_tables_are_the_chapters(model: str, parts: slice, table: dict[str, tuple[Any, ...]]) -> None:
    published = planar.load(model).published
    found: dict[str, tuple[str, str, str, str]] = {}
    for section in solved(model).acceleration.sections[parts]:
        found |= {key: value for key, value in rows(section).items() if value[1] != "already drawn" or key in table}
    assert set(found) == set(table)
    if model != "002-E3.5":  # where the chapter takes the second side of the first point before the third vector
        assert list(found) == list(table)
    for symbol, (letters, magnitude, direction, sense) in table.items():
        told = found[symbol]
        assert (told[0].replace("\xa0", " "), *told[2:]) == (letters, direction, sense)
        if isinstance(magnitude, float):
            off = next((item.tolerance for item in published if item.value == magnitude), DRAWN)
            assert float(told[1].rpartition(" = ")[2]) == pytest.approx(magnitude, rel=off)
        else:
            assert told[1] == (magnitude or "—")


def test_a_magnitude_has_its_formula_and_its_numbers() -> None:
    found = rows(solved("002-E3.1").acceleration.sections[0])
    assert found["f_ba^c"][1] == "(ab)²/AB = (0.525)²/0.05 = 5.51"
    assert found["f_ba^t"][1] == "α_AB × AB = 26 × 0.05 = 1.3"
    coriolis = rows(solved("004-OABQ").acceleration.sections[1])["f_dd′^cr"]
    assert coriolis[1] == "2 × ω_AB × (d′d) = 2 × 0.529 × 9.31 = 9.85"
    assert coriolis[2] == "⊥ line on AB"
    steps = [plain_text(step) for step in solved("004-OABQ").acceleration.sections[1].steps]
    assert sum(", the Coriolis component, square to the line on AB" in step for step in steps) == 1


def test_the_vector_equation_of_example_3_1_is_the_chapters() -> None:
    lines = [plain_text(line).replace("\xa0", " ") for line in solved("002-E3.1").acceleration.sections[0].equation]
    assert lines == [
        "Acc. of C rel. to D = Acc. of B rel. to A + Acc. of C rel. to B",
        "f_cd = f_ba + f_cb",
        "f_cd^c + f_cd^t = f_ba^c + f_ba^t + f_cb^c + f_cb^t",
        "d₁c_d + c_d c₁ = a₁b_a + b_a b₁ + b₁c_b + c_b c₁",
    ]


def test_the_construction_of_example_3_1_can_be_followed_with_a_pencil() -> None:
    section = solved("002-E3.1").acceleration.sections[0]
    assert [plain_text(step).replace("\xa0", " ") for step in (*section.steps, *section.images)] == [
        "Take the pole a₁, d₁: what is fixed has no acceleration.",
        "From a₁ draw a₁b_a = 5.51 m/s² parallel to AB, towards A.",
        "To it add b_a b₁ = 1.3 m/s² square to AB, in the sense of ba in the velocity polygon.",
        "From b₁ draw b₁c_b = 1.75 m/s² parallel to BC, towards B.",
        "Through the head c_b draw a line square to BC; c₁ lies on it.",
        "From d₁ draw d₁c_d = 2.86 m/s² parallel to DC, towards D.",
        "Through the head c_d draw a line square to DC; the two lines meet in c₁.",
        "Join a₁b₁, b₁c₁ and d₁c₁: the total accelerations of B relative to A, C relative to B and C relative to D.",
        "Locate e₁ on b₁c₁ such that b₁e₁/b₁c₁ = BE/BC = 40/66.",
        "Draw triangle b₁c₁f₁ similar to BCF, read in the same order (clockwise).",
        "Draw triangle c₁d₁g₁ similar to CDG, read in the same order (anticlockwise).",
    ]


def test_the_results_of_example_3_1_have_senses_in_words() -> None:
    told = everything(solved("002-E3.1"))
    assert "ω_BC = bc/BC = 0.340/0.066 = 5.15 rad/s, clockwise" in told
    assert "v_C = dc = 0.400 m/s, to the left, downwards" in told
    assert any(re.fullmatch("α_DC = c_d.c₁/DC = 4.33/0.056 = 77.3 rad/s², anticlockwise", each) for each in told)


def test_points_beyond_an_end_are_located_on_the_image_produced() -> None:
    told = everything(solved("002-E3.2"))
    assert "Locate e₁ on b₁a₁ produced beyond a₁ such that a₁e₁/a₁b₁ = AE/AB = 450/1600." in told
    assert "Locate e on cd produced beyond d such that ce/cd = CE/CD = 708/550." in everything(solved("002-E3.4"))


def test_a_slider_says_whether_it_speeds_up() -> None:
    assert "a_B = g₁b₁ = 6.97 m/s², to the left; against v_B: the slider slows down" in everything(solved("002-E3.3"))
    for model in ("002-E3.2", "002-E3.4", "000-P2", "004-QR"):
        solution = solved(model)
        told = [each for each in everything(solution) if each.endswith(("speeds up", "slows down"))]
        assert told
        for each in told:
            state = solution.state.point(each.partition(" ")[0].removeprefix("a_"))
            assert each.endswith("speeds up") == (float(state.velocity @ state.acceleration) > 0.0)


def test_a_link_that_does_not_turn_moves_all_its_points_alike() -> None:
    told = everything(solved("three-parallel-cranks"))
    assert "Link rod does not turn, so C has the same velocity as A: a and c coincide." in told


def test_a_gear_gives_the_turning_of_its_link() -> None:
    assert "By the pair wheels: ω_QB = 22.2 rad/s, clockwise" in everything(solved("002-E3.6a"))


def test_a_turn_known_from_an_input_between_moving_links_is_not_called_given() -> None:
    told = everything(solved("open-arm"))
    assert "Given at the input A: ω(upper arm) = 1 rad/s, anticlockwise" in told
    assert "With the input B: ω_forearm = 3 rad/s, anticlockwise" in told


def test_pins_with_radii_rub() -> None:
    solution = solved("002-E3.1")
    told = [plain_text(each) for each in solution.rubbing]
    assert told[1] == "At B: (ω_BC − ω_AB) × r = 15.7 × 0.04 = 0.626 m/s"
    assert told[0] == "At A: ω_AB × r = 10.5 × 0.03 = 0.315 m/s"


# what no pencil order solves


def test_the_double_butterfly_has_equations_instead_of_a_pencil_order() -> None:
    solution = solved("double-butterfly")
    for half, order in zip(solution.worked_polygons, ("angular_velocity", "angular_acceleration"), strict=True):
        (section,) = half.sections
        told = [plain_text(each) for each in section.simultaneous]
        assert told[0].startswith("No two lines locate a point of links ADE, DKJ, CGH, EG, KH and BJ")
        assert "6 simultaneous equations in 6 unknowns" in told[0]
        letter = "ω" if order == "angular_velocity" else "α"
        values = {link: getattr(solution.state.link(link), order) for link in ("ADE", "DKJ", "CGH", "EG", "KH", "BJ")}
        equations = [each for each in told if each.startswith("Round")]
        assert len(equations) == 6
        for each in equations:
            left, right = each.partition(": ")[2].split(" = ")
            terms = re.findall(rf"([−+]?) ?([0-9.]*) ?{letter}_([A-Z]+)", left)
            total = sum(float(f"{sign.replace('−', '-')}{size or 1}") * values[link] for sign, size, link in terms)
            scale = max(abs(float(size or 1) * values[link]) for _, size, link in terms)
            assert total == pytest.approx(float(right.replace("−", "-")), abs=0.015 * scale)
        for link, value in values.items():
            assert f"{letter}_{link} = {format_number(value)} rad/s" in told[-1]


# every model


@pytest.mark.parametrize("model", some_models(3))
def test_every_model_is_explained(model: str) -> None:
    """Every link and moving point is told of, numbers in sentences are the state's, and the text is clean."""
    solution = solved(model)
    state = solution.state
    links = {link.link: link for link in solution.links}
    assert set(links) == set(state.links) - {state.mechanism.frame}
    for name, link in links.items():
        assert link.velocity == pytest.approx(state.link(name).angular_velocity, abs=1e-6)
    assert {point.point for point in solution.points} == set(state.point_names)
    read: set[str] = set()
    for half in solution.worked_polygons:
        order = 1 if half.kind == "velocity" else 2
        greatest = max((float(np.hypot(*point[order])) for point in state.points.values()), default=0.0)
        for section in half.sections:
            for phrase in section.results:
                read |= _agreed(phrase, state, order, greatest)
            for row in section.rows:
                _consistent(row.magnitude, rate_unit(half.kind, state.mechanism.units)[1].from_si(row.value), row.known)
    frame = state.mechanism.frame
    fixed = {each.name for each in state._points if any(link == frame for link, _ in each.members)}
    assert read == set(state.point_names) - fixed
    text = shown(solution)
    assert not re.search(r"\bnan\b|\bNone\b|\[\]|\{|Symbol|= 0 rad/s, ", text)
    assert max(map(len, text.splitlines())) <= 100
    told = json.dumps(record(solution), allow_nan=False)
    assert all(json.dumps(link) in told for link in links)


def _agreed(phrase: Any, state: planar.State, order: int, greatest: float) -> set[str]:
    """A result against the state, by another route than the polygon; the point that it is of."""
    symbol, *rest = phrase
    values = [piece.value for piece in rest if isinstance(piece, MeasuredValue)]
    if not isinstance(symbol, Symbol) or not values:
        return set()
    if symbol.letter in ("ω", "α"):
        link = state.link(symbol.subscript)
        wanted = (link.angular_velocity, link.angular_acceleration)[order - 1]
        assert values[-1] == pytest.approx(abs(wanted), rel=1e-6, abs=1e-6)
        if values[-1]:
            assert plain_text(phrase).endswith(", anticlockwise" if wanted > 0.0 else ", clockwise")
        return set()
    if symbol.letter == "f" or symbol.subscript not in state.point_names:
        return set()
    point = state.point(symbol.subscript)
    assert values[-1] == pytest.approx(float(np.hypot(*point[order])), rel=1e-6, abs=1e-8 * greatest)
    return {symbol.subscript}


def _consistent(magnitude: Any, value: float, known: bool) -> None:
    """A formula's numbers make the magnitude."""
    text = plain_text(magnitude)
    assert known == (text != "—")
    parts = text.split(" = ")
    if len(parts) != 3:
        return
    figures = parts[1].replace("·10⁻", "e-").replace("−", "-").translate(str.maketrans("⁰¹³⁴⁵⁶⁷⁸⁹", "013456789"))
    if "e-" in figures:
        return
    expression = re.fullmatch(r"\(([0-9.]+)\)²/([0-9.]+)", figures)
    if expression:
        made = float(expression[1]) ** 2 / float(expression[2])
    else:
        made = float(np.prod([float(each) for each in figures.split(" × ")]))
    assert made == pytest.approx(value, rel=0.02, abs=1e-12)


# the command, hostile names


def test_the_command_prints_the_whole_solution(tmp_path: Path) -> None:
    ended = run(tmp_path, "explain", "002-E3.1", "--scale", "1 cm = 0.1 m/s", "--scale", "1 cm = 2 m/s^2")
    assert (ended.status, ended.err) == (0, "")
    out = ended.out
    for words in (
        "To find",
        "Velocity polygon, 1 cm = 0.1 m/s",
        "From a draw ab = 0.525 m/s (52.5 mm) square to AB",
        "5.51 m/s² (27.6 mm)",
        "Published values",
        "the printed denominator 0.56 is 0.056",
    ):
        assert words in out


def test_a_worked_solution_speaks_of_no_command_or_option(tmp_path: Path) -> None:
    """It is handed out on paper; the table on a terminal says how another assembly is chosen."""
    hint = re.compile(r"(?<![\w-])--[a-z]|`|\bplanar [a-z]+")
    text = run(tmp_path, "explain", "four-bar", "--with", "centres,forces").done()
    assert "assembly 1 of 2 at the file's inputs" in " ".join(text.split())
    assert not hint.search(text)
    assert "--mode takes another" in run(tmp_path, "solve", "four-bar").done()
    for model, mechanism in MODELS.items():
        assert not any(hint.search(note) for note in mechanism.notes), model


def test_the_command_moves_an_input_and_prints_data(tmp_path: Path) -> None:
    ended = run(tmp_path, "explain", "four-bar", "--at", "A=75deg", "--json")
    assert (ended.status, ended.err) == (0, "")
    told = json.loads(ended.out)
    state = planar.solve(planar.load("four-bar"), [planar.Drive("A", np.radians(75.0))])
    assert told["links"]["BC"]["velocity"] == pytest.approx(state.link("BC").angular_velocity)
    assert "published" not in told
    section = told["velocity"]["sections"][0]
    assert section["vectors"][0]["symbol"] == {"letter": "v", "subscript": "ba", "superscript": ""}
    assert section["vectors"][1]["known"] is False


def test_where_nothing_acts_the_centres_are_written_and_what_is_missing_is_said(tmp_path: Path) -> None:
    told = run(tmp_path, "explain", "four-bar", "--with", "centres,forces").done()
    assert "Instantaneous centres" in told
    assert "no forces are shown: the mechanism has no loads, springs or masses" in told
    assert "Reactions" not in told
    assert run(tmp_path, "explain", "four-bar", "--with", "forces", "-o", "four-bar.pdf").status == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("002-E3.1", "--scale", "1 cm"), "is not of the form"),
        (("002-E3.1", "--scale", "1:2", "--scale", "1:5"), "two scales of length are given"),
        (("002-E3.1", "--json", "-o", "x.txt"), "one of the two"),
        (("002-E3.1", "-o", "x.docx"), ".docx"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_a_sentence(tmp_path: Path, words: tuple[str, ...], sentence: str) -> None:
    ended = run(tmp_path, "explain", *words)
    assert ended.status == 2
    assert sentence in ended.err


def test_names_are_texts_whatever_they_look_like() -> None:
    solution = worked_solution(planar.solve(planar.from_dict(hostile_document())))
    text = shown(solution, 140)
    for name in NAMES:
        assert name in text
    json.dumps(record(solution))


@pytest.mark.parametrize("seed", first_cases((3, 10, 41, 20, 30, 50), 3))
def test_random_linkages_are_explained(seed: int) -> None:
    """Any links in any loops: points and links are told of as the state has them."""
    try:
        state = planar.solve(planar.from_dict(random_linkage(seed, 1 + seed % 12, 0.0, 0.3 * (seed % 2)).value))
    except PlanarError:  # links drawn at random may hold each other twice
        return
    solution = worked_solution(state)
    for half in solution.worked_polygons:
        order = 1 if half.kind == "velocity" else 2
        greatest = max((float(np.hypot(*point[order])) for point in state.points.values()), default=0.0)
        for phrase in (phrase for section in half.sections for phrase in section.results):
            _agreed(phrase, state, order, greatest)
    assert shown(solution)


def test_published_values_with_their_slips_stand_at_the_end() -> None:
    state = planar.solve(planar.load("000-P2"))
    told = record(worked_solution(state, compare_published(state)))["published"]
    assert any(each["verdict"] == "slip in the book" and each["slip"] for each in told)


def test_a_wheel_that_turns_very_slowly_beside_others_turns():
    """1e-11 of the first: that is its gears' business, not rounding."""
    text = {"A": [0, 0], "B": [3, 0], "C": [6, 0]}
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": text}} | {k.lower(): {"points": {k: [0, 0], f"{k}1": [1, 0]}} for k in text},
        "pairs": [
            *({"turning": name} for name in text),
            {"gear": "m", "links": ["a", "b"], "ratio": -1e-6},
            {"gear": "n", "links": ["b", "c"], "ratio": -1e-5},
        ],
        "inputs": [{"pair": "A", "position": 0.3, "velocity": 2}],
    }
    state = planar.solve(planar.from_dict(value))
    assert state.link("c").angular_velocity == pytest.approx(2e-11, rel=1e-12)
    assert state.link("c").sense == "anticlockwise, steady"
    assert state.point("C1").sense.startswith("upwards")
    told = shown(worked_solution(state))
    assert "By the pair n: ω_c = 0" not in told
    assert "c does not turn" not in told


def test_a_position_without_a_velocity_is_worked_out_at_the_unit_rate_of_its_first_input():
    value = four_bar_document(0.04, 0.09, 0.07, 0.1, 1.0, 1, omega=None, name="still")
    still, turning = (planar.solve(planar.from_dict(document)) for document in (value, with_velocity(value, "1 rad/s")))
    solution, expected = worked_solution(still), worked_solution(turning)
    assert solution.links == expected.links
    assert solution.points == expected.points
    assert any(link.velocity for link in solution.links)
    pair = still.mechanism.inputs[0].pair
    note = f"The file gives no velocity: velocities and accelerations are for 1 rad/s at the input {pair}."
    assert [plain_text(phrase) for phrase in solution.given[len(expected.given) :]] == [note]
    assert " ".join(shown(solution).split()).count(note) == 1
    assert not any(link.angular_velocity for link in still.links.values())  # what is solved stays as the file has it


def with_velocity(value: Any, velocity: str) -> Any:
    return value | {"inputs": [value["inputs"][0] | {"velocity": velocity}]}
