"""All assemblies of a mechanism as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Any

from rich.console import Group as Stack
from rich.console import RenderableType
from rich.text import Text

from planar.assemblies.circuits.circuits import Circuits
from planar.assemblies.modes import Mode, Modes, ModesBlock
from planar.assemblies.selection import selection_words
from planar.foundation.errors import BadInput, Outcome, suggest_name
from planar.foundation.units import parse_unit
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, count_phrase, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import DIGITS, paragraphs

MAX_POINT_COLUMNS = 4
"""Points whose places are printed unless they are named."""
MAX_LISTED_NAMES = 6
"""Names or numbers of one sentence."""
MAX_CHOICE_GROUPS = 12
"""Groups: of more the choices are not printed."""
ZERO_RATIO = 1e-12
"""A coordinate below this part of the greatest is printed as 0."""


def table(modes: Modes, limit: int, points: Sequence[str] = (), circuits: Circuits | None = None) -> RenderableType:
    """The first assemblies: how many there are, group by group, and where each has the points; on which circuit."""
    mechanism = modes.mechanism
    shown = list(islice(modes, limit))
    count = count_text(modes, len(shown)) + _beyond_stops_text(shown)
    head = [Text(mechanism.name, style="bold"), Text(_inputs_text(modes)), Text(count)]
    names = _check_points(modes, points) if points else _distinguishing_points(modes, shown)
    told = [*modes.remarks]
    rest = [name for name in _moving_points(modes) if name not in names]
    if rest and not points:
        more = [*rest[:MAX_LISTED_NAMES], "more"] if len(rest) > MAX_LISTED_NAMES else rest
        told.append(f"places of {join_all_names(more)} with --point or --json")
    if modes.mechanism.sketch:
        told.append("off: how far the sketched points are from the sketch, root of the mean square")
    why: dict[str, list[str]] = {}
    for mode in shown:
        if mode.reason:
            why.setdefault(mode.reason, []).append(str(mode.number))
    for reason, which in why.items():
        numbers = [*which[:MAX_LISTED_NAMES], "more"] if len(which) > MAX_LISTED_NAMES else which
        told.append(f"{join_all_names(numbers)}: {reason}")
    notes = paragraphs((" -", sentence) for sentence in told)
    groups = [_groups_table(modes)] if modes.groups else []
    return Stack(*head, Text(), *groups, _assemblies_table(modes, shown, names, circuits), Text(), notes)


def count_text(modes: Modes, listed_count: int) -> str:
    """How many assemblies there are, and how sure that is: 4 assemblies, complete."""
    bound = modes.bound
    most = "" if bound is None else f", {bound} at most"
    if modes.outcome is Outcome.INTERRUPTED:
        return f"at least {count_phrase(listed_count, 'assembly', 'assemblies')}{most}; {modes.outcome.value}"
    if modes.total is None:
        return f"more than {count_phrase(listed_count, 'assembly', 'assemblies')}{most}; {modes.complete.value}"
    beside = f" of {bound} complex solutions" if bound is not None and bound != modes.total else ""
    left = f"; the first {listed_count} are listed" if listed_count < modes.total else ""
    return f"{count_phrase(modes.total, 'assembly', 'assemblies')}{beside}, {modes.complete.value}{left}"


def _beyond_stops_text(shown: Sequence[Mode]) -> str:
    """How many of those that are listed lie beyond a stop, which none can be brought to."""
    many = sum(mode.is_beyond_stop for mode in shown)
    return f"; {many} of these {'lies' if many == 1 else 'lie'} beyond a stop" if many else ""


def _groups_table(modes: Modes) -> FittedTable:
    rows = plain_table(
        "Groups of links, one after the other",
        "group",
        "links",
        "complex expected",
        "complex found",
        "assemblies",
        "the list is",
        left=(1, 5),
    )
    for number, group in enumerate(modes.groups, start=1):
        expected = "?" if group.expected is None else str(group.expected)
        rows.add_row(
            str(number),
            _group_members(group),
            expected,
            _range_text(group.found),
            _range_text(group.real),
            _completeness_text(group),
        )
    return rows


def _completeness_text(group: ModesBlock) -> str:
    return f"{group.complete.value}, with a curve of assemblies" if group.curve else group.complete.value


def _group_members(group: ModesBlock) -> str:
    return ", ".join(group.links or group.pairs)


def _range_text(ends: tuple[int, int]) -> str:
    return str(ends[0]) if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def _assemblies_table(
    modes: Modes, shown: Sequence[Mode], names: Sequence[str], circuits: Circuits | None
) -> FittedTable:
    length = modes.mechanism.units.length
    several = 1 < len(modes.groups) <= MAX_CHOICE_GROUPS
    leading = several + (0 if circuits is None else 2)
    near = modes.nearest
    rows = plain_table(
        "Assemblies",
        "no.",
        *(["groups"] if several else []),
        *([] if circuits is None else ["circuit", "branch"]),
        *(f"{name}: x y, {length}" for name in names),
        f"off, {length}",
        "proved",
        "",
        left=(len(names) + leading + 2, len(names) + leading + 3),
        keys=1 + several,
    )
    by = parse_unit(length)
    for mode in shown:
        distance = mode.distance
        rows.add_row(
            str(mode.number),
            *([".".join(map(str, mode.choices))] if several else []),
            *([] if circuits is None else [str(each or "-") for each in _circuit_and_branch(circuits, mode)]),
            *(_point_cell(mode, name, by) for name in names),
            "-" if distance is None else f"{by.from_si(distance):.4g}",
            "yes" if mode.certified else "no",
            ", ".join(_mode_remarks(modes, mode, near)),
        )
    return rows


def _circuit_and_branch(circuits: Circuits, mode: Mode) -> tuple[int | None, int | None]:
    """The numbers of the circuit and the branch on which an assembly lies."""
    place = circuits.of(mode)
    return (None, None) if place is None else (place[0].number, place[1].number)


def _mode_remarks(modes: Modes, mode: Mode, near: Mode | None) -> list[str]:
    found = [selection_words(modes.mechanism)] if near is not None and mode.choices == near.choices else []
    found += ["two that meet"] if mode.double else []
    return found + ([] if mode.outcome is Outcome.SOLVED else [mode.outcome.value])


def _point_cell(mode: Mode, name: str, by: Any) -> str:
    greatest = max((float(abs(at).max()) for at in mode.points.values()), default=0.0)
    told = [by.from_si(float(each)) if abs(each) > ZERO_RATIO * greatest else 0.0 for each in mode.points[name]]
    return " ".join(f"{each:.{DIGITS}g}" for each in told)


def _moving_points(modes: Modes) -> list[str]:
    """The points that are not on the frame or where the inputs put them, in the order in which they are placed."""
    first = modes.places
    return sorted((name for name, level in first.items() if level >= 0), key=lambda name: first[name])


def _distinguishing_points(modes: Modes, shown: Sequence[Mode]) -> list[str]:
    """Points whose places are printed: those that tell these assemblies apart, of each group one, then others."""
    names, first = _moving_points(modes), modes.places
    apart = {name for name in names if len({mode.points[name].tobytes() for mode in shown}) > 1}
    ones = set({first[name]: name for name in reversed(names)}.values())
    ordered = sorted(names, key=lambda name: (name not in apart, name not in ones))[:MAX_POINT_COLUMNS]
    return [name for name in names if name in ordered]


def _check_points(modes: Modes, points: Sequence[str]) -> list[str]:
    known = modes.places
    for name in points:
        if name not in known:
            raise BadInput("--point", f"there is no point {name!r}{suggest_name(name, known, 'points')}")
    return list(points)


def _inputs_text(modes: Modes) -> str:
    named, units = relative_motions(modes.mechanism), modes.mechanism.units
    told = [
        f"{given.pair} = {amount(given.position, named[given.pair].input_kind.value, units)}"
        for given in modes.mechanism.inputs
    ]
    return f"at {join_all_names(told)}" if told else "without inputs"


def record(modes: Modes, limit: int, circuits: Circuits | None = None) -> dict[str, Any]:
    """The first assemblies as a JSON value, in SI units; "circuit" and "branch" where circuits are given."""
    shown = list(islice(modes, limit))
    near = modes.nearest
    return {
        "mechanism": modes.mechanism.name,
        "outcome": modes.outcome.value,
        "inputs": {given.pair: given.position for given in modes.mechanism.inputs},
        "assemblies": modes.total,
        "bound": modes.bound,
        "listed": len(shown),
        "complete": modes.complete.value,
        "nearest": None if near is None else near.number,
        "groups": [group._asdict() | {"complete": group.complete.value} for group in modes.groups],
        "modes": [
            {
                "number": mode.number,
                "choices": list(mode.choices),
                "certified": mode.certified,
                "double": mode.double,
                "beyond_stop": mode.is_beyond_stop,
                "distance": mode.distance,
                "outcome": mode.outcome.value,
                "reason": mode.reason,
                "points": {name: at.tolist() for name, at in mode.points.items()},
                **(
                    {}
                    if circuits is None
                    else dict(zip(("circuit", "branch"), _circuit_and_branch(circuits, mode), strict=True))
                ),
            }
            for mode in shown
        ],
        "remarks": [*modes.remarks],
    }
