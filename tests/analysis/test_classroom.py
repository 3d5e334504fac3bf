"""Problems for a class: variants that go together with round numbers, and marks for what is handed in."""

import json
import re
from math import hypot

import pytest

import planar
from planar.analysis.classroom.marking import mark_answers
from planar.analysis.classroom.questions import problem_questions, question_text, solve_question
from planar.document.dimensions import file_dimensions
from planar.foundation.errors import BadInput
from planar.model.file_units import unit_of_kind
from tests import command
from tests.draws import first_cases
from tests.poses_by_differences import Poses

PROBLEMS = ("four-bar", "slider-crank", "whitworth", "toggle-press", "watt-six-bar")


def round_digits(value: float) -> int:
    """How many digits a number has before only noughts are left."""
    return len(f"{value:.10e}".partition("e")[0].rstrip("0").replace(".", "").replace("-", ""))


@pytest.mark.parametrize("name", first_cases(PROBLEMS, 3))
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


@pytest.mark.parametrize("name", first_cases(PROBLEMS[::-1], 3))
def test_ten_variants_of_a_problem_are_what_an_independent_solution_from_their_files_says(name):
    base = planar.solve(name)
    asked = problem_questions(base)
    for each in planar.problem_variants(name, 10, seed=7):
        near = {point: 1e3 * own.position for point, own in each.state.points.items()}
        turned = {link: own.angle for link, own in each.state.links.items()}
        poses = Poses(planar.to_dict(each.state.mechanism), near, turned)
        for item in asked:
            wanted = poses.rates_of(item.of)[item.quantity.endswith("acceleration")]
            of_link = item.quantity.startswith("angular")
            solved = solve_question(each.state, item).solved
            assert solved == pytest.approx(wanted if of_link else abs(wanted), rel=1e-5, abs=1e-8), (each.number, item)


@pytest.mark.parametrize("name", first_cases(PROBLEMS, 3))
def test_the_worked_solution_of_a_variant_reads_off_what_is_solved(name, tmp_path):
    """Every `v_C = ... 0.400 m/s` of its lists is the position's own value, to the digits that stand there."""
    state = planar.problem_variants(name, 1, seed=7)[0].state
    written = command.written(tmp_path, planar.dumps(state.mechanism))
    lines = [line.partition("; ")[0] for line in command.run(tmp_path, "explain", written).done().splitlines()]
    read = {line.split(" = ")[0].strip(" -"): line.rsplit(" = ", 1)[1] for line in lines if " = " in line}
    read = {re.sub(r"\((.*)\)", r"_\1", symbol): value for symbol, value in read.items()}
    checked = 0
    for kind, (letter, greek) in {"velocity": ("v", "ω"), "acceleration": ("a", "α")}.items():
        wanted = {f"{letter}_{point}": hypot(*getattr(own, kind)) for point, own in state.points.items()}
        wanted |= {f"{greek}_{link}": abs(getattr(own, f"angular_{kind}")) for link, own in state.links.items()}
        for symbol, value in wanted.items():
            if symbol in read and value:
                assert float(read[symbol].split()[0]) == pytest.approx(value, rel=6e-3), symbol
                checked += 1
    assert checked >= 4


def test_what_slides_stays_between_the_ends_of_its_slot_as_in_the_mechanism_itself():
    for each in planar.problem_variants("whitworth", 10, seed=7):
        assert each.state.pair("slot")["displacement"] <= each.values["slotted link.length"]


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
    ann, ben, cem = mark_answers("four-bar", path).students
    assert (ann.right, ann.asked) == (2, len(problem_questions(base)))
    assert [value.verdict for value in ben.values] == ["sense", "power of ten"]
    assert [value.verdict for value in cem.values] == ["wrong", "no number"]
    assert mark_answers("four-bar", path, 0.01).students[0].right == 0


def test_what_is_small_beside_the_largest_of_its_kind_may_be_as_far_off_as_a_drawing_is(handed_in):
    variant = planar.problem_variants("toggle-press", 3, seed=7)[2]
    small, large = (
        solve_question(variant.state, item).solved
        for item in problem_questions(planar.solve("toggle-press"))
        if item.quantity == "acceleration" and item.of in "DB"
    )
    small, large = sorted((small, large))
    assert small < 0.01 * large  # the ram is all but at its fastest
    near, far = small + 0.009 * large, small + 0.02 * large
    path = handed_in(f"Ann,3,acceleration of D,{near},m/s^2", f"Ben,3,acceleration of D,{far},")
    ann, ben = mark_answers("toggle-press", path).students
    assert (ann.values[0].verdict, ben.values[0].verdict) == ("right", "wrong")


