"""Instantaneous centres as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.centres.centres import Centres
from planar.analysis.centres.centrodes import CentrePath
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, unit_of_kind
from planar.model.link_graph import link_label
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, count_phrase, join_all_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import DIGITS, SIZE_PHRASE, paragraphs, precision_text
from planar.reports.tables.motion import motion_heading
from planar.results.motion import Motion, State

MAX_PATH_ROWS = 36
"""Steps between the rows of a path that are printed, at most."""
ZERO_RATIO = 1e-12
"""A coordinate below this part of the mechanism's size is printed as 0."""
METHOD_WORDS = {
    "pair": "by the pairs",
    "Kennedy": "by Kennedy's theorem",
    "ratio": "in the ratio of wheels",
    "equations": "by the equations round the loops",
    "as one": "of links that move as one",
    "open": "not determined",
}
"""How centres are found, in words."""


def table(centres: Centres) -> RenderableType:
    """All centres in the order of finding, and what proves them."""
    state = centres.state
    numbers = join_all_names([link_label(number, link) for link, number in centres.numbers.items()])
    notes = paragraphs((" -", sentence) for sentence in (*remarks(centres), *state.remarks))
    head = [Text(state.mechanism.name, style="bold"), Text(_inputs_text(state)), Text(f"links: {numbers}"), Text()]
    return Group(*head, _centres_table(centres), paragraphs(_proof_facts(centres)), Text(), notes)


def _centres_table(centres: Centres) -> FittedTable:
    state = centres.state
    length = state.mechanism.units.length
    rows = plain_table(
        "Instantaneous centres",
        "no.",
        "centre",
        "links",
        "how",
        (f"x, {length}", f"y, {length}"),
        "derivation",
        left=(1, 2, 3, 6),
        keys=2,
    )
    size = _largest_coordinate(state)
    for centre in centres:
        order = "" if centre.how in ("as one", "open") else str(centre.order)
        x, y = _coordinate_cells(centre.homogeneous, state.mechanism.units, size)
        rows.add_row(order, centre.name, " - ".join(centre.links), centre.how, x, y, centre.derivation)
    return rows


def path_table(motion: Motion, paths: Sequence[CentrePath]) -> RenderableType:
    """The paths of centres over a motion: at most some of its rows, evenly spaced, the first and the last included."""
    units = motion.mechanism.units
    ranges = {name: float(np.ptp(given.position)) for name, given in motion.inputs.items()}
    name = max(ranges, key=ranges.__getitem__)
    kind = "length" if motion.has_length_motion(name) else "angle"
    unit, of = unit_of_kind(kind, units) if motion.time is None else ("s", parse_unit("s"))
    abscissa = (motion.inputs[name].position if motion.time is None else motion.time)[: len(paths[0].homogeneous)]
    columns = [f"{path.name} {axis}, {units.length}" for path in paths for axis in "xy"]
    rows = plain_table(
        "Paths of instantaneous centres", f"{name if motion.time is None else 'time'}, {unit}", *columns, keys=1
    )
    size = max((float(np.abs(motion.point(point).position).max()) for point in motion.point_names), default=0.0)
    step = max(ceil((len(abscissa) - 1) / MAX_PATH_ROWS), 1)
    listed = [*range(0, len(abscissa) - 1, step), len(abscissa) - 1]
    for row in listed:
        cells = (cell for path in paths for cell in _coordinate_cells(path.homogeneous[row], units, size))
        at_zero = abs(abscissa[row]) <= ZERO_RATIO * np.abs(abscissa).max()
        rows.add_row("0" if at_zero else _format_number(of.from_si(float(abscissa[row]))), *cells)
    notes = [f"{path.name}: {' and '.join(path.links)}" + f"; {path.reason}" * bool(path.reason) for path in paths]
    notes.append("coordinates are in the axes of the frame")
    if step > 1:
        notes.append(f"{len(listed)} of {len(abscissa)} positions are listed; a file has all of them")
    return Group(*motion_heading(motion), Text(), rows, paragraphs(("-", note) for note in notes))


def path_series(paths: Sequence[CentrePath]) -> list[ReportedSeries]:
    """The paths of centres beside a run, in SI: the position, and the direction of a centre at infinity."""
    return [
        ReportedSeries(
            "centres",
            path.name,
            {"position": "length", "direction": "angle"},
            {"position": path.position, "direction": path.direction if np.isfinite(path.direction).any() else None},
        )
        for path in paths
    ]


def _location_text(at: np.ndarray, state: State) -> str:
    x, y = _coordinate_cells(at, state.mechanism.units, _largest_coordinate(state))
    return f"{x} {y}" if at[2] == 0.0 else f"at ({x}, {y}) {state.mechanism.units.length}"


def _largest_coordinate(state: State) -> float:
    """The largest coordinate of a point (m)."""
    return max((float(np.abs(point.position).max()) for point in state.points.values()), default=0.0)


