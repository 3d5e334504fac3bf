"""What exact synthesis finds: all linkages that meet a task, with what is proved of each and of the whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from planar.foundation.arrays import Array
from planar.model.wording import count_phrase
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign


@dataclass(frozen=True, eq=False)
class ExactDesign(SynthesisedDesign):
    """A linkage that meets a task exactly. `certified`: a box of its own is proved to hold it and no other; defective
    ones are listed, too, and say so in `defects`."""

    certified: bool = False

    def __repr__(self) -> str:
        word = "certified" if self.certified else "not certified"
        told = f", {count_phrase(len(self.defects), 'defect')}" if self.defects else ""
        return f"<ExactDesign {self.mechanism.name!r}: {word}{told}>"


@dataclass(frozen=True, eq=False)
class DyadCurve:
    """The dyads that carry a link through poses where these leave `dimension` parameters of them open: 0, 1 or 2.

    `circle_points` (n, 2) are places of the `joint` at the first pose, `centre_points` (n, 2) those of its fixed
    `pivot` (m), not numbers between parts of a curve. Where two parameters are open every place of the joint will do,
    and none stand here; `centres` gives the pivots (n, 2) of any places (n, 2) of the joint.
    """

    pivot: str
    joint: str
    dimension: int
    circle_points: Array = field(repr=False)
    centre_points: Array = field(repr=False)
    centres: Callable[[Array], Array] = field(repr=False)


@dataclass(frozen=True, eq=False)
class CompleteSynthesis(Synthesis):
    """All real linkages that meet a task, the sound ones first; `len` counts them, each cognate on its own.

    `expected`: how many complex solutions a random task of this kind has, of the class that `counted` says; None where
    there are curves of them. `complete`: "complete" where it is proved that there are no others, "numerically complete"
    where all paths came to an end and a trace test says that these are all, else how far it is. `found`: how many of
    those expected there are. `curves`: families of solutions with a parameter.
    """

    expected: int | None = None
    found: int = 0
    complete: str = ""
    counted: str = ""
    curves: tuple[DyadCurve, ...] = ()

    def __repr__(self) -> str:
        whole = f", {self.expected} expected" if self.expected is not None else ""
        return (
            f"<CompleteSynthesis of {self.task.name!r}: {count_phrase(len(self), 'linkage')}{whole}, {self.complete}>"
        )
