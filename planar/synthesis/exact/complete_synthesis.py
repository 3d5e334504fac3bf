"""What exact synthesis finds: all linkages that meet a task, with what is proved of each and of the whole."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planar.foundation.arrays import Array
from planar.model.wording import count_phrase
from planar.synthesis.synthesis import FamilyCount, Synthesis, SynthesisedDesign


@dataclass(frozen=True, eq=False)
class ExactDesign(SynthesisedDesign):
    """A linkage that meets a task exactly. `certified`: a box of its own is proved to hold it and no other, and its own
    file, read again, meets every entry to round-off in some assembly; defective ones are listed, too, and say so in
    `defects` and `shortages`. `numbers` are those that were sought, by name (SI); links that are `opposite` have a
    negative length, and points in its place. One that `is_far` is nearly at infinity. `file_difference` says how the
    file differs from the solution of the equations, which is no defect of the design; empty where it does not."""

    certified: bool = False
    opposite: tuple[str, ...] = ()
    file_difference: str = ""
    is_far: bool = False

    def __repr__(self) -> str:
        word = "certified" if self.certified else "not certified"
        told = f", {count_phrase(len(self.defects), 'defect')}" if self.defects else ""
        return f"<ExactDesign {self.mechanism.name!r}: {word}{told}>"


@dataclass(frozen=True, eq=False)
class DyadCurve:
    """The dyads that carry a link through poses where these leave `dimension` parameters of them open: 0, 1 or 2.

    `circle_points` (n, 2) are places of the `joint` at the first pose, `centre_points` (n, 2) those of its fixed
    `pivot` (m), not numbers between parts of a curve. Of a dyad with a slide one of both is a line: `joint` or `pivot`
    names the slide, there are no such points, and `directions` (n,) rad is where the line goes at the first pose, on
    which the other's pin lies. Where two parameters are open every place of the pin will do, and none stand here;
    `centres` and `lines` give what goes with it. `rows`: (1, x, y) of the pin times this times (1, x, y) of the pivot,
    (poses - 1, 3, 3), or times (cos, sin) of the line, (poses - 1, 3, 2), vanishes.
    """

    pivot: str
    joint: str
    dimension: int
    circle_points: Array = field(repr=False)
    centre_points: Array = field(repr=False)
    directions: Array = field(repr=False)
    rows: Array = field(repr=False)

    @property
    def has_slide(self) -> bool:
        """Whether one of its pairs is a slide."""
        return bool(self.rows.shape[2] == 2)

    def centres(self, joints: Array) -> Array:
        """The fixed pivots (n, 2) m that go with places of the joint at the first pose (n, 2) m; by least squares where
        these are none of the curve, not numbers where there is a slide."""
        places = np.atleast_2d(np.asarray(joints, float))
        found = np.full(places.shape, np.nan)
        known = np.isfinite(places).all(axis=1)
        if self.has_slide or len(self.rows) < 2:
            return found
        whole = self._rows_at(places[known])
        found[known] = -np.einsum("nij,nj->ni", np.linalg.pinv(whole[:, :, 1:]), whole[:, :, 0])
        return found

    def lines(self, pins: Array) -> Array:
        """The directions (n,) rad of the lines, at the first pose, that go with places of the pin (n, 2) m; by least
        squares where these are none of the curve, not numbers where there is no slide."""
        places = np.atleast_2d(np.asarray(pins, float))
        found = np.full(len(places), np.nan)
        known = np.isfinite(places).all(axis=1)
        if not self.has_slide or not len(self.rows):
            return found
        way = np.linalg.svd(self._rows_at(places[known]))[2][:, -1]
        found[known] = np.arctan2(way[:, 1], way[:, 0])
        return found

    def _rows_at(self, places: Array) -> Array:
        found: Array = np.einsum("na,rab->nrb", np.insert(places, 0, 1.0, axis=1), self.rows)
        return found


@dataclass(frozen=True, eq=False)
class CompleteSynthesis(Synthesis):
    """All real linkages that meet a task, the sound ones first; `len` counts them, each cognate on its own. Where
    numbers stay open there is a `family` of them: `designs` are a sample, the best transmission angle first.

    `expected`: how many complex solutions a random task of this kind has, of the class that `counted` says; None where
    there is a family of them. `complete`: "complete" where it is proved that there are no others, "numerically
    complete" where all paths came to an end and a trace test says that these are all, else how far it is. `found`: how
    many of those expected there are. `curves`: dyads with a parameter. `seed` and `is_finished` are as of a search: a
    list is made whole, without chance.
    """

    expected: int | None = None
    found: int = 0
    complete: str = ""
    counted: str = ""
    curves: tuple[DyadCurve, ...] = ()
    family: FamilyCount | None = None

    @property
    def summary(self) -> tuple[str, ...]:
        """How many there are, how many were to be expected, and what is known of the whole, in sentences."""
        if self.expected is None:
            return (self.complete,)
        real = count_phrase(len(self), "linkage is real", "linkages are real")
        return f"{self.found} of {self.expected} found ({self.counted}); {real}", self.complete

    def __repr__(self) -> str:
        whole = f", {self.expected} expected" if self.expected is not None else ""
        return (
            f"<CompleteSynthesis of {self.task.name!r}: {count_phrase(len(self), 'linkage')}{whole}, {self.complete}>"
        )
