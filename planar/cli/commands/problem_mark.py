"""The commands `problem` and `mark`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.exit_status import BAD_INPUT
from planar.cli.options import (
    json_option,
    limited_time,
    main,
    model_argument,
    output_option,
    print_or_write,
    read_model,
    refuse_overwriting,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.document.answer_lists import MAX_VARIANT
from planar.foundation.errors import BadInput, join_names, unknown_format_error

PAGES = (".pdf",)


@main.command()
@model_argument()
@json_option
@timeout_option
@click.option(
    "--vary", "count", type=click.IntRange(1, MAX_VARIANT), default=30, show_default=True, help="How many variants."
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Which variants: a seed has always the same."
)
@output_option("Write a page for each variant, to hand out, to a .pdf file.")
@click.option(
    "--answers",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write all answers, and the worked solution of each variant, to a .pdf file.",
)
def problem(model: str, as_json: bool, count: int, seed: int, output: Path | None, answers: Path | None) -> None:
    """A problem for a class: variants with round numbers that go together, and their answers."""
    from planar.analysis.classroom.variants import problem_variants
    from planar.solving.position import solve

    for path in (output, answers):
        if path is not None and path.suffix.lower() not in PAGES:
            raise unknown_format_error(path.suffix, "a problem", PAGES)
    if as_json and (output or answers):
        raise BadInput("-o", "a problem goes to files or is printed with --json; give one of the two")
    mechanism = read_model(model)
    for path in (output, answers):
        refuse_overwriting(model, path)
    with limited_time(f"{mechanism.name}: variants"):
        base, variants = solve(mechanism), problem_variants(mechanism, count, seed)
    if output is None and answers is None:
        from planar.reports.tables.classroom import variants_record, variants_tables

        if as_json:
            print_json(variants_record(base, variants, seed))
        else:
            print_or_write(variants_tables(base, variants, seed), None)
        return
    from planar.drawing.output.problem_sheets import answer_pages, problem_pages
    from planar.drawing.output.solution_pages import encode_sheets
    from planar.foundation.safe_files import save_file

    for path, pages in ((output, problem_pages), (answers, answer_pages)):
        if path is not None:
            with limited_time(f"{mechanism.name}: {path.name}"):
                drawn = pages(base, variants, seed)
            save_file(path, encode_sheets(drawn, path.suffix))


@main.command()
@model_argument()
@click.argument("answers", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@json_option
@timeout_option
@click.option(
    "--tolerance",
    type=click.FloatRange(0.0, 1.0),
    default=0.05,
    show_default=True,
    help="The part of a value by which what is read off a drawing may be off.",
)
@output_option("Write the marks to a .csv, .txt, .html or .svg file.")
def mark(model: str, answers: Path, as_json: bool, tolerance: float, output: Path | None) -> None:
    """Marks what students hand in: ANSWERS is a CSV file with `seed N` in its first line, then the columns student,
    variant, quantity, value, unit."""
    from planar.analysis.classroom.marking import mark_answers
    from planar.foundation.safe_files import save_file
    from planar.reports.tables.classroom import marks_csv, marks_record, marks_tables

    mechanism = read_model(model)
    refuse_overwriting(model, output)
    refuse_overwriting(str(answers), output, "the list of answers")
    with limited_time(f"{mechanism.name}: marks"):
        marks = mark_answers(mechanism, answers, tolerance)
    if as_json:
        print_json(marks_record(marks))
    elif output is not None and output.suffix.lower() == ".csv":
        save_file(output, marks_csv(marks))
    else:
        print_or_write(marks_tables(marks, mechanism.units), output)
    if marks.unread:
        lines = [str(each.line) for each in marks.unread]
        told = f"line {lines[0]} is" if len(lines) == 1 else f"lines {join_names(lines)} are"
        click.echo(f"planar: {answers}: {told} not read, and so not marked", err=True)
        click.get_current_context().exit(BAD_INPUT)
