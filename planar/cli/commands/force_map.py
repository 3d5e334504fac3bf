"""Forces over several inputs: the option `--over` of the command `forces`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planar.cli.options import limited_time, print_or_write
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput, join_names

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism


def show_force_map(
    mechanism: Mechanism, over: str, steps: int | None, taken: tuple[bool, bool], as_json: bool, output: Path | None
) -> None:
    """The worst cases over inputs, with inertia and friction `taken` into account or not."""
    from planar.analysis.force_maps.force_map import force_map
    from planar.reports.files.run_formats import encode_run
    from planar.reports.tables.forces.force_map import record, table
    from planar.reports.tables.forces.forces_over_motion import force_series

    ranges = parse_ranges(mechanism, over, steps)
    with limited_time(f"{mechanism.name}: over {', '.join(ranges)}"):
        found = force_map(mechanism, ranges, *taken)
    if as_json:
        print_json(record(found))
        return
    if output is not None and output.suffix in (".csv", ".npz", ".parquet"):
        from planar.foundation.safe_files import save_file

        save_file(output, encode_run(found.motion, output.suffix, force_series(found.forces)))
        output = None
    print_or_write(table(found), output)


def parse_ranges(
    mechanism: Mechanism, over: str, steps: int | None
) -> dict[str, tuple[float, float, int] | tuple[float, float] | int | None]:
    """`O,P=10deg:50deg`: inputs, each with a range or its whole one."""
    from planar.document import read_drive

    names = [given.pair for given in mechanism.inputs]
    if not names:
        from planar.solving.position import solved_mechanism

        solved_mechanism(mechanism).check_motion()
    found: dict[str, tuple[float, float, int] | tuple[float, float] | int | None] = {}
    for part in over.split(","):
        name, _, limits = (each.strip() for each in part.partition("="))
        if name not in names:
            raise BadInput("--over", f"{name!r} is no input; inputs are at {join_names(names)}")
        if not limits:
            found[name] = None if steps is None else steps + 1
            continue
        ends = limits.split(":")
        if len(ends) != 2:
            raise BadInput("--over", f"a range is written as {name}=10deg:50deg, not {part.strip()!r}")
        start, stop = (read_drive(mechanism, name, text).position for text in ends)
        assert start is not None
        assert stop is not None
        found[name] = (start, stop) if steps is None else (start, stop, steps + 1)
    return found