def test_lines_that_cannot_be_read_are_told_one_by_one_and_the_others_are_marked(handed_in, tmp_path):
    unread = {
        "Ann,1,velocity of Z,1,m/s": "'velocity of Z' is not asked; did you mean 'velocity of C'",
        "Ann,x,velocity of C,1,m/s": "the number of a variant is wanted, from 1 to 1000, not 'x'",
        f"Ann,{'9' * 5000},velocity of C,1,m/s": "the number of a variant",
        "Ann,1,velocity of C,1,rad/s": "'rad/s' is a unit of angular velocity",
        "Ann,1,velocity of C,1,furlongs": "furlongs",
        ",1,velocity of C,1,m/s": "no student",
        "Ann,1,,1,m/s": "no quantity",
        "Ann,1,velocity of C,0,5,m/s": "more cells than the head; a number with a decimal comma stands in quotes",
    }
    path = handed_in(*unread, "", "Bea,1,velocity of C,about,m/s", f"Bea,1,velocity of C,{'9' * 2000},m/s", "Bea,1")
    marks = mark_answers("four-bar", path)
    assert [each.line for each in marks.unread] == [*range(3, 11), 14]
    for line, told in zip(marks.unread, unread.values(), strict=False):
        assert told in line.sentence
    assert [(each.student, each.missing, each.values[0].verdict) for each in marks.students] == [
        ("Bea", marks.students[0].asked - 1, "no number")
    ]
    done = command.run(tmp_path, "mark", "four-bar", str(path))
    assert done.status == 2
    assert done.err.endswith("lines 3, 4, 5, 6, 7, 8, 9, 10 and 14 are not read, and so not marked\n")
    assert all(str(each.line) in done.out for each in marks.unread)


def test_a_list_without_a_seed_or_a_column_is_refused(handed_in):
    with pytest.raises(BadInput, match="the first line names the seed"):
        mark_answers("four-bar", handed_in(head="student,variant,quantity,value,unit\n"))
    with pytest.raises(BadInput, match="there is no column 'quantity'"):
        mark_answers("four-bar", handed_in(head="seed 7\nstudent,variant,quantty,value,unit\n"))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-8", "cp1252", "utf-16"])
def test_a_list_is_read_as_spreadsheets_of_any_country_save_it(tmp_path, encoding):
    variant = planar.problem_variants("four-bar", 1, seed=7)[0]
    speed, turn, *_ = problem_questions(planar.solve("four-bar"))
    v = solve_question(variant.state, speed).solved
    lines = [
        "sep=;",
        '"Seed: 7";;;;',
        ";;;;",
        "Student;Variant;Quantity;Value;Unit",
        f"Jürgen  Groß;1;{question_text(speed)};{f'{v:.4f}'.replace('.', ',')};m/s",
        "",
        f"jürgen groß;1,0;{question_text(turn).upper()};1.234,5 rad/s;",
        f"Jurgen Groß;1;{speed.symbol};{f'{1e3 * v:.1f}'.replace('.', ',')} mm/s",
    ]
    path = tmp_path / "klasse.csv"
    path.write_text("\r\n".join(lines), encoding=encoding)
    marks = mark_answers("four-bar", path)
    assert marks.unread == ()
    assert [(each.student, each.right, each.missing) for each in marks.students] == [
        ("Jürgen Groß", 1, len(problem_questions(planar.solve("four-bar"))) - 2),
        ("Jurgen Groß", 1, len(problem_questions(planar.solve("four-bar"))) - 1),
    ]
    assert marks.students[0].values[1].handed_in == pytest.approx(1234.5)
    assert marks.remarks == ("Jürgen Groß and Jurgen Groß, who hand in variant 1, may be one student",)
    command.run(tmp_path, "mark", "four-bar", path.name, "-o", "marks.csv").done()
    assert (tmp_path / "marks.csv").read_text(encoding="utf-8").splitlines()[1].startswith("Jürgen Groß,1,1,")
    assert "lost" in command.run(tmp_path, "mark", "four-bar", path.name, "-o", path.name).refused(2)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("0,52", 0.52),
        ("1.234,5", 1234.5),
        ("1,234.5", 1234.5),
        ("1 234,5", 1234.5),
        ("1,234,567", 1234567.0),
        ("−5.1", -5.1),
        ("+.5e1", 5.0),
        ("12 345 mm/s", 12.345),
        ("0.5 0.6", None),
        ("1e999", None),
        ("nan", None),
    ],
)
def test_a_number_is_read_as_people_write_it(handed_in, written, meant):
    (marks,) = mark_answers("four-bar", handed_in(f'Ann,1,velocity of C,"{written}",')).students
    assert marks.values[0].handed_in == (None if meant is None else pytest.approx(meant))


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"seed 7\n\n", b"seed 7\na,b\n", b"seed 7\n" + b"9" * 200_000])
def test_a_file_that_is_no_list_is_refused_in_a_sentence(tmp_path, content):
    (tmp_path / "a.csv").write_bytes(content)
    assert "a.csv" in command.run(tmp_path, "mark", "four-bar", "a.csv").refused(2)


def test_the_commands_print_variants_and_marks(tmp_path, handed_in):
    """Sheets are written by the guide's own commands."""
    words = ("problem", "slider-crank", "--vary", "2", "--seed", "7")
    record = json.loads(command.run(tmp_path, *words, "--json").done())
    assert [each["variant"] for each in record["variants"]] == [1, 2]
    answers = record["variants"][0]["answers"]
    asked = next(name for name, value in answers.items() if name.startswith("velocity") and value)
    path = handed_in(f"Ann,1,{asked},{answers[asked]},m/s")
    assert "Ann" in command.run(tmp_path, "mark", "slider-crank", str(path)).done()
    (marks,) = json.loads(command.run(tmp_path, "mark", "slider-crank", str(path), "--json").done())["students"]
    assert marks["right"] == 1
    assert "pdf" in command.run(tmp_path, *words, "-o", "sheet.txt").refused(2)


def test_a_problem_is_set_of_a_mechanism_that_has_numbers_without_a_unit(tmp_path):
    assert "variant" in command.run(tmp_path, "problem", "two-stroke-engine", "--vary", "1").done()
