"""A task's file, or what stands in one, to a SynthesisTask; or BadInput with the place in the file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from planar.document.cursor import Cursor, FileContext, describe_value, suggest_name
from planar.document.dimensions import Dimension, file_dimensions
from planar.document.files import find_model_file, load, parse_json, read_limited
from planar.document.reader import read_mechanism, read_units
from planar.document.schema import FORMAT_VERSION
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.task.starts import with_wanted_points
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    Demands,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)

TASK_KEYS = ("planar", "name", "units", "start", "wanted", "free", "within", "demands")
PATH_KEYS = ("point", "on", "through", "in_order", "closed", "absolute", "tolerance")
POSES_KEYS = ("link", "poses", "in_order", "absolute", "tolerance")
FUNCTION_KEYS = ("from", "to", "pairs", "absolute", "tolerance")
WHOLE_TURN, ONE_BRANCH = "whole turn", "one branch"
LEAST_CHAIN, GREATEST_CHAIN = 4, 12
"""Links of chains to start from."""


TaskSource = Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask
"""A task, what stands in its file, or the file."""


def read_task(source: TaskSource) -> SynthesisTask:
    """The task in a file, or that a JSON value describes. Raises BadInput with the place.

    >>> import planar
    >>> wanted = [{"point": "E", "through": [["0 mm", "0 mm"], ["20 mm", "12 mm"]]}]
    >>> planar.read_task({"planar": 1, "name": "Lid", "start": "four-bar", "wanted": wanted})
    <SynthesisTask 'Lid': 2 wanted entries>
    """
    if not isinstance(source, SynthesisTask | Mapping | str | os.PathLike):
        told = f"{type(source).__name__} {source!r:.60}"
        raise BadInput("task", f"a task's file, or what stands in one, is wanted, not {told}")
    if isinstance(source, SynthesisTask):
        return source
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        if not path.is_file():
            raise BadInput(str(source), "there is no such file; name a task's file (JSON)")
        return _TaskReader(path.parent).read(Cursor(parse_json(read_limited(path), str(path))))
    return _TaskReader(Path()).read(Cursor(dict(source)))


class _TaskReader:
    def __init__(self, folder: Path):
        self.folder = folder
        self.starts: tuple[Mechanism, ...] | ChainStart = ()
        self.wanted: tuple[Wanted, ...] = ()

    def read(self, top: Cursor) -> SynthesisTask:
        top.check_json()
        top.check_keys(*TASK_KEYS)
        version = top["planar"].value
        if version != FORMAT_VERSION or isinstance(version, bool):
            told = f"the format is to be the number {FORMAT_VERSION}, not {describe_value(version)}"
            raise top.error_at("planar", told)
        units = read_units(top)
        top = replace(top, context=FileContext(units))
        self.starts = self._read_starts(top["start"])
        self.wanted = tuple(self._read_wanted(each) for each in top["wanted"].items())
        if not self.wanted:
            raise top.error_at("wanted", "nothing is wanted: give a path, poses, or a function")
        free = tuple(self._find_number(each, each.as_text()) for each in top.list_items("free"))
        return SynthesisTask(
            (top.text("name") or "").strip() or "task",
            self.wanted,
            self.starts,
            tuple(name for names in free for name in names),
            self._read_bounds(top),
            self._read_demands(top),
            units,
        )

    # what there is to start from

    def _read_starts(self, cursor: Cursor) -> tuple[Mechanism, ...] | ChainStart:
        value = cursor.value
        if isinstance(value, dict) and "chains" in value:
            cursor.check_keys("chains")
            links = []
            for each in cursor["chains"].items():
                number = each.as_number()
                if not number.is_integer() or not LEAST_CHAIN <= number <= GREATEST_CHAIN:
                    told = f"a whole number of links from {LEAST_CHAIN} to {GREATEST_CHAIN} is wanted here"
                    raise each.error_at(None, f"{told}, not {describe_value(each.value)}")
                links.append(int(number))
            if not links:
                raise cursor.error_at("chains", "numbers of links are wanted here, as [4, 6]")
            return ChainStart(tuple(dict.fromkeys(links)))
        found = [self._read_start(each) for each in (cursor.items() if isinstance(value, list) else [cursor])]
        if not found:
            raise cursor.error_at(None, "a mechanism to start from is wanted here, or several")
        return tuple(found)

    def _read_start(self, cursor: Cursor) -> Mechanism:
        if isinstance(cursor.value, Mechanism):
            found = cursor.value
        elif isinstance(cursor.value, dict):
            try:
                found = read_mechanism(cursor.value)
            except BadInput as problem:
                raise BadInput(problem.place.replace("$", cursor.path, 1), problem.sentence) from None
        else:
            name = cursor.as_text()
            beside = self.folder / name
            try:
                is_beside = beside.is_file()
            except OSError:
                is_beside = False
            try:
                found = load(beside if is_beside else find_model_file(name))
            except BadInput as problem:
                raise cursor.error_at(None, f"{problem.place}: {problem.sentence}") from None
        if not found.inputs:
            raise cursor.error_at(None, f"{found.name!r} has no input that could run; give it 'inputs'")
        return found

    @property
    def _first(self) -> Mechanism | None:
        return None if isinstance(self.starts, ChainStart) else self.starts[0]

    def _input_kind(self) -> str:
        first = self._first
        if first is None:
            return "angle"
        return _kind_of(relative_motions(first)[first.inputs[0].pair].input_kind)

    # what is wanted

    def _read_wanted(self, cursor: Cursor) -> Wanted:
        if cursor.has("through") or cursor.has("point"):
            return self._read_path(cursor)
        if cursor.has("poses") or cursor.has("link"):
            return self._read_poses(cursor)
        if cursor.has("pairs") or cursor.has("from"):
            return self._read_function(cursor)
        told = "'point' with 'through', 'link' with 'poses', or 'from', 'to' and 'pairs' are wanted here"
        raise cursor.error_at(None, told)

    def _read_path(self, cursor: Cursor) -> WantedPath:
        cursor.check_keys(*PATH_KEYS)
        point, link = cursor.name("point"), cursor.text("on")
        self._check_point(cursor, point, link)
        entries = [self._read_place(each) for each in cursor["through"].items()]
        if not entries:
            raise cursor.error_at("through", "places are wanted here, as [[0, 25], [52, 10]]")
        places, inputs, weights = zip(*entries, strict=True)
        is_closed = cursor.flag("closed")
        if is_closed and len(places) < 4:
            raise cursor.error_at("through", f"a closed curve takes four places at least, not {len(places)}")
        return WantedPath(
            point,
            _frozen(places),
            self._read_timing(cursor["through"], inputs),
            _frozen(weights),
            cursor.flag("in_order") or is_closed,
            is_closed,
            cursor.flag("absolute"),
            cursor["tolerance"].as_positive("length") if cursor.has("tolerance") else None,
            link,
        )

    def _read_place(self, cursor: Cursor) -> tuple[tuple[float, float], float | None, float]:
        if isinstance(cursor.value, list):
            return cursor.as_vector("length"), None, 1.0
        cursor.check_keys("at", "input", "weight")
        return cursor["at"].as_vector("length"), self._read_input(cursor), _read_weight(cursor)

    def _read_input(self, cursor: Cursor) -> float | None:
        return cursor["input"].as_quantity(self._input_kind()) if cursor.has("input") else None

    def _read_poses(self, cursor: Cursor) -> WantedPoses:
        cursor.check_keys(*POSES_KEYS)
        link = cursor.name("link")
        if self._first is not None:
            known = [each.name for each in self._first.links]
            if link not in known:
                raise cursor.error_at("link", f"there is no link {link!r}{suggest_name(link, known, 'links')}")
        places, angles, inputs, weights = [], [], [], []
        for each in cursor["poses"].items():
            each.check_keys("at", "angle", "input", "weight")
            places.append(each["at"].as_vector("length"))
            angles.append(each.quantity("angle", "angle"))
            inputs.append(self._read_input(each))
            weights.append(_read_weight(each))
        if not places:
            raise cursor.error_at("poses", "poses are wanted here, as [{'at': [0, 1], 'angle': 10}]")
        return WantedPoses(
            link,
            _frozen(places),
            _frozen(np.unwrap(angles)),
            self._read_timing(cursor["poses"], inputs),
            _frozen(weights),
            cursor.flag("in_order"),
            cursor.flag("absolute"),
            cursor["tolerance"].as_positive("length") if cursor.has("tolerance") else None,
        )

    def _read_function(self, cursor: Cursor) -> WantedFunction:
        cursor.check_keys(*FUNCTION_KEYS)
        names = cursor.name("from"), cursor.name("to")
        kinds = [self._pair_kind(cursor, key, name) for key, name in zip(("from", "to"), names, strict=True)]
        first = self._first
        if first is not None and names[0] != first.inputs[0].pair:
            raise cursor.error_at("from", f"the input that runs is {first.inputs[0].pair!r}; a function is of that one")
        rows = []
        for each in cursor["pairs"].items():
            both = tuple(each.items())
            if len(both) != 2:
                raise each.error_at(None, f"two numbers [input, output] are wanted here, not {len(both)}")
            rows.append([one.as_quantity(kind) for one, kind in zip(both, kinds, strict=True)])
        if not rows:
            raise cursor.error_at("pairs", "pairs of positions are wanted here, as [[0, 0], [20, 31]]")
        found = np.array(rows)
        return WantedFunction(
            *names,
            _frozen(found[:, 0]),
            _frozen(found[:, 1]),
            _frozen(np.ones(len(found))),
            cursor.flag("absolute"),
            cursor["tolerance"].as_positive(kinds[1]) if cursor.has("tolerance") else None,
        )

    def _pair_kind(self, cursor: Cursor, key: str, name: str) -> str:
        first = self._first
        if first is None:
            return "angle"
        motions = relative_motions(first)
        if name not in motions:
            raise cursor.error_at(key, f"there is no pair {name!r}{suggest_name(name, motions, 'pairs')}")
        kind = motions[name].input_kind
        if kind is None:
            raise cursor.error_at(key, f"{name!r} has no position of its own that could be a function")
        return _kind_of(kind)

    def _read_timing(self, cursor: Cursor, inputs: Any) -> Array | None:
        given = [each is not None for each in inputs]
        if not any(given):
            return None
        if not all(given):
            missing = given.index(False)
            raise cursor.error_at(None, f"'input' is given for some; entry {missing + 1} lacks it")
        return _frozen(inputs)

    def _check_point(self, cursor: Cursor, point: str, link: str | None) -> None:
        first = self._first
        if first is None:
            return
        links = [each.name for each in first.links]
        if link is not None and link not in links:
            raise cursor.error_at("on", f"there is no link {link!r}{suggest_name(link, links, 'links')}")
        known = [each.name for each in named_points(first)]
        if link is None and point not in known:
            told = suggest_name(point, known, "points")
            raise cursor.error_at(
                "point", f"{first.name!r} has no point {point!r}{told}; 'on' names a link for a new one"
            )

    # what may change, and what must be kept

    def _find_number(self, cursor: Cursor, name: str) -> tuple[str, ...]:
        """The names of one number, or of both coordinates of a point."""
        first = self._first
        if first is None:
            raise cursor.error_at(None, "chains have no numbers yet that could be named; leave this out")
        known = self._numbers(first)
        if name in known:
            return (name,)
        both = tuple(key for key in known if key.startswith(f"{name}."))
        if both:
            return both
        raise cursor.error_at(None, f"there is no number {name!r}{suggest_name(name, known, 'numbers')}")

    def _numbers(self, first: Mechanism) -> dict[str, Dimension]:
        """The numbers of links and pairs by name, those of wanted points as coordinates."""
        paths = tuple(each for each in self.wanted if isinstance(each, WantedPath))
        ready = with_wanted_points(first, SynthesisTask("", paths, (first,)), {})
        points = {each.point for each in paths}
        own = {each.name: each.members for each in named_points(ready)}
        wanted = tuple(f"{link}.{point}." for name in points for link, point in own.get(name, ()))
        found = {key: each for key, each in file_dimensions(first).items() if not key.startswith(wanted)}
        found |= {key: each for key, each in file_dimensions(ready).items() if key.startswith(wanted)}
        return {key: each for key, each in found.items() if each.path[0] in ("links", "pairs")}

    def _read_bounds(self, top: Cursor) -> dict[str, tuple[float, float]]:
        found: dict[str, tuple[float, float]] = {}
        if not top.has("within"):
            return found
        for name, cursor in top.object_at("within").members():
            names = self._find_number(cursor, name)
            first = self._first
            assert first is not None
            kind = self._numbers(first)[names[0]].kind
            both = tuple(each.as_number() if kind == "number" else each.as_quantity(kind) for each in cursor.items())
            if len(both) != 2 or not both[0] < both[1]:
                raise cursor.error_at(None, "a lower and an upper bound are wanted here, as [20, 80], the lower first")
            found |= dict.fromkeys(names, both)
        return found

    def _read_demands(self, top: Cursor) -> Demands:
        demands = Demands()
        for each in top.list_items("demands"):
            if isinstance(each.value, str):
                word = each.as_choice((WHOLE_TURN, ONE_BRANCH))
                is_turn = word == WHOLE_TURN
                demands = demands._replace(whole_turn=True) if is_turn else demands._replace(one_branch=True)
                continue
            each.check_keys("transmission", "inside")
            if not each.fields():
                raise each.error_at(None, "a demand is wanted here: 'whole turn', 'transmission' or 'inside'")
            if each.has("transmission"):
                angle = each["transmission"].as_positive("angle")
                if not angle < pi / 2:
                    raise each.error_at("transmission", "a transmission angle is less than a right angle")
                demands = demands._replace(transmission=angle)
            if each.has("inside"):
                demands = demands._replace(inside=self._read_region(each["inside"]))
        return demands

    def _read_region(self, cursor: Cursor) -> Array:
        corners = np.array([each.as_vector("length") for each in cursor.items()])
        if len(corners) < 2:
            raise cursor.error_at(None, "two opposite corners of a rectangle are wanted here, or a polygon's corners")
        if len(corners) == 2:
            (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
            corners = np.array([[left, low], [right, low], [right, high], [left, high]])
        x, y = corners.T
        area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        if not area > 0.0:
            raise cursor.error_at(None, "there is nothing inside: the corners lie on one line")
        return _frozen(corners)


def _kind_of(kind: MeasureKind | None) -> str:
    return "length" if kind is MeasureKind.LENGTH else "angle"


def _read_weight(cursor: Cursor) -> float:
    if not cursor.has("weight"):
        return 1.0
    found = cursor["weight"].as_number()
    if not found > 0.0:
        raise cursor.error_at("weight", f"a weight above zero is wanted here, not {cursor['weight'].value!r}")
    return found


def _frozen(values: Any) -> Array:
    found = np.array(values, float)
    found.flags.writeable = False
    return found
