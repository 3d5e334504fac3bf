"""The command `balance`."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planar.cli.options import (
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    motion_options,
    output_option,
    print_or_write,
    refuse_overwriting,
    run_motion,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput, NoAnswer

if TYPE_CHECKING:
    from planar.dynamics.balancing.conditions import BalancingConditions
    from planar.dynamics.balancing.counterweights import CounterweightLimit
    from planar.dynamics.balancing.positive_masses import MassBalance
    from planar.model.mechanism import Mechanism
    from planar.reports.tables.design.balancing import Undecided


@main.command()
@model_argument()
@json_option
@timeout_option
@mode_option
@click.option(
    "--counterweights",
    metavar="LINKS",
    help="The links that bear one, as crank,rocker; left out, all that turn about a pivot of the frame.",
)
@click.option("--mass", metavar="MASS", help="The greatest of each; left out, that of all moving links together.")
@click.option("--radius", metavar="LENGTH", help="How far out it may lie; left out, as far as the points of its link.")
@click.option("--disc", metavar="LENGTH", help="Solid steel discs of this thickness, and not bodies of any shape.")
@click.option(
    "--minimise",
    type=click.Choice(("shaking force", "shaking moment", "peak torque")),
    default="shaking force",
    show_default=True,
    help="What the counterweights make least.",
)
@click.option("--rms", is_flag=True, help="Its root mean square over the motion, and not the greatest.")
@click.option("--about", metavar="POINT", help="The point of the frame about which the moment is; else its origin.")
@click.option("--of", "of", metavar="PAIR", help="The input whose torque is meant; left out, the one that runs.")
@click.option("--tradeoff", is_flag=True, help="The least shaking moment for every shaking force, too.")
@click.option(
    "--diagrams",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw force, moment and torque before and after.",
)
@motion_options
@output_option("Write the balanced mechanism to a .json file.")
# many: options of the command; # long: these
def balance(
    model: str,
    as_json: bool,
    mode: int | None,
    counterweights: str | None,
    mass: str | None,
    radius: str | None,
    disc: str | None,
    minimise: str,
    rms: bool,
    about: str | None,
    of: str | None,
    tradeoff: bool,
    diagrams: Path | None,
    output: Path | None,
    **course: Any,
) -> None:
    """What shakes the frame: the conditions of balance, what it needs, and the best counterweights."""
    from planar.dynamics.balancing.balance import balance as best_counterweights
    from planar.dynamics.balancing.balance import balance_tradeoff
    from planar.dynamics.balancing.conditions import balancing_conditions
    from planar.dynamics.balancing.cone_program import NEEDS_SOLVER
    from planar.dynamics.balancing.force_balance import find_force_balance
    from planar.dynamics.balancing.positive_masses import KINDS
    from planar.reports.tables.design.balancing import BalanceReport, balance_tables, record

    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    refuse_overwriting(model, diagrams)
    if output is not None and output.suffix != ".json":
        raise BadInput("-o", "the balanced mechanism is written to a .json file")
    links = None if counterweights is None else [each.strip() for each in counterweights.split(",")]
    limit = _limit(mechanism, mass, radius, disc)
    with limited_time(f"{mechanism.name}: balancing"):
        conditions = balancing_conditions(mechanism, about)
        found = BalanceReport(conditions)
        if find_spec("clarabel") is not None:
            found = found._replace(possible=tuple(_mass_balance(conditions, kind) for kind in KINDS))
        asked = (("--counterweights", links), ("--diagrams", diagrams), ("-o", output), ("--tradeoff", tradeoff))
        if conditions.is_massless:
            _refuse(asked, "no moving link has a mass, so that nothing shakes; give 'masses'")
        elif not found.possible:
            _refuse(asked, NEEDS_SOLVER)
        else:
            motion = run_motion(mechanism, **course)
            found = found._replace(
                complete=find_force_balance(conditions, links, limit),
                best=best_counterweights(
                    motion, minimise, links, limit, "root mean square" if rms else "greatest", about, of
                ),
                tradeoff=balance_tradeoff(motion, links, limit, about) if tradeoff else None,
            )
    if found.best is not None:
        _write(found.best.balanced, output)
        if diagrams is not None:
            from planar import plot as drawn

            drawn.save(drawn.balance(found.best, found.tradeoff), diagrams)
    if as_json:
        print_json(record(found), indent=1)
        return
    print_or_write(balance_tables(found), None)


def _mass_balance(conditions: BalancingConditions, kind: str) -> MassBalance | Undecided:
    """Whether bodies meet conditions, or why that is not told."""
    from planar.dynamics.balancing.positive_masses import find_mass_balance
    from planar.reports.tables.design.balancing import Undecided

    try:
        return find_mass_balance(conditions, kind)
    except NoAnswer as problem:
        return Undecided(kind, problem.reason)


def _refuse(asked: Iterable[tuple[str, Any]], why: str) -> None:
    """Refuse options that would not be heeded."""
    for option, told in asked:
        if told:
            raise BadInput(option, why)


def _limit(mechanism: Mechanism, mass: str | None, radius: str | None, disc: str | None) -> CounterweightLimit:
    """The limits that the options give."""
    from planar.document import read_length, read_mass
    from planar.dynamics.balancing.counterweights import CounterweightLimit

    return CounterweightLimit(
        None if mass is None else read_mass(mechanism, mass, "--mass"),
        None if radius is None else read_length(mechanism, radius, "--radius"),
        None if disc is None else read_length(mechanism, disc, "--disc"),
    )


def _write(mechanism: Mechanism, output: Path | None) -> None:
    """The balanced mechanism as a file, where one is named."""
    if output is None:
        return
    from planar.document.files import dumps
    from planar.foundation.safe_files import save_file

    save_file(output, dumps(mechanism).encode())
