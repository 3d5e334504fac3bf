"""Drawings of mechanisms as matplotlib figures in which a millimetre on paper is a millimetre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planar.document.first_argument import takes_mechanism, takes_result
from planar.drawing.output.figure_files import save
from planar.drawing.output.matplotlib_figure import draw_on_sheets, draw_pictures
from planar.drawing.paper.scales import Scale, parse_scales
from planar.foundation.safe_files import save_file as write

# what only some drawings need is imported where they are made: that takes longer than to draw
if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from planar.analysis.calibration.calibration import Calibration
    from planar.analysis.force_maps.force_map import ForceMap
    from planar.analysis.tolerance.tolerance import ToleranceBand
    from planar.assemblies.circuits.circuits import Circuits
    from planar.assemblies.modes import Modes
    from planar.drawing.polygons.panels import ScaleTexts
    from planar.dynamics.balancing.balance import Balance, BalanceTradeoff
    from planar.dynamics.forces import Forces
    from planar.dynamics.simulation import Simulation
    from planar.model.mechanism import Mechanism
    from planar.results.motion import Motion, State
    from planar.structures.chain import Chain
    from planar.synthesis.cognates.cognates import Cognates
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis
    from planar.synthesis.synthesis import Synthesis

    Drawing = Figure | list[Figure]  # one figure, or several sheets

__all__ = [
    "acceleration",
    "animate",
    "balance",
    "bearings",
    "calibration",
    "cam_profile",
    "centres",
    "centrodes",
    "chains",
    "circuits",
    "cognates",
    "designs",
    "diagrams",
    "dyad_curves",
    "forces",
    "loci",
    "modes",
    "positions",
    "save",
    "scheme",
    "solution",
    "torque",
    "two_directions",
    "velocity",
]


def _length_scale(scale: ScaleTexts, source: Any) -> Scale | None:
    """The scale of lengths among those that a reader writes, beside the units of what is drawn."""
    return parse_scales(scale, ["length"], getattr(source, "mechanism", source).units).get("length")


@takes_result("State")
def scheme(state: State, scale: ScaleTexts = None) -> Figure:
    """The kinematic scheme of a position: links numbered, points lettered, crowded parts once more and larger.

    Raises BadInput for a scale that is none.
    """
    from planar.drawing.scheme.details import scheme_with_details

    return draw_pictures(scheme_with_details(state, _length_scale(scale, state)))


@takes_result("State")
def velocity(state: State, scale: ScaleTexts = None) -> Figure:
    """The space diagram and the velocity polygon of a position, each to its scale."""
    from planar.drawing.polygons.panels import polygon_panels

    return draw_pictures(polygon_panels(state, scale, 2), state.mechanism.name)


@takes_result("State")
def acceleration(state: State, scale: ScaleTexts = None) -> Figure:
    """The space diagram, the velocity polygon and the acceleration polygon of a position, each to its scale."""
    from planar.drawing.polygons.panels import polygon_panels

    return draw_pictures(polygon_panels(state, scale, 3), state.mechanism.name)


@takes_result("State")
def centres(
    state: State, scale: ScaleTexts = None, links: str | Sequence[str] | None = None, reach: float | None = None
) -> Figure:
    """The scheme of a position with its instantaneous centres, and beside it the circle diagram.

    `links` chooses: of one all its centres, of several those between any two of them; left out, all centres, or of
    more than 28 those that pairs show and those against the frame. The view grows to the nearest centres until it is
    `reach` times the mechanism's greater extent (3 by default); arrows with coordinates lead to the others. Raises
    BadInput for a link that there is not, a scale that is none, and a reach below 1.
    """
    from planar.analysis.centres.centres import centres as all_centres
    from planar.drawing.centres.centres import DEFAULT_REACH, centres_picture
    from planar.drawing.centres.choice import choose_centres
    from planar.drawing.centres.circle_diagram import circle_picture

    found = all_centres(state)
    shown = choose_centres(found, links)
    drawn = centres_picture(found, shown, _length_scale(scale, state), DEFAULT_REACH if reach is None else reach)
    return draw_pictures([drawn, circle_picture(found, shown)], state.mechanism.name)


@takes_result("Calibration")
def calibration(found: Calibration) -> Figure:
    """What was measured over what the fitted mechanism shows: residuals enlarged, and their histograms."""
    from planar.drawing.diagrams.calibration_drawing import calibration_pictures

    return draw_pictures(calibration_pictures(found), found.mechanism.name)


@takes_mechanism
def cam_profile(mechanism: Mechanism, pair: str | None = None, scale: ScaleTexts = None) -> Figure:
    """A cam's profile by inversion, with pitch curve and base circle, and its displacement diagram.

    `pair` names the cam where there are several. Raises BadInput where there is none with a profile, and for a scale
    that is none.
    """
    from planar.analysis.cams.cam_profile import cam_profile as profile_of
    from planar.drawing.diagrams.cam_drawing import cam_pictures

    used = parse_scales(scale, ["length"]).get("length")
    return draw_pictures(cam_pictures(profile_of(mechanism, pair), mechanism.units, used), mechanism.name)


@takes_result("Motion", "Mechanism")
def positions(
    motion: Motion | Mechanism, count: int = 12, points: Sequence[str] | None = None, scale: ScaleTexts = None
) -> Figure:
    """The mechanism in `count` + 1 positions, its joints lettered A0, A1, ...; TDC and BDC where a slider has them."""
    from planar.drawing.diagrams.positions import positions as picture

    return draw_pictures([picture(motion, count, points, _length_scale(scale, motion))])


@takes_result("Motion", "Mechanism")
def loci(motion: Motion | Mechanism, points: Sequence[str] | None = None, scale: ScaleTexts = None) -> Figure:
    """The paths of points (left out: of those that no link on the frame carries)."""
    from planar.drawing.diagrams.positions import loci as picture

    return draw_pictures([picture(motion, points, _length_scale(scale, motion))])


@takes_result("Motion", "Mechanism")
def centrodes(
    motion: Motion | Mechanism,
    link: str | None = None,
    other: str | None = None,
    scale: ScaleTexts = None,
    marks: int | None = None,
) -> Figure:
    """The fixed and the moving centrode of a link against another (left out: the frame), touching in their pole.

    Without a `link` those of the first coupler. About `marks` round positions of the input (12 by default, 0 for none)
    are marked on both. Raises BadInput for a link that does not exist, a scale or a number of marks that is none.
    """
    from planar.drawing.centres.centrodes import DEFAULT_MARKS, centrodes_picture

    count = DEFAULT_MARKS if marks is None else marks
    return draw_pictures([centrodes_picture(motion, link, other, _length_scale(scale, motion), count)])


def chains(found: Chain | Sequence[Chain], mechanisms: bool = False) -> list[Figure]:
    """Kinematic chains with their numbers, links as bars and plates, twenty on a sheet of A4; beneath each what it is.

    With `mechanisms` every inversion, its fixed link hatched, and black the joints by which its mechanisms are driven.
    Raises BadInput for anything else than chains.
    """
    from planar.drawing.structures.chain_sheets import chain_sheets, draw_chains, inversion_sheets

    return [*(inversion_sheets if mechanisms else chain_sheets)(draw_chains(found))]


def designs(found: Synthesis) -> list[Figure]:
    """Sheets of what `planar.synthesise` found, over what is wanted. Raises BadInput where no design is sound."""
    from planar.drawing.designs.design_sheets import design_sheets

    return design_sheets(found)


@takes_result("Modes", "Mechanism")
def modes(assemblies: Modes | Mechanism, scale: ScaleTexts = None) -> list[Figure]:
    """Every assembly drawn small, numbered, to one scale, the sketch's own marked: sheets of 20, 96 at the most.

    Raises BadInput for a scale that is none, and NoAnswer where there is no assembly.
    """
    from planar.assemblies.modes import Modes
    from planar.assemblies.modes import modes as all_modes
    from planar.drawing.scheme.assemblies import assembly_sheets

    found = assemblies if isinstance(assemblies, Modes) else all_modes(assemblies)
    return [draw_pictures(*sheet) for sheet in assembly_sheets(found, _length_scale(scale, found))]


@takes_result("Circuits", "Mechanism")
def circuits(found: Circuits | Mechanism, of: str | None = None, assemblies: Modes | None = None) -> list[Figure]:
    """All circuits, an output over the input that runs: each in a panel of its own, its branches and dead points told.

    `of` is a slide, a link, a pair, or a point (its x, then its y), chosen as for diagrams where it is left out.
    `assemblies` are marked, left out those at the mechanism's inputs. Raises BadInput for an output that is not there,
    and NoAnswer where no circuit was found.
    """
    from planar.assemblies.circuits.circuit_of_assembly import locate_assemblies
    from planar.assemblies.circuits.circuits import Circuits
    from planar.assemblies.circuits.circuits import circuits as all_circuits
    from planar.assemblies.modes import modes as all_modes
    from planar.drawing.circuits.diagram import circuit_figures

    of_all = found if isinstance(found, Circuits) else all_circuits(found)
    here = all_modes(of_all.mechanism, certify=False) if assemblies is None else assemblies
    return circuit_figures(of_all, locate_assemblies(of_all, here), of)


@takes_result("Cognates", "Mechanism")
def cognates(found: Cognates | Mechanism, of: str | None = None, scale: ScaleTexts = None) -> Figure:
    """A mechanism with all that trace the path of a point as it does: up to three in one picture, else each alone.

    `of` is the point, where a mechanism is given (left out: the first that has cognates). Raises BadInput where no
    point has any, Unknown for one that is not there, and what `planar.cognates` raises.
    """
    from planar.drawing.diagrams.cognate_drawing import cognate_pictures
    from planar.synthesis.cognates.cognates import cognates_of

    of_all = cognates_of(found, of)
    heading = f"{of_all.mechanism.name}: cognates of the path of {of_all.point}"
    return draw_pictures(cognate_pictures(of_all, _length_scale(scale, of_all)), heading)


def dyad_curves(found: CompleteSynthesis, scale: ScaleTexts = None) -> Figure:
    """The curves that poses leave of dyads: where joints may be, and their pivots. Raises BadInput without any."""
    from planar.drawing.diagrams.dyad_drawing import dyad_pictures

    return draw_pictures(*dyad_pictures(found, scale))


@takes_result("Forces", "State")
def forces(found: Forces | State, scale: ScaleTexts = None) -> list[Figure]:
    """Every moving link as a free body with all that acts on it, and its force polygon, on sheets of A4 on its side.

    One scale of length and one of force, such as "1 cm = 500 N", hold for all. What equilibrium does not tell is named
    and not drawn. Raises BadInput for forces over a motion and scales that are none, and what `planar.forces` raises.
    """
    from planar.drawing.forces.free_bodies import free_bodies
    from planar.dynamics.forces import Forces
    from planar.dynamics.forces import forces as all_forces

    return draw_on_sheets(*free_bodies(found if isinstance(found, Forces) else all_forces(found), scale))


@takes_result("Forces", "Motion", "Mechanism")
def torque(found: Forces | Motion | Mechanism, of: str | None = None, fluctuation: float | None = None) -> Figure:
    """The torque or force of an input over a cycle at its steady speed: mean, parts, greatest and least, flywheel.

    `of` left out: of the input that runs; `fluctuation` is the flywheel's coefficient of fluctuation of speed (left
    out: 0.02). Forces over a motion are drawn as they are. Raises BadInput for an input that there is not, and a
    coefficient that is none.
    """
    from planar.drawing.forces.torque import torque_picture
    from planar.dynamics.flywheel import DEFAULT_FLUCTUATION

    return draw_pictures([torque_picture(found, of, DEFAULT_FLUCTUATION if fluctuation is None else fluctuation)])


@takes_result("ForceMap")
def force_map(found: ForceMap, of: str | None = None) -> Figure:
    """What an input (left out: the first of the map) supplies over the first two inputs of a map of forces.

    A curve over one input, lines of equal effort over two. Raises BadInput for an input that there is not.
    """
    from planar.drawing.forces.force_map import force_map_picture

    return draw_pictures([force_map_picture(found, of)])


@takes_result("Forces", "Motion", "Mechanism")
def bearings(found: Forces | Motion | Mechanism, pairs: Sequence[str] | None = None) -> list[Figure]:
    """The loads of pairs (left out: of all in which points or lines meet) over a cycle, on sheets of A4 on its side.

    Polar load diagrams in the frame's axes; of a sliding pair the force across its line and the couple over the input.
    Raises BadInput for a pair that there is not.
    """
    from planar.drawing.forces.bearing_loads import bearing_pictures
    from planar.model.mechanism import Mechanism

    mechanism = found if isinstance(found, Mechanism) else found.mechanism
    return draw_on_sheets(bearing_pictures(found, pairs), f"{mechanism.name}: loads of the pairs")


@takes_result("Motion", "Forces", "Mechanism")
def sensitivity(moving: Motion | Forces | Mechanism, of: str | None = None, result: str | None = None) -> Figure:
    """What a little more of each number of the file does to a result over a motion: the greatest influences.

    `of` is a point, link, pair or input (left out: the first slide or rocker that is an output, else the first point
    that moves), `result` which of its results (left out: the first); of forces their efforts and reactions, too.
    """
    from planar.analysis.sensitivity.sensitivity import sensitivity as derivatives
    from planar.drawing.diagrams.sensitivity_curves import sensitivity_picture
    from planar.model.mechanism import Mechanism
    from planar.solving.cycle import cycle

    run = cycle(moving) if isinstance(moving, Mechanism) else moving
    name = of or next(iter(run.mechanism.inputs)).pair
    return draw_pictures([sensitivity_picture(derivatives(run, name), result)])


@takes_result("Motion", "Forces", "ToleranceBand", "Mechanism")
def tolerance(
    moving: ToleranceBand | Motion | Forces | Mechanism,
    of: str | None = None,
    result: str | None = None,
    scale: ScaleTexts = None,
) -> Figure:
    """The band of a result within the tolerances of the file, or of a band: of a point's place round its path, wider by
    a factor that is told, else over the motion; and the share of the variance of each number and pin.

    `of` and `result` are chosen as for `sensitivity`. Raises Unknown and BadInput.
    """
    from planar.analysis.tolerance.tolerance import ToleranceBand
    from planar.analysis.tolerance.tolerance import tolerance as find_band
    from planar.drawing.diagrams.tolerance_band import tolerance_pictures
    from planar.model.mechanism import Mechanism
    from planar.solving.cycle import cycle

    band = cycle(moving) if isinstance(moving, Mechanism) else moving
    if not isinstance(band, ToleranceBand):
        band = find_band(band, of or next(iter(band.mechanism.inputs)).pair, result=result)
    return draw_pictures(tolerance_pictures(band, _length_scale(scale, band.moving)))


@takes_result("Motion", "Simulation", "Mechanism")
def diagrams(
    motion: Motion | Simulation | Mechanism,
    of: str | Sequence[str] | None = None,
    chords: int | None = None,
    width: float = 120.0,
) -> Figure:
    """S-t, V-t and a-t diagrams of slides, points or links over a motion in time, or a run at the input's steady speed.

    `of` names one or several: lengths share one axis for each of displacement, velocity and acceleration, angles have
    axes of their own below them. `of` left out: the first slide on the frame that is not driven, else the angle of the
    link on a pin of the frame that is farthest along. A slide on the frame is measured from its top dead centre, and
    the run starts at that of the first one named. `width` is the length of the time axis in mm on paper; `chords` adds
    graphical differentiation over so many intervals (Machine Elements, 1.3.6 (iii)). Where the file gives no speed,
    rates are per radian (or metre) of the input. Intervals of a simulation in which friction holds the pairs drawn, or
    any pair if it holds none of them, are shaded. Raises BadInput, and NoAnswer.
    """
    from planar.drawing.diagrams.kinematic_diagrams import diagrams as drawn

    return drawn(motion, of, chords, width)


@takes_result("State")
def solution(state: State, scale: ScaleTexts = None) -> list[Figure]:
    """The worked solution of a position on pages of A4."""
    from planar.drawing.output.solution_pages import solution_pages

    return solution_pages(state, scales=parse_scales(scale, units=state.mechanism.units))


@takes_result("State")
def two_directions(state: State, link: str, points: Sequence[str] | None = None, scale: ScaleTexts = None) -> Figure:
    """The construction of a link's centre C from the directions of two of its points' velocities (r, v, and ω = v / r).

    `points` left out: the two joints of the link that lie farthest apart. Raises BadInput, also for a link at rest.
    """
    from planar.drawing.centres.two_directions import directions_picture

    given = parse_scales(scale, units=state.mechanism.units)
    return draw_pictures([directions_picture(state, link, points, given.get("length"), given.get("velocity"))])


@takes_result("Balance")
def balance(found: Balance, tradeoff: BalanceTradeoff | None = None) -> Figure:
    """What shakes the frame before and after balancing: a polar diagram of the force, the moment, the input's effort.

    With `tradeoff`, as `planar.balance_tradeoff` gives it, also the least moment over the force.
    """
    from planar.drawing.forces.shaking import balance_pictures

    return draw_pictures(balance_pictures(found, tradeoff), found.motion.mechanism.name)


@takes_result("Motion", "Mechanism")
def animate(
    motion: Motion | Mechanism,
    file: str | Path,
    points: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write the motion as a .gif or .mp4 file, with the paths of points. `progress` is told (frames done, frames).

    Raises BadInput for another kind of file, and where what writes it is not installed.
    """
    from planar.drawing.output.animation import animate as moving

    write(Path(file), moving(motion, Path(file).suffix, points, progress))
