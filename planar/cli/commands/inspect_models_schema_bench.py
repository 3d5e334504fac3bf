"""The commands that say what there is: a mechanism, the models, the schema, the solver's speed."""

from __future__ import annotations

import click

from planar.cli.options import (
    frame_number_option,
    json_option,
    limited_time,
    main,
    model_argument,
    print_or_write,
    read_model,
    refuse_settings,
    show_status,
    timeout_option,
)
from planar.cli.streams import print_json


@main.command()
@model_argument()
@json_option
@timeout_option
@frame_number_option
def inspect(model: str, as_json: bool) -> None:
    """What it is: links, pairs, chain, mobility, motions, names."""
    from planar.analysis.identity.inspection import inspect as inspected

    mechanism = read_model(model)
    with limited_time(mechanism.name):
        found = inspected(mechanism)
    if as_json:
        from dataclasses import asdict

        print_json(asdict(found))
        return
    from planar.reports.tables.inspection import inspection_tables

    print_or_write(inspection_tables(found), None)


@main.command()
@click.option("--task", is_flag=True, help="That of tasks, which `planar synthesise` takes.")
def schema(task: bool) -> None:
    """The JSON schema of mechanism files, which editors can use."""
    if task:
        from planar.synthesis.task.task_file import task_schema as published
    else:
        from planar.document.schema import schema as published

    print_json(published(), indent=2)


@main.command()
@json_option
def models(as_json: bool) -> None:
    """The models that come along."""
    from planar.document.files import load_models as known

    rows = [(file.stem, [name for name in m.ids if name != file.stem], m.about or m.name) for file, m in known()]
    if as_json:
        print_json([{"model": n, "ids": ids, "about": about} for n, ids, about in rows])
        return
    from planar.reports.tables.inspection import models_table as table

    print_or_write(table((name, ", ".join(ids), about) for name, ids, about in rows), None)


@main.command()
@model_argument(required=False)
@click.option(
    "--seconds",
    type=click.FloatRange(0.0, 1e4),
    default=3.0,
    show_default=True,
    help="About how long the sweeps of a mechanism are timed.",
)
@json_option
def bench(model: str | None, seconds: float, as_json: bool) -> None:
    """How fast it is solved on this machine: one position, a run, many designs, and what bounds it."""
    from planar.bench.benchmark import measure_speed

    if not model:
        refuse_settings()
    mechanisms = [read_model(name) for name in ([model] if model else ["four-bar", "slider-crank", "double-butterfly"])]
    speeds = []
    for mechanism in mechanisms:
        with show_status(mechanism.name):
            speeds.append(measure_speed(mechanism, seconds=seconds))
    if as_json:
        print_json([speed.record() for speed in speeds])
        return
    from planar.reports.tables.benchmark import table

    print_or_write(table(speeds), None)
