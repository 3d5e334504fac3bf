"""Random linkages of dyads, each with a structure of its own: as data, as mechanisms, and solved in closed form."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.limit import Tape
from benchmarks.linkages.base import ALPHA, OMEGA
from benchmarks.swept.base import Moving, crank_pin, dyad_pin, rows

Array = np.ndarray

FRAME, CRANK, DYAD, CARRIED = 0, 1, 2, 3
FEWEST, MOST = 5, 20
"""Joints of a linkage."""
STOPS = 0.2
"""The part of the linkages whose last dyad is made not to go all round, where the linkage allows that."""
FLAT = 0.15
"""The sine of the angle in a dyad, below which one that goes round is not taken: no other solver is to be told off."""
ON_FRAME, TRIES = 0.35, 40
"""How often a dyad is pinned to the frame, and how often its place is drawn before others are tried."""
CHECKED = 400
"""Steps of a turn at which a dyad that is drawn is looked at."""


@lru_cache(maxsize=2)
def random_tape(many: int, stops: bool) -> Tape:
    """So many random linkages, the same ones each time; some of which stop, or none."""
    rng = np.random.default_rng(7)
    sizes = rng.integers(FEWEST, MOST + 1, many)
    stopping = (rng.random(many) < STOPS) & stops
    return together([_linkage(rng, int(size), bool(stops)) for size, stops in zip(sizes, stopping, strict=True)])


def together(linkages: list[tuple[list[int], list[tuple[int, int]], list[tuple[float, float, float]]]]) -> Tape:
    """Linkages (kind, of, size) as one tape."""
    kind, of, size = (np.concatenate([np.array(each[k]) for each in linkages]) for k in range(3))
    first = np.cumsum([0, *(len(each[0]) for each in linkages)])
    return Tape(first, kind, of, np.ascontiguousarray(size, dtype=float))


class _Growing:
    """A linkage to which joints are added, each of which goes round with the crank."""

    def __init__(self, rng: np.random.Generator):
        self.rng = rng
        turned = 2.0 * np.pi * np.linspace(0.0, 1.0, CHECKED + 1)
        start, radius = rng.uniform(-np.pi, np.pi), rng.uniform(0.15, 0.3)
        self.kind, self.of = [FRAME, CRANK], [(0, 0), (0, 0)]
        self.size = [(0.0, 0.0, 0.0), (radius, np.cos(start), np.sin(start))]
        self.at = [np.zeros((2, CHECKED + 1)), radius * np.stack([np.cos(start + turned), np.sin(start + turned)])]

    def on_frame(self) -> int:
        """A new joint on the frame."""
        place = self.rng.uniform(-1.2, 1.2, 2)
        self.kind.append(FRAME)
        self.of.append((0, 0))
        self.size.append((*place, 0.0))
        self.at.append(np.repeat(place[:, None], CHECKED + 1, axis=1))
        return len(self.kind) - 1

    def join(self, p: int, q: int) -> bool:
        """Whether a new joint beside two could be drawn that goes round."""
        place = self.rng.uniform(-1.2, 1.2, 2)
        own = place - self.at[p][:, 0]
        b, c = np.hypot(*own), np.hypot(*(place - self.at[q][:, 0]))
        e = self.at[q] - self.at[p]
        square = (e * e).sum(axis=0)
        cosine = np.abs(b * b + c * c - square) / (2.0 * b * c)
        if np.any(cosine > np.sqrt(1.0 - FLAT**2)):
            return False
        side = float(np.sign(e[0, 0] * own[1] - e[1, 0] * own[0]))
        along = (b * b - c * c + square) / (2.0 * square)
        with np.errstate(invalid="ignore"):
            across = side * np.sqrt(b * b / square - along * along)
        self.at.append(self.at[p] + along * e + across * np.stack([-e[1], e[0]]))
        self.kind.append(DYAD)
        self.of.append((p, q))
        self.size.append((b * b, c * c, side))
        return True


def _linkage(rng: np.random.Generator, joints: int, stops: bool) -> tuple[list, list, list]:
    """A crank, then dyads between two joints that move, or one that moves and the frame."""
    while True:
        grown = _Growing(rng)
        _grow(grown, rng, joints)
        if len(grown.kind) == joints:
            break
    far = np.hypot(*np.subtract(*(grown.at[each] for each in grown.of[-1])))
    if stops and far.max() > 1.02 * far[0]:
        # the last dyad is stretched half way to where its ends are farthest apart
        half = 0.25 * (far[0] + far.max())
        grown.size[-1] = (half**2, half**2, grown.size[-1][2])
    return grown.kind, grown.of, grown.size


def _grow(grown: _Growing, rng: np.random.Generator, joints: int) -> None:
    """Add joints, as many as wanted unless a place for them is not found."""
    for _ in range(4 * joints):
        if len(grown.kind) >= joints:
            return
        moving = [joint for joint, kind in enumerate(grown.kind) if kind != FRAME]
        fixed = len(moving) == 1 or (rng.random() < ON_FRAME and len(grown.kind) + 2 <= joints)
        p = int(rng.choice(moving))
        q = grown.on_frame() if fixed else int(rng.choice([each for each in moving if each != p]))
        if not any(grown.join(p, q) for _ in range(TRIES)) and fixed:
            for each in (grown.kind, grown.of, grown.size, grown.at):
                each.pop()


def sketch(tape: Tape, linkage: int) -> Array:
    """Where the joints are at the start (joints, 2), m."""
    return closed_form(tape, np.zeros(1), linkage, rates=False)[:, :, 0]


def closed_form(tape: Tape, turned: Array, linkage: int, rates: bool = True) -> Array:
    """Rows (joints, 2 or 6, steps) of the joints of one linkage in the arithmetic of the angles (steps,)."""
    part = slice(tape.first[linkage], tape.first[linkage + 1])
    found: list[Moving] = []
    none = 0.0 * turned
    for kind, (p, q), (a, b, c) in zip(
        tape.kind[part], tape.of[part], tape.size[part].astype(turned.dtype), strict=True
    ):
        if kind == FRAME:
            found.append(Moving((a + none, b + none), (none, none), (none, none)))
        elif kind == CRANK:
            # the angles are those by which the crank has turned on
            moved, (x, y) = crank_pin(a, turned + np.arctan2(c, b)), found[p].p
            found.append(Moving((x + moved.p[0], y + moved.p[1]), moved.v, moved.a))
        elif kind == CARRIED:
            found.append(Moving(*(_carry(*each, a, b) for each in zip(found[p], found[q], strict=True))))
        else:
            first, second = (p, q) if c > 0 else (q, p)
            lengths = (np.sqrt(a), np.sqrt(b)) if c > 0 else (np.sqrt(b), np.sqrt(a))
            found.append(dyad_pin(found[first], found[second], *lengths))
    return np.stack([rows(each) for each in found])[:, : 6 if rates else 2]


def _carry(p: tuple[Array, Array], q: tuple[Array, Array], a: float, b: float) -> tuple[Array, Array]:
    """A point on the link through two others, or its rate."""
    x, y = q[0] - p[0], q[1] - p[1]
    return p[0] + a * x - b * y, p[1] + a * y + b * x


def moving(tape: Tape) -> Array:
    """Which joints move (joints,)."""
    return tape.kind != FRAME


def mechanisms(tape: Tape, places: list[Array]) -> list[Any]:
    """Every linkage as a mechanism of planar."""
    import planar

    found = []
    for k, at in enumerate(places):
        part = slice(tape.first[k], tape.first[k + 1])
        kinds, of = tape.kind[part].tolist(), tape.of[part].tolist()
        bars, fixed = [], []
        for joint, (kind, (p, q)) in enumerate(zip(kinds, of, strict=True)):
            if kind == FRAME:
                fixed.append(joint)
            elif kind == CRANK:
                bars.append((p, joint))
            else:
                bars += [(p, joint), (q, joint)]
        found.append(planar.pinned(at, bars, fixed, 0, velocity=OMEGA, acceleration=ALPHA))
    return found


def linkages(tape: Tape, places: Array) -> Any:
    """The same from arrays at once; places (joints, 2) of all linkages one after the other."""
    import planar

    counts = np.diff(tape.first)
    many, longest = len(counts), int(counts.max())
    owner = np.repeat(np.arange(many), counts)
    joint = np.arange(len(owner)) - tape.first[owner]
    at = np.full((many, longest, 2), np.nan)
    at[owner, joint] = places
    fixed = tape.kind == FRAME
    # the crank's bar, or the two of a dyad
    bar_counts = np.where(fixed, 0, np.where(tape.kind == CRANK, 1, 2))
    of = np.repeat(np.arange(len(owner)), bar_counts)
    second = np.concatenate([[False], of[1:] == of[:-1]])
    bars = np.stack([np.where(second, tape.of[of, 1], tape.of[of, 0]), joint[of]], axis=1)
    return planar.pinned_linkages(
        at,
        _pad(bars, owner[of], many),
        _pad(joint[fixed], owner[fixed], many),
        velocity=OMEGA,
        acceleration=ALPHA,
    )


def _pad(values: Array, owner: Array, many: int) -> Array:
    """Rows of several owners, one owner after the other, with an entry for each owner; -1 where one has fewer."""
    counts = np.bincount(owner, minlength=many)
    found = np.full((many, counts.max(), *values.shape[1:]), -1)
    found[owner, np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]] = values
    return found
