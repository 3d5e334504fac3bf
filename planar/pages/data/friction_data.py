"""What a page carries of friction: what it does to the links, and what of its pair's force it follows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.contact_rows import ContactRows
from planar.dynamics.reaction_solver import fill_balance
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.model.pairs import Pair
from planar.model.pairs.base import EffortAction, RubbingContact
from planar.model.pairs.rubbing import ContactLoad, LoadLaw
from planar.pages.data.balance_rows import BalanceRows
from planar.results.motion import State


def contact_data(rows: BalanceRows, state: State) -> Iterator[dict[str, Any]]:
    """Every contact with friction: its pair, the rows of what it does to the links and of what drives the pair, and for
    both senses of that rate the rows of the parts that it follows. Pairs that never rub as the file has it are left
    out, as `planar.forces` does."""
    pairs = rows.mechanism.pairs
    if not any(pair.has_friction for pair in pairs):
        return
    still = _still_pairs(state)
    for index, pair in enumerate(pairs):
        if pair.name in still:
            continue
        for rubbing in pair.rubbing_contacts(rows.work.frames, rows.work.shapes, pairs, False):
            drive = pair.effort_action(rows.work.frames, rows.work.shapes)
            yield {
                "pair": index,
                "action": _action_row(rows, rubbing.action),
                "rate": _action_row(rows, drive),
                "length": pair.input_quantity_kinds()[0] == "length",
                "sense": float(rubbing.rate_sense),
                "law": rubbing.law.name.lower(),
                "parts": [_part_rows(rows, pair, rubbing, sense) for sense in (1.0, -1.0)],
            }


def _still_pairs(state: State) -> set[str]:
    """The pairs that move neither now nor next, while others do."""
    field = KinematicArrays(state)
    senses = ContactRows(fill_balance(field, None, inertia=False), field).senses()
    if not any(sense.any() for sense in senses.values()):
        return set()
    return {name for name, sense in senses.items() if not sense.any()}


def _action_row(rows: BalanceRows, way: EffortAction) -> int:
    """The row of a force or couple of one, on its link and the opposite on the other."""
    senses = {way.link: 1.0, way.reaction_link: -1.0}
    return rows.add(rows.work.unit_action_on_links(senses, way.point, way.direction).T)[0]


def _part_rows(rows: BalanceRows, pair: Pair, rubbing: RubbingContact, sense: float) -> list[int]:
    """The rows of the parts of a contact, over what the pair's constraints put on the links, at a sense of its rate."""
    found: list[int] = []
    for load in rubbing.loads:
        row = _load_row(rows, pair, load)
        if rubbing.law is not LoadLaw.GREATEST:
            found += rows.add(row * _factor(load.factor))[:1]
            continue
        opposed = load.factor if load.opposed is None else load.opposed
        along, against = (load.factor, opposed) if sense > 0.0 else (opposed, load.factor)
        found += [rows.add(row * _factor(along))[0], rows.add(-row * _factor(against))[0]]
    return found


def _factor(value: Scalar) -> ca.SX:
    return ca.SX(value)


def _load_row(rows: BalanceRows, pair: Pair, load: ContactLoad) -> ca.SX:
    """A part of the force on a link, over what is on the coordinates of the links (1, coordinates)."""
    columns = rows.work.link_columns
    if load.link in columns:
        return _functional(rows, load.link, load)
    found = ca.SX(1, rows.work.q.numel())
    for link in dict.fromkeys(pair.bodies):
        if link in columns:
            found -= _functional(rows, link, load)
    return found


def _functional(rows: BalanceRows, link: str, load: ContactLoad) -> ca.SX:
    found = ca.SX(1, rows.work.q.numel())
    first, frame = rows.work.link_columns[link], rows.work.frames[link]
    if load.direction is not None:
        found[first], found[first + 1] = load.direction.x, load.direction.y
    elif load.place is not None:
        arm = load.place - Vector(frame.x, frame.y)
        found[first], found[first + 1], found[first + 2] = arm.y, -arm.x, 1.0
    return found