def _coordinate_cells(at: np.ndarray | None, units: FileUnits, size: float) -> tuple[str, str]:
    """Where a homogeneous point (3,) lies, in the units of the file, for a mechanism of some size (m)."""
    if at is None or not np.isfinite(at).all():
        return "-", "-"
    x, y, w = at
    if w == 0.0:
        angle = float(np.arctan2(y, x)) if abs(y) > ZERO_RATIO else 0.0
        return "at infinity", f"at {amount(angle, 'angle', units)}"
    length = parse_unit(units.length)
    least = ZERO_RATIO * (size or 1.0)
    placed = (length.from_si(float(value)) if abs(value) > least else 0.0 for value in (x / w, y / w))
    x, y = (_format_number(value) for value in placed)
    return x, y


def _format_number(value: float) -> str:
    return f"{value:.{DIGITS}g}"


def _proof_facts(centres: Centres) -> list[tuple[str, str]]:
    proof = centres.proof
    by_jacobian = "each is that of the null vector of the whole Jacobian, "
    return [
        ("proof", by_jacobian + precision_text(proof.routes) if proof.routes is not None else "nothing can move here"),
        ("", f"the centres of any three links are in one line, {precision_text(proof.collinear)}"),
        *(
            [("", f"both links have one velocity in it, {precision_text(proof.velocities, 'of the greatest')}")]
            if proof.velocities is not None
            else []
        ),
        ("", f"the figures are the worst of all, lengths in parts {SIZE_PHRASE}"),
    ]


def remarks(centres: Centres) -> tuple[str, ...]:
    """Sentences: how many were found and how, which needed the equations, what is at rest, moves as one, or is open."""
    counts = Counter(centre.how for centre in centres)
    found = join_all_names([f"{counts[how]} {words}" for how, words in METHOD_WORDS.items() if counts[how]])
    links = count_phrase(len(centres.numbers), "link")
    if centres.links:
        links = f"{join_all_names(centres.links)} of {links}"
    said = [f"{count_phrase(len(centres), 'centre')} of {links}: {found}"]
    equations = [centre for centre in centres if centre.how == "equations"]
    if equations:
        taken = _choose_form(equations, "it was taken", "they were taken")
        names = join_all_names([centre.name for centre in equations])
        said.append(
            f"{names} needed the simultaneous equations of the rates round the loops: when {taken}, no other centre "
            f"lay on two known lines that meet well; all the rest follow from positions by pairs and lines"
        )
        if centres.state.mobility > 1:
            said.append(
                f"with {centres.state.mobility} freedoms the centres from number {equations[0].order} on are those of "
                "the given ratio of the inputs' rates"
            )
    else:
        said.append("none needed the simultaneous equations of the rates round the loops")
    frame = centres.state.mechanism.frame
    for group in centres.as_one:
        resting = [link for link in group if link != frame]
        if frame in group:
            said.append(f"{join_all_names(resting)} {_choose_form(resting, 'rests', 'rest')} in this position")
        else:
            said.append(f"{join_all_names(group)} move as one in this position, so that every point is their centre")
    open_ones = [centre for centre in centres if centre.how == "open"]
    if open_ones:
        why = open_ones[0].derivation.partition(": ")[2]
        names = join_all_names([centre.name for centre in open_ones])
        said.append(f"{names} {_choose_form(open_ones, 'is', 'are')} not determined: {why}")
    for number, branch in enumerate(centres.branches, start=1):
        placed = [f"{name} {_location_text(at, centres.state)}" for name, at in branch.items()]
        said.append(f"on branch {number} of those that cross here: {join_all_names(placed)}")
    return tuple(said)


def _choose_form(what: Any, one: str, several: str) -> str:
    return one if len(what) == 1 else several


def _inputs_text(state: State) -> str:
    named = relative_motions(state.mechanism)
    inputs = [
        f"{name} = {amount(given.position, named[name].input_kind.value, state.mechanism.units)}"
        for name, given in state.inputs.items()
    ]
    return f"at {join_all_names(inputs)}" if inputs else "without inputs"


def record(centres: Centres) -> dict[str, Any]:
    """All centres as a JSON value: metres, and unit vectors towards those at infinity."""
    return {
        "mechanism": centres.state.mechanism.name,
        "inputs": {name: given._asdict() for name, given in centres.state.inputs.items()},
        "links": dict(centres.numbers),
        "centres": [
            {
                "name": centre.name,
                "links": list(centre.links),
                "order": centre.order,
                "how": centre.how,
                "homogeneous": _to_list(centre.homogeneous),
                "position": _to_list(centre.position),
                "direction": _to_list(centre.direction),
                "derivation": centre.derivation,
                "lines": [
                    {"centres": list(line.centres)} if line.centres else {"pair": line.pair} for line in centre.lines
                ],
            }
            for centre in centres
        ],
        **({"of": list(centres.links)} if centres.links else {}),
        "as_one": [list(group) for group in centres.as_one],
        "branches": [{name: _to_list(at) for name, at in branch.items()} for branch in centres.branches],
        "proof": centres.proof._asdict(),
        "remarks": [*remarks(centres), *centres.state.remarks],
    }


def _to_list(vector: np.ndarray | None) -> list[float] | None:
    return None if vector is None else [float(value) for value in vector]
