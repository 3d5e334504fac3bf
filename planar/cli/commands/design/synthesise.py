"""The command `synthesise`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import json_option, main, print_or_write, show_progress, show_status
from planar.cli.streams import print_json


@main.command()
@click.argument("task", type=click.Path(path_type=Path))
@click.option("--many", type=click.IntRange(1, 1000), default=10, show_default=True, metavar="N", help="Designs.")
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, metavar="S", help="The same gives the same."
)
@click.option(
    "--time", "seconds", type=click.FloatRange(0.0), metavar="SECONDS", help="Begin nothing new after so long."
)
@click.option(
    "-o",
    "output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="The folder for the designs, a mechanism file and a page each, with their index.",
)
@click.option(
    "--complete", is_flag=True, help="All linkages that meet exactly as much as the start can, each certified."
)
@json_option
def synthesise(
    task: Path, many: int, seed: int, seconds: float | None, output: Path | None, complete: bool, as_json: bool
) -> None:
    """The linkages that do best what a TASK wants: paths, poses or functions, of any structure."""
    from planar.reports.tables.design.synthesis import record, table
    from planar.synthesis.synthesise import SearchProgress
    from planar.synthesis.synthesise import synthesise as search
    from planar.synthesis.task.task_reader import read_task

    wanted = read_task(task)
    with show_status(f"{wanted.name}: designs") as status:

        def show(done: SearchProgress) -> None:
            if status is not None:
                told = done.start if complete else f"{done.start} done, {done.done} in all"
                status.update(f"{wanted.name}: {told}")

        found = (
            search(wanted, complete=True, progress=show)
            if complete
            else search(wanted, many=many, seed=seed, time_limit=seconds, progress=show)
        )
    files: list[Path] = []
    if output is not None and len(found):
        from planar.document.files import dumps
        from planar.foundation.safe_files import save_file
        from planar.pages.gallery import write_gallery

        names = [f"{number:02d}" for number in range(1, len(found) + 1)]
        with show_progress(f"{len(found)} pages") as progress:
            models = [(name, each.mechanism) for name, each in zip(names, found, strict=True)]
            write_gallery(models, output, progress, wanted)
        for name, each in zip(names, found, strict=True):
            path = output / f"{name}.json"
            save_file(path, dumps(each.mechanism))
            files.append(path)
            for number, other in enumerate(each.cognates, start=1):
                save_file(output / f"{name}-cognate-{number}.json", dumps(other.mechanism))
    if as_json:
        print_json(record(found, files))
        return
    print_or_write(table(found, files), None)
