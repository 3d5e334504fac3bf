"""Problems for a class: variants that go together with round numbers, and marks for what is handed in."""

import json

import pytest

import planar
from planar.analysis.classroom.marking import mark_answers
from planar.analysis.classroom.questions import problem_questions, question_text, solve_question
from planar.document.dimensions import file_dimensions
from planar.foundation.errors import BadInput
from planar.model.file_units import unit_of_kind
from tests import command

PROBLEMS = ("four-bar", "slider-crank", "whitworth", "toggle-press", "watt-six-bar")


def round_digits(value: float) -> int:
    """How many digits a number has before only noughts are left."""
    return len(f"{value:.10e}".partition("e")[0].rstrip("0").replace(".", "").replace("-", ""))


@pytest.mark.parametrize("name", PROBLEMS)
def test_ten_variants_of_a_problem_go_together_with_round_numbers(name):
    base, variants = planar.solve(name), planar.problem_variants(name, 10, seed=7)
    assert len({tuple(each.values.values()) for each in variants}) == 10
    known = file_dimensions(base.mechanism)
    for each in variants:
        for number, value in each.values.items():
            shown = unit_of_kind(known[number].kind, base.mechanism.units)[1].from_si(value)
            assert round_digits(round(shown, 9)) <= 3 or known[number].kind == "angle"
        # solved anew from what is written in a file
        again = planar.solve(planar.loads(planar.dumps(each.state.mechanism)))
        for item in problem_questions(base):
            assert solve_question(again, item).solved == pytest.approx(
                solve_question(each.state, item).solved, rel=1e-9
            )
        assert each.state.residual < 1e-12


def test_a_variant_is_the_same_however_many_there_are_and_others_with_another_seed():
    few, many = planar.problem_variants("four-bar", 2, seed=3), planar.problem_variants("four-bar", 5, seed=3)
    assert [each.values for each in few] == [each.values for each in many[:2]]
    assert planar.problem_variants("four-bar", 1, seed=4)[0].values != few[0].values


def test_the_velocity_of_a_four_bars_variant_is_that_of_its_closed_form():
    for each in planar.problem_variants("four-bar", 5, seed=1):
        state = each.state
        way = {name: state.point(name).position for name in "ABCD"}
        ab, bc, dc = way["B"] - way["A"], way["C"] - way["B"], way["C"] - way["D"]
        omega = state.inputs["A"].velocity
        between = bc[0] * dc[1] - bc[1] * dc[0]
        assert state.link("DC").angular_velocity == pytest.approx(omega * (bc[0] * ab[1] - bc[1] * ab[0]) / between)


def test_what_cannot_be_varied_is_said():
    with pytest.raises(BadInput, match="a whole number of variants"):
        planar.problem_variants("four-bar", 0)


@pytest.fixture
def handed_in(tmp_path):
    def write(*lines: str, head: str = "seed 7\nstudent,variant,quantity,value,unit\n"):
        path = tmp_path / "answers.csv"
        path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def test_marks_tell_right_ones_wrong_senses_and_wrong_units(handed_in):
    variant = planar.problem_variants("four-bar", 2, seed=7)[1]
    base = planar.solve("four-bar")
    turn = next(item for item in problem_questions(base) if item.quantity == "angular velocity")
    speed = next(item for item in problem_questions(base) if item.quantity == "velocity")
    w, v = (solve_question(variant.state, item).solved for item in (turn, speed))
    path = handed_in(
        f"Ann,2,{question_text(turn)},{1.03 * w},rad/s",
        f"Ann,2,{question_text(speed)},{0.98 * v * 1000},mm/s",
        f"Ben,2,{question_text(turn).upper()},{-w},",
        f"Ben,2,{question_text(speed)},{v * 1000},m/s",
        f"Cem,2,{speed.symbol},{2 * v},m/s",
        f"Cem,2,{question_text(turn)},about ten,rad/s",
    )
    ann, ben, cem = mark_answers("four-bar", path)
    assert (ann.right, ann.asked) == (2, len(problem_questions(base)))
    assert [value.verdict for value in ben.values] == ["sense", "power of ten"]
    assert [value.verdict for value in cem.values] == ["wrong", "no number"]
    assert mark_answers("four-bar", path, 0.01)[0].right == 0


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["Ann,1,velocity of Z,1,m/s"], ":3: .*this is not asked"),
        (["Ann,x,velocity of C,1,m/s"], ":3: .*number of a variant"),
        (["Ann,1,velocity of C,1,rad/s"], ":3: .*is a unit of angular velocity"),
        (["Ann,1,velocity of C,1,furlongs"], ":3"),
    ],
)
def test_a_line_that_cannot_be_read_is_named(handed_in, lines, told):
    with pytest.raises(BadInput, match=told):
        mark_answers("four-bar", handed_in(*lines))


def test_a_list_without_a_seed_or_a_column_is_refused(handed_in):
    with pytest.raises(BadInput, match="the first line names the seed"):
        mark_answers("four-bar", handed_in(head="student,variant,quantity,value,unit\n"))
    with pytest.raises(BadInput, match="there is no column 'quantity'"):
        mark_answers("four-bar", handed_in(head="seed 7\nstudent,variant,quantty,value,unit\n"))


def test_a_list_with_semicolons_may_have_decimal_commas(handed_in):
    head = "# Seed: 7\nstudent;variant;quantity;value;unit\n"
    variant = planar.problem_variants("four-bar", 1, seed=7)[0]
    speed = next(item for item in problem_questions(planar.solve("four-bar")) if item.quantity == "velocity")
    value = f"{solve_question(variant.state, speed).solved:.4f}".replace(".", ",")
    (marks,) = mark_answers("four-bar", handed_in(f"Ann;1;{question_text(speed)};{value};m/s", head=head))
    assert marks.right == 1


def test_the_commands_write_sheets_and_print_marks(tmp_path, handed_in):
    words = ("problem", "slider-crank", "--vary", "2", "--seed", "7")
    command.run(tmp_path, *words, "-o", "sheet.pdf", "--answers", "solved.pdf").done()
    assert all((tmp_path / name).read_bytes().startswith(b"%PDF") for name in ("sheet.pdf", "solved.pdf"))
    record = json.loads(command.run(tmp_path, *words, "--json").done())
    assert [each["variant"] for each in record["variants"]] == [1, 2]
    answers = record["variants"][0]["answers"]
    asked = next(name for name, value in answers.items() if name.startswith("velocity") and value)
    path = handed_in(f"Ann,1,{asked},{answers[asked]},m/s")
    assert "Ann" in command.run(tmp_path, "mark", "slider-crank", str(path)).done()
    (marks,) = json.loads(command.run(tmp_path, "mark", "slider-crank", str(path), "--json").done())
    assert marks["right"] == 1
    assert "pdf" in command.run(tmp_path, *words, "-o", "sheet.txt").refused(2)


def test_a_problem_is_set_of_a_mechanism_that_has_numbers_without_a_unit(tmp_path):
    assert "variant" in command.run(tmp_path, "problem", "two-stroke-engine", "--vary", "1").done()
