"""Reads a task's file: the starts, what is wanted of them, and what else is demanded. BadInput names the place."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf, pi
from pathlib import Path
from typing import Any

import numpy as np

from planar.document.cursor import Cursor, FileContext, describe_value
from planar.document.files import find_model_file, load, load_value
from planar.document.names import find_motion, find_point, point_aliases
from planar.document.reader import read_mechanism, read_units
from planar.document.schema import FORMAT_VERSION
from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.safe_files import is_existing
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.synthesis.task.starts import motion_kind, start_numbers
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    Demands,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)
from planar.synthesis.task.task_file import (
    CHAIN_START_SCHEMA,
    DEMAND_SCHEMA,
    DEMAND_WORDS,
    FUNCTION_PAIR_SCHEMA,
    FUNCTION_SCHEMA,
    GREATEST_CHAIN,
    LEAST_CHAIN,
    LEAST_CLOSED,
    MAX_CORNERS,
    PATH_SCHEMA,
    PLACE_SCHEMA,
    POSE_SCHEMA,
    POSES_SCHEMA,
    TASK_SCHEMA,
    WHOLE_TURN,
    write_task,
)

CHAINS_UNNAMED = "chains have no names yet of links and pairs; to start from them, only paths of new points are wanted"


class WantedReader:
    """Reads what is wanted of `starts`, in which all that is named must be; none: chains, where nothing has a name."""

    def __init__(self, starts: Sequence[Mechanism]):
        self.starts = tuple(starts)

    def read(self, cursor: Cursor) -> Wanted:
        """One thing that is wanted. Raises BadInput with its place."""
        if cursor.has("through") or cursor.has("point"):
            return self._read_path(cursor)
        if cursor.has("poses") or cursor.has("link"):
            return self._read_poses(cursor)
        if cursor.has("pairs") or cursor.has("from"):
            return self._read_function(cursor)
        told = "'point' with 'through', 'link' with 'poses', or 'from', 'to' and 'pairs' are wanted here"
        raise cursor.error_at(None, told)

    # paths

    def _read_path(self, cursor: Cursor) -> WantedPath:
        cursor.check_keys(*PATH_SCHEMA)
        point, link = self._read_point(cursor)
        entries = [self._read_place(each) for each in cursor["through"].items()]
        if not entries:
            raise cursor.error_at("through", "places are wanted here, as [[0, 25], [52, 10]]")
        places, inputs, weights = zip(*entries, strict=True)
        is_closed = cursor.flag("closed")
        if is_closed and len(places) < LEAST_CLOSED:
            message = f"a closed curve takes {LEAST_CLOSED} places at least, not {len(places)}"
            raise cursor.error_at("through", message)
        if is_closed:
            check_turning_input(cursor["closed"], self.starts, "a closed curve takes a whole turn of the input")
        return WantedPath(
            point,
            frozen_array(places),
            _read_timing(cursor["through"], inputs),
            frozen_array(weights),
            is_closed or cursor.flag("in_order"),
            is_closed,
            cursor.flag("absolute"),
            _read_tolerance(cursor, "length"),
            link,
        )

    def _read_place(self, cursor: Cursor) -> tuple[tuple[float, float], float | None, float]:
        if isinstance(cursor.value, list):
            return cursor.as_vector("length"), None, 1.0
        cursor.check_keys(*PLACE_SCHEMA)
        return cursor["at"].as_vector("length"), self._read_input(cursor), _read_weight(cursor)

    def _read_point(self, cursor: Cursor) -> tuple[str, str | None]:
        """The wanted point, by the name that results give it, and the link that is to carry a new one."""
        here = cursor["point"]
        if not self.starts:
            if cursor.has("on"):
                raise cursor.error_at("on", "chains have no names yet of links; every link is tried, leave this out")
            return here.as_name(), None
        link = cursor["on"].as_text() if cursor.has("on") else None
        found = [
            _find_own_point(here, start) if link is None else _find_carried_point(cursor, start, link)
            for start in self.starts
        ]
        for start, point in zip(self.starts, found, strict=True):
            if point != found[0]:
                told = f"this is {point!r} in {start.name!r} and {found[0]!r} in {self.starts[0].name!r}"
                raise here.error_at(None, f"{told}; it needs one name in all starts")
        return found[0], link

    # poses

    def _read_poses(self, cursor: Cursor) -> WantedPoses:
        cursor.check_keys(*POSES_SCHEMA)
        link = self._find_moving_link(cursor["link"])
        places, angles, inputs, weights = [], [], [], []
        for each in cursor["poses"].items():
            each.check_keys(*POSE_SCHEMA)
            places.append(each["at"].as_vector("length"))
            angles.append(each.quantity("angle", "angle"))
            inputs.append(self._read_input(each))
            weights.append(_read_weight(each))
        if not places:
            raise cursor.error_at("poses", 'poses are wanted here, as [{"at": [0, 1], "angle": 10}]')
        return WantedPoses(
            link,
            frozen_array(places),
            frozen_array(np.unwrap(angles)),
            _read_timing(cursor["poses"], inputs),
            frozen_array(weights),
            cursor.flag("in_order"),
            cursor.flag("absolute"),
            _read_tolerance(cursor, "length"),
        )

    def _find_moving_link(self, cursor: Cursor) -> str:
        if not self.starts:
            raise cursor.error_at(None, CHAINS_UNNAMED)
        for start in self.starts:
            _find_link(cursor, cursor.as_text(), start)
        return cursor.as_text()

    # functions

    def _read_function(self, cursor: Cursor) -> WantedFunction:
        cursor.check_keys(*FUNCTION_SCHEMA)
        given, kind = self._find_pair(cursor["from"])
        for start in self.starts:
            if given != start.inputs[0].pair:
                told = f"the input that runs is {start.inputs[0].pair!r}; a function is of that one"
                raise cursor.error_at("from", told)
        to, value_kind = self._find_pair(cursor["to"])
        if to == given:
            raise cursor.error_at("to", f"{to!r} is the input itself; a function is of another pair")
        rows = [self._read_function_pair(each, kind, value_kind) for each in cursor["pairs"].items()]
        if not rows:
            raise cursor.error_at("pairs", "pairs of positions are wanted here, as [[0, 0], [20, 31]]")
        inputs, values, weights = map(frozen_array, zip(*rows, strict=True))
        tolerance = _read_tolerance(cursor, value_kind)
        return WantedFunction(given, to, inputs, values, weights, cursor.flag("absolute"), tolerance)

    def _find_pair(self, cursor: Cursor) -> tuple[str, str]:
        """A relative motion of all starts, and whether it is a length or an angle."""
        if not self.starts:
            raise cursor.error_at(None, CHAINS_UNNAMED)
        found = [find_motion(cursor, relative_motions(start)) for start in self.starts]
        kinds = [each.input_quantity_kinds()[0] for each in found]
        if len({*kinds}) > 1:
            raise cursor.error_at(None, f"{cursor.as_text()!r} is an angle in some starts and a length in others")
        return found[0].name, kinds[0]

    def _read_function_pair(self, cursor: Cursor, kind: str, value_kind: str) -> tuple[float, float, float]:
        weight, both = 1.0, cursor
        if isinstance(cursor.value, dict):
            cursor.check_keys(*FUNCTION_PAIR_SCHEMA)
            weight, both = _read_weight(cursor), cursor["at"]
        numbers = tuple(both.items())
        if len(numbers) != 2:
            raise both.error_at(None, f"two numbers [input, output] are wanted here, not {len(numbers)}")
        return numbers[0].as_quantity(kind), numbers[1].as_quantity(value_kind), weight

    # inputs

    def _read_input(self, cursor: Cursor) -> float | None:
        if not cursor.has("input"):
            return None
        kinds = [motion_kind(start, start.inputs[0].pair) for start in self.starts]
        if len({*kinds}) > 1:
            raise cursor.error_at("input", "it is an angle in some starts and a length in others")
        return cursor["input"].as_quantity(kinds[0] if kinds else "angle")


def check_turning_input(cursor: Cursor, starts: Sequence[Mechanism], told: str) -> None:
    """Refuse what takes a whole turn of the running input, where that slides."""
    for start in starts:
        pair = start.inputs[0].pair
        if motion_kind(start, pair) == "length":
            raise cursor.error_at(None, f"{told}, and {pair!r} of {start.name!r} slides")


def frozen_array(values: Any) -> Array:
    """Numbers as an array that cannot be written to."""
    found = np.array(values, float)
    found.flags.writeable = False
    return found


def _find_own_point(cursor: Cursor, start: Mechanism) -> str:
    """A point that a start has, and that moves."""
    name, aliases = cursor.as_text(), point_aliases(start)
    if name not in aliases and not any(other.endswith(f".{name}") for other in aliases):
        near = suggest_name(name, dict.fromkeys(aliases.values()), "points")
        raise cursor.error_at(None, f"{start.name!r} has no point {name!r}{near}; 'on' names the link for a new one")
    found = find_point(cursor, name, aliases)
    members = next(point.members for point in named_points(start) if point.name == found)
    if start.frame in (link for link, _ in members):
        raise cursor.error_at(None, f"{found!r} is a point of the frame and does not move; another one is wanted here")
    return found


def _find_carried_point(cursor: Cursor, start: Mechanism, link: str) -> str:
    """A point that a link of a start has, or is to have; no other link has one of its name."""
    here, aliases = cursor["point"], point_aliases(start)
    _find_link(cursor["on"], link, start)
    name = here.as_text()
    if f"{link}.{name}" in aliases:
        return aliases[f"{link}.{name}"]
    others = [other for other in aliases if other == name or other.endswith(f".{name}")]
    if others:
        told = f"{start.name!r} has a point {name!r} on another link; leave 'on' out, or take a name that is new"
        raise here.error_at(None, told)
    return here.as_name()


def _find_link(cursor: Cursor, name: str, start: Mechanism) -> None:
    """See that a start has a link of this name, and that it moves."""
    known = [link.name for link in start.links]
    if name not in known:
        raise cursor.error_at(None, f"{start.name!r} has no link {name!r}{suggest_name(name, known, 'links')}")
    if name == start.frame:
        raise cursor.error_at(None, f"{name!r} is the frame and does not move; another link is wanted here")


def _read_timing(cursor: Cursor, inputs: Sequence[float | None]) -> Array | None:
    given = [drive is not None for drive in inputs]
    if not any(given):
        return None
    if not all(given):
        raise cursor.error_at(None, f"'input' is given for some; entry {given.index(False) + 1} lacks it")
    return frozen_array(inputs)


def _read_tolerance(cursor: Cursor, kind: str) -> float | None:
    """None where there is none, 0 of what is to be met exactly."""
    if not cursor.has("tolerance"):
        return None
    return cursor["tolerance"].as_positive(kind) if cursor.quantity("tolerance", kind) else 0.0


def _read_weight(cursor: Cursor) -> float:
    if not cursor.has("weight"):
        return 1.0
    found = cursor["weight"].as_number()
    if not found > 0.0:
        raise cursor.error_at("weight", f"a weight above zero is wanted here, not {cursor['weight'].value!r}")
    return found


FLAT = 1e-12
"""Of the squared extent of a polygon: an area below is none."""


def read_demands(items: Iterable[Cursor], starts: Sequence[Mechanism]) -> Demands:
    """The demands of a list. Raises BadInput with the place."""
    demands = Demands()
    for item in items:
        if isinstance(item.value, str):
            if item.as_choice(DEMAND_WORDS) == WHOLE_TURN:
                check_turning_input(item, starts, "only an input that turns can make a whole turn")
                demands = demands._replace(whole_turn=True)
            else:
                demands = demands._replace(one_branch=True)
            continue
        item.check_keys(*DEMAND_SCHEMA)
        if not item.fields():
            raise item.error_at(None, "a demand is wanted here: 'whole turn', 'transmission' or 'inside'")
        for key in item.fields():
            if getattr(demands, key) is not None:
                raise item.error_at(key, f"{key!r} is demanded already; write one of the two")
        if item.has("transmission"):
            angle = item["transmission"].as_positive("angle")
            if not angle < pi / 2:
                message = "a least transmission angle is less than a right angle"
                raise item["transmission"].error_at(None, message)
            demands = demands._replace(transmission=angle)
        if item.has("inside"):
            demands = demands._replace(inside=_read_region(item["inside"]))
    return demands


def _read_region(cursor: Cursor) -> Array:
    """The corners (n, 2) of a rectangle or a polygon."""
    given = tuple(cursor.items())
    if len(given) > MAX_CORNERS:
        raise cursor.error_at(None, f"a polygon has {MAX_CORNERS} corners at most, not {len(given)}")
    corners = np.array([value.as_vector("length") for value in given])
    if len(corners) < 2:
        raise cursor.error_at(None, "two opposite corners of a rectangle are wanted here, or a polygon's corners")
    if len(corners) == 2:
        (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
        corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    extent = float(np.ptp(corners, axis=0).max())
    unit = (corners - corners[0]) / (extent or 1.0)
    x, y = unit.T
    if _crosses_itself(unit):
        raise cursor.error_at(None, "the sides of this polygon cross; its corners stand one after the other round it")
    if not 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) > FLAT:
        raise cursor.error_at(None, "there is nothing inside: the corners lie on one line")
    return frozen_array(corners)


def _crosses_itself(corners: Array) -> bool:
    """Whether two sides of a polygon (n, 2) cross between their ends."""
    start, end = corners[:, None], np.roll(corners, -1, axis=0)[:, None]
    side = end - start

    def left_of(points: Array) -> Array:
        """On which side (sides, n) of each side points (n, 2) lie."""
        away = points[None] - start
        return np.asarray(np.sign(side[..., 0] * away[..., 1] - side[..., 1] * away[..., 0]))

    first, second = left_of(corners), left_of(np.roll(corners, -1, axis=0))
    parted = first * second < 0.0
    return bool((parted & parted.T).any())


TaskSource = Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask
"""A task, what stands in its file, or the file."""


def read_task(source: TaskSource) -> SynthesisTask:
    """The task in a file, or that a JSON value describes; "-" is what is piped in. Raises BadInput with the place.

    A SynthesisTask made in Python is checked as its file would be.

    >>> import planar
    >>> wanted = [{"point": "E", "through": [["0 mm", "0 mm"], ["20 mm", "12 mm"]]}]
    >>> planar.read_task({"planar": 1, "name": "Lid", "start": "four-bar", "wanted": wanted})
    <SynthesisTask 'Lid': 2 wanted entries>
    """
    if isinstance(source, SynthesisTask):
        return _TaskReader(Path()).read(Cursor(write_task(source)))
    if isinstance(source, str | os.PathLike):
        return _TaskReader(Path(os.fsdecode(source)).parent).read(Cursor(load_value(source, "a task's file")))
    if isinstance(source, Mapping):
        return _TaskReader(Path()).read(Cursor(_with_written_starts(source)))
    told = f"{type(source).__name__} {source!r:.60}"
    raise BadInput("task", f"a task's file, or what stands in one, is wanted, not {told}")


def _with_written_starts(source: Mapping[str, Any]) -> dict[str, Any]:
    """The value of a task in which a start may be a Mechanism, with these as their files have them."""

    def written(start: Any) -> Any:
        return write_mechanism(start) if isinstance(start, Mechanism) else start

    value = dict(source)
    if "start" in value:
        start = value["start"]
        value["start"] = [written(each) for each in start] if isinstance(start, list) else written(start)
    return value


class _TaskReader:
    """`folder` is where files to start from are looked for first."""

    def __init__(self, folder: Path):
        self.folder = folder

    def read(self, top: Cursor) -> SynthesisTask:
        """The task that the value of a file describes. Raises BadInput."""
        top.check_json()
        top.check_keys(*TASK_SCHEMA)
        version = top["planar"].value
        if version != FORMAT_VERSION or isinstance(version, bool):
            told = f"the format is to be the number {FORMAT_VERSION}, not {describe_value(version)}"
            raise top.error_at("planar", told)
        units = read_units(top)
        top = replace(top, context=FileContext(units))
        starts = self._read_starts(top["start"])
        mechanisms = () if isinstance(starts, ChainStart) else starts
        reader = WantedReader(mechanisms)
        wanted = tuple(reader.read(each) for each in top["wanted"].items())
        if not wanted:
            raise top.error_at("wanted", "nothing is wanted: give a path, poses, or a function")
        numbers = NumberNames(mechanisms, wanted)
        free = numbers.read_free(top["free"]) if top.has("free") else ()
        return SynthesisTask(
            (top["name"].as_line().strip() if top.has("name") else "") or "task",
            wanted,
            starts,
            free,
            numbers.read_bounds(top.object_at("within"), free) if top.has("within") else {},
            read_demands(top.list_items("demands"), mechanisms),
            units,
        )

    def _read_starts(self, cursor: Cursor) -> tuple[Mechanism, ...] | ChainStart:
        value = cursor.value
        if isinstance(value, dict) and "chains" in value:
            cursor.check_keys(*CHAIN_START_SCHEMA)
            return ChainStart(_read_chain_sizes(cursor))
        found = [self._read_start(each) for each in (cursor.items() if isinstance(value, list) else [cursor])]
        if not found:
            raise cursor.error_at(None, "a mechanism to start from is wanted here, or several")
        return tuple(found)

    def _read_start(self, cursor: Cursor) -> Mechanism:
        if isinstance(cursor.value, dict):
            try:
                found = read_mechanism(cursor.value)
            except BadInput as problem:
                raise BadInput(problem.place.replace("$", cursor.path, 1), problem.sentence) from None
        else:
            name = cursor.as_text()
            beside = self.folder / name
            is_beside = is_existing(beside) and beside.is_file()
            try:
                found = load(beside if is_beside else find_model_file(name))
            except BadInput as problem:
                raise cursor.error_at(None, f"{problem.place}: {problem.sentence}") from None
        if not found.inputs:
            raise cursor.error_at(None, f"{found.name!r} has no input that could run; give it 'inputs'")
        return found


def _read_chain_sizes(cursor: Cursor) -> tuple[int, ...]:
    links = []
    for each in cursor["chains"].items():
        number = each.as_number()
        if not number.is_integer() or not LEAST_CHAIN <= number <= GREATEST_CHAIN:
            told = f"a whole number of links from {LEAST_CHAIN} to {GREATEST_CHAIN} is wanted here"
            raise each.error_at(None, f"{told}, not {describe_value(each.value)}")
        links.append(int(number))
    if not links:
        raise cursor.error_at("chains", "numbers of links are wanted here, as [4, 6]")
    return tuple(dict.fromkeys(links))


class NumberNames:
    """The names by which a task's file names numbers of its starts."""

    def __init__(self, starts: Sequence[Mechanism], wanted: Sequence[Wanted]):
        self.starts = tuple(starts)
        self.known = [start_numbers(start, wanted) for start in starts]

    def find(self, cursor: Cursor, name: str) -> tuple[str, ...]:
        """The names of one number of all starts, or of both coordinates of a point."""
        if not self.starts:
            raise cursor.error_at(None, "chains have no numbers yet that could be named; leave this out")
        every = [
            (name,) if name in known else tuple(other for other in known if other.startswith(f"{name}."))
            for known in self.known
        ]
        for start, known, found in zip(self.starts, self.known, every, strict=True):
            if not found:
                told = suggest_name(name, known, "numbers")
                raise cursor.error_at(None, f"{start.name!r} has no number {name!r} of links or pairs{told}")
            if found != every[0]:
                told = f"{name!r} is {' and '.join(found)} in {start.name!r}, but {' and '.join(every[0])} in"
                raise cursor.error_at(None, f"{told} {self.starts[0].name!r}; name what all starts have")
        return every[0]

    def read_free(self, cursor: Cursor) -> tuple[str, ...]:
        """The names of the numbers that are sought, each once."""
        found = tuple(dict.fromkeys(name for each in cursor.items() for name in self.find(each, each.as_text())))
        if not found:
            raise cursor.error_at(None, "no number is free: name some, or leave 'free' out for all")
        return found

    def read_bounds(self, cursor: Cursor, free: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Bounds by name (SI), infinite where there is none; of free numbers alone, where these are named."""
        found: dict[str, tuple[float, float]] = {}
        for name, each in cursor.members():
            names = self.find(each, name)
            fixed = [other for other in names if free and other not in free]
            if fixed:
                raise each.error_at(None, f"{fixed[0]!r} is not among those that are 'free', so it needs no bounds")
            for other in names:
                if other in found:
                    raise each.error_at(None, f"{other!r} has bounds already, under another name")
                found[other] = _read_bound_pair(each, self.known[0][other].kind)
        return found


def _read_bound_pair(cursor: Cursor, kind: str) -> tuple[float, float]:
    def bounds() -> Iterator[float | None]:
        for each in cursor.items():
            if each.value is None:
                yield None
            else:
                yield each.as_number() if kind == "number" else each.as_quantity(kind)

    both = tuple(bounds())
    if len(both) == 2:
        low, high = -inf if both[0] is None else both[0], inf if both[1] is None else both[1]
        if low < high:
            return low, high
    raise cursor.error_at(None, "a lower and an upper bound are wanted here, as [20, 80], the lower first")
