"""The commands `plot` and `animate`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from planar.cli.options import (
    at_option,
    load_model,
    main,
    mode_option,
    model_argument,
    output_option,
    parse_drives,
    range_options,
    refuse_overwriting,
    run_motion,
    scale_option,
    show_progress,
    show_status,
)
from planar.foundation.errors import BadInput
from planar.model.pairs import pair_types

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism
    from planar.plot import Drawing
    from planar.results.motion import Motion

POSITION_DRAWINGS = ("scheme", "velocity", "acceleration", "centres", "forces")
ASSEMBLY_DRAWINGS = ("modes",)
CIRCUIT_DRAWINGS = ("circuits",)
COGNATE_DRAWINGS = ("cognates",)
PROFILE_DRAWINGS = tuple(keyword for keyword, kind in pair_types().items() if kind.has_profile)
MOTION_DRAWINGS = ("positions", "loci", "centrodes", "diagrams", "torque", "bearings", "sensitivity", "tolerance")
MAP_DRAWINGS = ("force-map",)
SCALED_DRAWINGS = (
    *POSITION_DRAWINGS,
    "positions",
    "loci",
    "centrodes",
    "tolerance",
    *PROFILE_DRAWINGS,
    *ASSEMBLY_DRAWINGS,
    *COGNATE_DRAWINGS,
)
DRAWN_STEPS = 360
"""Steps of a run that is drawn."""


@main.command()
@model_argument()
@click.argument(
    "what",
    type=click.Choice(
        (
            *POSITION_DRAWINGS,
            *MOTION_DRAWINGS,
            *MAP_DRAWINGS,
            *PROFILE_DRAWINGS,
            *ASSEMBLY_DRAWINGS,
            *CIRCUIT_DRAWINGS,
            *COGNATE_DRAWINGS,
        )
    ),
)
@output_option("Write the drawing to a .png, .svg, .pdf or .dxf file.", required=True)
@scale_option
@at_option
@click.option(
    "--point", "points", multiple=True, metavar="NAME", help="A point to be lettered, or whose path is drawn."
)
@click.option(
    "--of",
    "of",
    metavar="NAME",
    help="Diagrams, circuits, cognates, sensitivity or tolerance of this slide, point or link; torque of this input.",
)
@click.option("--over", metavar="INPUTS", help="With force-map: the inputs, as 'O,P' or 'O=10deg:50deg,P'.")
@click.option("--result", metavar="NAME", help="With sensitivity and tolerance: which of its results, as velocity.")
@click.option(
    "--link",
    "links",
    multiple=True,
    metavar="NAME",
    help="Centres of this link, of several those between them; centrodes of the first in the axes of the second.",
)
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A pair whose bearing load, or profile, is drawn.")
@click.option(
    "--fluctuation",
    type=float,
    metavar="C",
    help="The flywheel's coefficient of fluctuation of speed, (greatest - least) / mean; 0.02 where left out.",
)
@click.option("--steps", default=12, show_default=True, metavar="N", help="Positions, or chords of the diagrams.")
@click.option("--chords", is_flag=True, help="Diagrams with graphical differentiation beside the curves.")
@range_options
@mode_option
def plot(  # many: options of a command; # long: each has its line
    model: str,
    what: str,
    output: Path,
    scales: tuple[str, ...],
    at: tuple[str, ...],
    points: tuple[str, ...],
    of: str | None,
    over: str | None,
    result: str | None,
    links: tuple[str, ...],
    pairs: tuple[str, ...],
    fluctuation: float | None,
    steps: int,
    chords: bool,
    pair: str | None,
    start: str | None,
    stop: str | None,
    mode: int | None,
) -> None:
    """A drawing to scale: scheme, polygons, free bodies of a position; loci, diagrams, loads of a run; circuits."""
    from planar import plot as drawn
    from planar.solving.position import solve

    steps_told = click.get_current_context().get_parameter_source("steps") is ParameterSource.COMMANDLINE
    for option, told, kinds in (
        ("--point", points, ("positions", "loci")),
        (
            "--of",
            of,
            ("diagrams", "torque", "sensitivity", "tolerance", *MAP_DRAWINGS, *CIRCUIT_DRAWINGS, *COGNATE_DRAWINGS),
        ),
        ("--over", over, MAP_DRAWINGS),
        ("--result", result, ("sensitivity", "tolerance")),
        ("--pair", pairs, ("bearings", *PROFILE_DRAWINGS)),
        ("--fluctuation", fluctuation is not None, ("torque",)),
        ("--link", links, ("centres", "centrodes")),
        ("--chords", chords, ("diagrams",)),
        ("--steps", steps_told, ("positions", "diagrams") if chords else ("positions",)),
        (
            "--scale",
            scales,
            SCALED_DRAWINGS,
        ),
        ("--mode", mode is not None, (*POSITION_DRAWINGS, *MOTION_DRAWINGS, *COGNATE_DRAWINGS)),
    ):
        if told and what not in kinds:
            raise BadInput(option, f"this is for {' and '.join(kinds)}; {what} would not heed it")
    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    with show_status(f"{mechanism.name}: {what}"):
        _refuse_range(what, pair, start, stop)
        if what in MAP_DRAWINGS:
            from planar.analysis.force_maps.force_map import force_map
            from planar.cli.commands.force_map import parse_ranges

            names = over or ",".join(given.pair for given in mechanism.inputs[:2])
            drawn.save(drawn.force_map(force_map(mechanism, parse_ranges(mechanism, names, None)), of), output)
            return
        if what in PROFILE_DRAWINGS:
            if at or len(pairs) > 1:
                raise BadInput("--at" if at else "--pair", f"a profile of one {what} is drawn, over its whole turn")
            drawn.save(drawn.cam_profile(mechanism, pairs[0] if pairs else None, scales), output)
            return
        if what in COGNATE_DRAWINGS:
            if at:
                raise BadInput("--at", f"{what} are drawn where the file's inputs stand; change those with --set")
            drawn.save(drawn.cognates(mechanism, of, scales), output)
            return
        if what in (*ASSEMBLY_DRAWINGS, *CIRCUIT_DRAWINGS):
            from planar.assemblies.circuits.circuits import circuits
            from planar.assemblies.modes import modes

            every = what in ASSEMBLY_DRAWINGS
            here = modes(mechanism, parse_drives(mechanism, at), certify=every)
            sheets = drawn.modes(here, scales) if every else drawn.circuits(circuits(here.mechanism, pair), of, here)
            drawn.save(sheets, output)
            return
        if what in POSITION_DRAWINGS:
            state = solve(mechanism, parse_drives(mechanism, at))
            figure = drawn.centres(state, scales, links) if what == "centres" else getattr(drawn, what)(state, scales)
        else:
            if at:
                raise BadInput("--at", f"{what} are of a run; say where it starts with --from")
            moving = _run_or_mechanism(mechanism, pair, start, stop)
            if len(links) > 2:
                raise BadInput(
                    "--link", "centrodes are of two links; name one, or one and the link that it is seen from"
                )
            link, other = (*links, None, None)[:2]
            drawings: dict[str, Callable[[], Drawing]] = {
                "positions": lambda: drawn.positions(moving, steps, points or None, scales),
                "loci": lambda: drawn.loci(moving, points or None, scales),
                "centrodes": lambda: drawn.centrodes(moving, link, other, scales),
                "diagrams": lambda: drawn.diagrams(moving, of, steps if chords else None),
                "torque": lambda: drawn.torque(moving, of, fluctuation),
                "bearings": lambda: drawn.bearings(moving, pairs or None),
                "sensitivity": lambda: drawn.sensitivity(moving, of, result),
                "tolerance": lambda: drawn.tolerance(moving, of, result, scales),
            }
            figure = drawings[what]()
        drawn.save(figure, output)


def _refuse_range(what: str, pair: str | None, start: str | None, stop: str | None) -> None:
    """Raise BadInput for a range that a drawing would not heed."""
    if what in CIRCUIT_DRAWINGS and (start or stop):
        raise BadInput("--from", f"{what} are of the whole range of an input")
    if (pair or start or stop) and what not in (*MOTION_DRAWINGS, *MAP_DRAWINGS, *CIRCUIT_DRAWINGS):
        told = f"{what} are" if what in (*ASSEMBLY_DRAWINGS, *COGNATE_DRAWINGS) else f"a {what} is"
        raise BadInput("--input", f"{told} of one position; move an input there with --at")


@main.command()
@model_argument()
@output_option("Write the moving picture to a .gif or .mp4 file.", required=True)
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point whose path is drawn as it moves.")
@range_options
@mode_option
def animate(
    model: str,
    output: Path,
    points: tuple[str, ...],
    pair: str | None,
    start: str | None,
    stop: str | None,
    mode: int | None,
) -> None:
    """The mechanism in motion, to and fro or round and round."""
    from planar import plot as drawn

    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    with show_progress(mechanism.name) as progress:
        drawn.animate(_run_or_mechanism(mechanism, pair, start, stop), output, points or None, progress)


def _run_or_mechanism(
    mechanism: Mechanism, pair: str | None, start: str | None, stop: str | None
) -> Mechanism | Motion:
    """The run that the options ask for; without any the mechanism, whose drawings start where a slide's stroke does."""
    if pair is None and start is None and stop is None and len(mechanism.inputs) == 1:
        return mechanism
    return run_motion(mechanism, DRAWN_STEPS, pair, start, stop)
