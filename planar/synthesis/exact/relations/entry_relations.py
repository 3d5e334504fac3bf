"""The rows that one entry of what is wanted puts on a mechanism, from the formulas of its own pairs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.geometry import Frame
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.exact.relations.elimination import EntryRows, eliminate
from planar.synthesis.exact.relations.polynomials import AngleSum, Polynomial, Symbol, as_polynomial, point
from planar.synthesis.exact.relations.reference_pose import WORLD, ReferencePose
from planar.synthesis.exact.relations.unknowns import NumberKind, refuse
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath, WantedPoses

PARALLEL = 1e-9
"""rad: by how much the angles of poses may differ that are parallel."""


class EntryNumber(NamedTuple):
    """A number that an entry gives."""

    symbol: Symbol
    kind: NumberKind


class MovingLink(NamedTuple):
    """A link at an entry: where it has gone, and how it has turned, from the first."""

    translation: Polynomial
    turn: Polynomial


class EntryRelations(NamedTuple):
    """The rows of every entry of a wanted item, and the numbers that each gives: places, turns and slides from those
    of the first entry. `links` and `slides` say where all is at an entry, by the symbols of `rows.steps`."""

    numbers: tuple[EntryNumber, ...]
    rows: EntryRows
    links: dict[str, MovingLink]
    slides: dict[str, Polynomial]


def entry_relations(
    pose: ReferencePose, wanted: Wanted, place: Polynomial | None, axes_origin: Polynomial | None
) -> EntryRelations:
    """The rows of a wanted item; `place` is that of its point at the first entry, `axes_origin` that of its link."""
    return _EntryBuilder(pose).build(wanted, place, axes_origin)


class _EntryBuilder:
    def __init__(self, pose: ReferencePose):
        self.pose, self.table = pose, pose.table
        self.numbers: list[EntryNumber] = []
        self.moving = [each.name for each in pose.mechanism.links if each.name != pose.mechanism.frame]
        self.turn_of = self._tied_turns()
        self.turns: dict[str, Polynomial] = {}
        self.open_turns: list[Symbol] = []
        self.slides: dict[str, Polynomial] = {}

    def _tied_turns(self) -> dict[str, str]:
        """Of every link the one whose turn it shares; the frame where it does not turn."""
        found = {name: name for name in (*self.moving, self.pose.mechanism.frame)}
        frames = {name: WORLD._replace(angle=AngleSum({name: 1}), fixed=False) for name in self.moving}
        frames[self.pose.mechanism.frame] = WORLD
        for pair in self.pose.pairs:
            own = [Polynomial({})] if pair.coordinate_kinds else []
            for turns in self.pose.pair_rows(pair, frames, own)[1]:
                names = [*turns.links]
                if sorted(turns.links.values()) not in ([-1, 1], [-1], [1]) or len(names) > 2:
                    raise refuse(f"{pair.name!r} ties angles otherwise than one to one")
                one, other = (found[name] for name in (*names, self.pose.mechanism.frame)[:2])
                keep, lose = (one, other) if one == self.pose.mechanism.frame else (other, one)
                found = {name: keep if each == lose else each for name, each in found.items()}
        return found

    def _number(self, kind: NumberKind) -> Polynomial:
        each = EntryNumber(self.table.add(), kind)
        self.numbers.append(each)
        return each.symbol.value

    def build(self, wanted: Wanted, place: Polynomial | None, origin: Polynomial | None) -> EntryRelations:
        """The rows where what the item gives is known."""
        rows: list[Polynomial] = []
        links: dict[str, MovingLink] = {}
        self.turns[self.pose.mechanism.frame] = as_polynomial(1.0)
        if isinstance(wanted, WantedFunction):
            self._know(wanted.from_pair)
            self._know(wanted.to_pair)
        elif isinstance(wanted, WantedPath):
            at = self._number(NumberKind.PLACE)
        else:
            at = self._number(NumberKind.PLACE)
            self._know_pose_turn(wanted)
        if not isinstance(wanted, WantedFunction) and wanted.inputs is not None:
            self._know(self.pose.mechanism.inputs[0].pair)
        translations: list[Symbol] = []
        for name in self.moving:
            moved = self.table.add()
            links[name] = MovingLink(moved.value, self._turn(name))
            translations.append(moved)
        if isinstance(wanted, WantedPath):
            assert place is not None and wanted.link is not None
            own = links[wanted.link]
            rows.append(own.translation + own.turn * place - at)
        elif not isinstance(wanted, WantedFunction):
            assert origin is not None
            turn = links[wanted.link].turn
            gone = translations.pop(self.moving.index(wanted.link))
            del gone
            links[wanted.link] = MovingLink(at - turn * origin, turn)
        open_slides = self._open_slides()
        frames = {name: _frame(links[name], name) for name in self.moving} | {self.pose.mechanism.frame: WORLD}
        for pair in self.pose.pairs:
            slide = [self.slides[pair.name]] if pair.coordinate_kinds else []
            rows += self.pose.pair_rows(pair, frames, slide)[0]
        real = {each.conjugate: each.value for each in open_slides}
        rows = [row.substitute(self.pose.values).substitute(real) for row in rows]
        found = eliminate(rows, translations, open_slides, self.open_turns)
        return EntryRelations(tuple(self.numbers), found, links, self.slides)

    def _turn(self, link: str) -> Polynomial:
        of = self.turn_of[link]
        if of not in self.turns:
            made = self.table.add()
            self.open_turns.append(made)
            self.turns[of] = made.value
        return self.turns[of]

    def _know_turn(self, link: str) -> None:
        of = self.turn_of[link]
        if of in self.turns:
            raise refuse(f"how {link!r} turns is given twice")
        self.turns[of] = self._number(NumberKind.TURN)

    def _know_pose_turn(self, wanted: WantedPoses) -> None:
        """The turn of a link that takes poses, which it must have."""
        name = wanted.link
        if self.turn_of[name] != self.pose.mechanism.frame:
            self._know_turn(name)
        elif np.ptp(wanted.angles) > PARALLEL:
            raise refuse(f"{name!r} slides on what does not turn, so that it takes parallel poses alone")
        else:
            raise refuse(f"{name!r} does not turn, and takes parallel poses whatever two directions it slides along")

    def _know(self, name: str) -> None:
        """The position of a pair is given, from that at the first entry."""
        pair = relative_motions(self.pose.mechanism)[name]
        if pair.input_kind is MeasureKind.LENGTH:
            made = EntryNumber(self.table.add(), NumberKind.LENGTH)
            self.numbers.append(made)
            self.slides[name] = made.symbol.value
            return
        self._know_turn(turned_link(self.pose, name))

    def _open_slides(self) -> list[Symbol]:
        found = []
        for pair in self.pose.pairs:
            if pair.coordinate_kinds and pair.name not in self.slides:
                found.append(self.table.add())
                self.slides[pair.name] = found[-1].value
        return found


def turned_link(pose: ReferencePose, name: str) -> str:
    """The link whose turn is the position of a pair with the frame."""
    pair = relative_motions(pose.mechanism)[name]
    frames = {each.name: WORLD._replace(angle=AngleSum({each.name: 1}), fixed=False) for each in pose.mechanism.links}
    frames[pose.mechanism.frame] = WORLD
    turns = pair.input_position([frames[link] for link in pair.bodies], (), ())
    if not isinstance(turns, AngleSum) or [*turns.links.values()] != [1]:
        raise refuse(f"the position of {name!r} is no angle from the frame")
    return next(iter(turns.links))


def _frame(link: MovingLink, name: str) -> Frame:
    origin, way = point(link.translation), point(link.turn)
    return Frame(origin.x, origin.y, way.x, way.y, AngleSum({name: 1}))
