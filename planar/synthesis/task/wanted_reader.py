"""What a task's file wants, to paths, poses and functions of the mechanisms that it starts from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.document.cursor import Cursor
from planar.document.names import find_motion, find_point, point_aliases
from planar.foundation.arrays import Array
from planar.foundation.errors import suggest_name
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath, WantedPoses
from planar.synthesis.task.task_numbers import motion_kind
from planar.synthesis.task.task_schema import (
    FUNCTION_PAIR_SCHEMA,
    FUNCTION_SCHEMA,
    LEAST_CLOSED,
    PATH_SCHEMA,
    PLACE_SCHEMA,
    POSE_SCHEMA,
    POSES_SCHEMA,
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
        return WantedPath(
            point,
            frozen_array(places),
            _read_timing(cursor["through"], inputs),
            frozen_array(weights),
            (is_closed := self._read_closed(cursor, len(places))) or cursor.flag("in_order"),
            is_closed,
            cursor.flag("absolute"),
            _read_tolerance(cursor, "length"),
            link,
        )

    def _read_closed(self, cursor: Cursor, count: int) -> bool:
        is_closed = cursor.flag("closed")
        if is_closed and count < LEAST_CLOSED:
            raise cursor.error_at("through", f"a closed curve takes {LEAST_CLOSED} places at least, not {count}")
        if is_closed:
            check_turning_input(cursor["closed"], self.starts, "a closed curve takes a whole turn of the input")
        return is_closed

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
    members = next(each.members for each in named_points(start) if each.name == found)
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
    known = [each.name for each in start.links]
    if name not in known:
        raise cursor.error_at(None, f"{start.name!r} has no link {name!r}{suggest_name(name, known, 'links')}")
    if name == start.frame:
        raise cursor.error_at(None, f"{name!r} is the frame and does not move; another link is wanted here")


def _read_timing(cursor: Cursor, inputs: Sequence[float | None]) -> Array | None:
    given = [each is not None for each in inputs]
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
