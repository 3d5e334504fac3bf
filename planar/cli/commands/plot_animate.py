"""The commands `plot` and `animate`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click
from click.core import ParameterSource

from planar.cli.options import (
    at_option,
    frame_number_option,
    limited_time,
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
    timeout_option,
)
from planar.foundation.errors import BadInput, join_names
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
DRAWINGS = (
    *POSITION_DRAWINGS,
    *MOTION_DRAWINGS,
    *MAP_DRAWINGS,
    *PROFILE_DRAWINGS,
    *ASSEMBLY_DRAWINGS,
    *CIRCUIT_DRAWINGS,
    *COGNATE_DRAWINGS,
)
DRAWN_STEPS = 360
"""Steps of a run that is drawn."""


class OptionUse(NamedTuple):
    """The drawings that an option of `plot` is for, and what to do instead for another drawing."""

    drawings: tuple[str, ...]
    advice: str = ""


_RANGE_ADVICE = "a drawing of one position moves an input with --at"
OPTION_USES = {
    "--scale": OptionUse(SCALED_DRAWINGS),
    "--at": OptionUse(
        (*POSITION_DRAWINGS, *ASSEMBLY_DRAWINGS, *CIRCUIT_DRAWINGS),
        "--from says where a run starts, --set changes a position in the file",
    ),
    "--point": OptionUse(("positions", "loci")),
    "--of": OptionUse(
        ("diagrams", "torque", "sensitivity", "tolerance", *MAP_DRAWINGS, *CIRCUIT_DRAWINGS, *COGNATE_DRAWINGS)
    ),
    "--over": OptionUse(MAP_DRAWINGS),
    "--result": OptionUse(("sensitivity", "tolerance")),
    "--link": OptionUse(("centres", "centrodes")),
    "--pair": OptionUse(("bearings", *PROFILE_DRAWINGS)),
    "--fluctuation": OptionUse(("torque",)),
    "--steps": OptionUse(("positions", "centrodes", "diagrams")),
    "--chords": OptionUse(("diagrams",)),
    "--input": OptionUse((*MOTION_DRAWINGS, *CIRCUIT_DRAWINGS), _RANGE_ADVICE),
    "--from": OptionUse(MOTION_DRAWINGS, _RANGE_ADVICE),
    "--to": OptionUse(MOTION_DRAWINGS, _RANGE_ADVICE),
    "--frame-number": OptionUse((*POSITION_DRAWINGS, "positions", "loci", "centrodes", "tolerance", "bearings")),
    "--mode": OptionUse((*POSITION_DRAWINGS, *MOTION_DRAWINGS, *MAP_DRAWINGS, *COGNATE_DRAWINGS)),
}
"""The options of `plot` that are for some drawings only; the others are for all."""


def _name_drawings(command: click.Command) -> click.Command:
    """Add to the help of every option of `plot` the drawings that it is for."""
    for option in command.params:
        use = OPTION_USES.get(option.opts[-1])
        if isinstance(option, click.Option) and use is not None:
            others = [drawing for drawing in DRAWINGS if drawing not in use.drawings]
            named = f"Not for {join_names(others, None)}."
            if len(others) >= len(use.drawings):
                named = f"For {join_names(use.drawings, None)}."
            option.help = f"{option.help} {named}"
    return command


def _refuse_unused_options(what: str) -> None:
    """Raise BadInput for an option on the command line that the drawing does not use."""
    context = click.get_current_context()
    for option in context.command.params:
        use = OPTION_USES.get(option.opts[-1])
        is_set = option.name is not None and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
        if use is not None and is_set and what not in use.drawings:
            advice = f"; {use.advice}" if use.advice else ""
            raise BadInput(
                option.opts[-1],
                f"this option is for {join_names(use.drawings, None)}, and {what} does not use it{advice}",
            )


def _single_name(option: str, names: tuple[str, ...], what: str) -> str | None:
    """The one name that an option gives for a drawing of one thing. Raises BadInput for several."""
    if len(names) > 1:
        raise BadInput(option, f"{what} is drawn of one name, and {len(names)} are given; draw each by itself")
    return names[0] if names else None


@_name_drawings
@main.command()
@model_argument()
@timeout_option
@frame_number_option
@click.argument("what", type=click.Choice(DRAWINGS))
@output_option("Write the drawing to a .png, .svg, .pdf or .dxf file.", required=True)
@scale_option
@at_option
@click.option(
    "--point",
    "points",
    multiple=True,
    metavar="NAME",
    help="A point whose path is drawn, or that is lettered in every position.",
)
@click.option(
    "--of",
    "of",
    multiple=True,
    metavar="NAME",
    help="The slide, point, link or input that is drawn; diagrams draw several together.",
)
@click.option("--over", metavar="INPUTS", help="The inputs, as 'O,P' or 'O=10deg:50deg,P'.")
@click.option("--result", metavar="NAME", help="Which result of the slide, point or link, as velocity.")
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
    help="The flywheel's coefficient of fluctuation of speed, (greatest - least) / mean; 0.02 by default.",
)
@click.option(
    "--steps",
    default=12,
    show_default=True,
    metavar="N",
    help="Equal parts of the range: positions drawn, marks on centrodes, or with --chords chords of diagrams.",
)
@click.option("--chords", is_flag=True, help="Graphical differentiation beside the curves.")
@range_options
@mode_option
def plot(  # many: options of a command; # long: each has its line
    model: str,
    what: str,
    output: Path,
    scales: tuple[str, ...],
    at: tuple[str, ...],
    points: tuple[str, ...],
    of: tuple[str, ...],
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

    _refuse_unused_options(what)
    context = click.get_current_context()
    has_steps = context.get_parameter_source("steps") is ParameterSource.COMMANDLINE
    if what == "diagrams" and has_steps and not chords:
        raise BadInput("--steps", "diagrams use this with --chords: the number of chords")
    subject = None if what == "diagrams" else _single_name("--of", of, what)
    mechanism = load_model(model, mode, advice="")
    refuse_overwriting(model, output)
    with limited_time(f"{mechanism.name}: {what}", returns_part=True):
        if what in MAP_DRAWINGS:
            from planar.analysis.force_maps.force_map import force_map
            from planar.cli.commands.force_map import parse_ranges

            names = over or ",".join(given.pair for given in mechanism.inputs[:2])
            drawn.save(drawn.force_map(force_map(mechanism, parse_ranges(mechanism, names, None)), subject), output)
            return
        if what in PROFILE_DRAWINGS:
            drawn.save(drawn.cam_profile(mechanism, _single_name("--pair", pairs, what), scales), output)
            return
        if what in COGNATE_DRAWINGS:
            drawn.save(drawn.cognates(mechanism, subject, scales), output)
            return
        if what in (*ASSEMBLY_DRAWINGS, *CIRCUIT_DRAWINGS):
            from planar.assemblies.circuits.circuits import circuits
            from planar.assemblies.modes import modes

            every = what in ASSEMBLY_DRAWINGS
            here = modes(mechanism, parse_drives(mechanism, at), certify=every)
            sheets = (
                drawn.modes(here, scales) if every else drawn.circuits(circuits(here.mechanism, pair), subject, here)
            )
            drawn.save(sheets, output)
            return
        if what == "centres":
            from planar.analysis.centres.centres import chosen_links

            chosen_links(mechanism, ())  # a drawing shows the centres on whose lines others lie
        if what in POSITION_DRAWINGS:
            state = solve(mechanism, parse_drives(mechanism, at))
            figure = drawn.centres(state, scales, links) if what == "centres" else getattr(drawn, what)(state, scales)
        else:
            moving = _run_or_mechanism(mechanism, pair, start, stop)
            if len(links) > 2:
                raise BadInput(
                    "--link", "centrodes are of two links; name one, or one and the link that it is seen from"
                )
            link, other = (*links, None, None)[:2]
            drawings: dict[str, Callable[[], Drawing]] = {
                "positions": lambda: drawn.positions(moving, steps, points or None, scales),
                "loci": lambda: drawn.loci(moving, points or None, scales),
                "centrodes": lambda: drawn.centrodes(moving, link, other, scales, steps),
                "diagrams": lambda: drawn.diagrams(moving, of or None, steps if chords else None),
                "torque": lambda: drawn.torque(moving, subject, fluctuation),
                "bearings": lambda: drawn.bearings(moving, pairs or None),
                "sensitivity": lambda: drawn.sensitivity(moving, subject, result),
                "tolerance": lambda: drawn.tolerance(moving, subject, result, scales),
            }
            figure = drawings[what]()
        drawn.save(figure, output)


@main.command()
@model_argument()
@timeout_option
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

    mechanism = load_model(model, mode, advice="")
    refuse_overwriting(model, output)
    with limited_time(mechanism.name):
        drawn.animate(_run_or_mechanism(mechanism, pair, start, stop), output, points or None)


def _run_or_mechanism(
    mechanism: Mechanism, pair: str | None, start: str | None, stop: str | None
) -> Mechanism | Motion:
    """The run that the options ask for; without any the mechanism, whose drawings start where a slide's stroke does."""
    if pair is None and start is None and stop is None and len(mechanism.inputs) == 1:
        return mechanism
    return run_motion(mechanism, DRAWN_STEPS, pair, start, stop)
