"""Kinds of groups with the formulas by which they are solved, derived once each."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from itertools import product
from typing import NamedTuple

from planar.batch.mechanisms.block_formulas import Derivation
from planar.batch.mechanisms.block_type import STATISTICS, Signature, Structure
from planar.codegen.block_formula import Formula
from planar.codegen.instructions import NotPrinted
from planar.model.pairs import Pair

SIGNS = 2
"""Signs of a kind in closed form at most."""
MOST = 1024
"""Kinds that are kept."""


class Kind(Structure):
    """One kind of groups with its formulas: `direct` ones are in closed form, Newton's method follows others."""

    def __init__(self, signature: Signature, likes: Sequence[Pair]):
        super().__init__(signature, likes)
        self.direct = self.square and self.signs <= SIGNS and all(each is not None for each in self.closed)
        if self.direct:
            try:
                self.start, self.run(False)
            except NotPrinted:
                self.direct = False
        self.followed = False
        "whether Newton's method can follow it, where it is not in closed form"
        if self.square and not self.direct:
            with suppress(NotPrinted):
                self.followed = self.near is not None

    @property
    def start(self) -> Formula:
        """(given links and inputs, numbers with statistics) -> for each way to assemble the group its inner
        links' x, y, cos and sin, then what is left open, how far from where two ways meet, and the distance."""
        if self._start is None:
            work = Derivation(self)
            first = len(self.measures) + 2 * len(self.angles)
            stats = [
                [work.leaf("p", first + STATISTICS * k + i) for i in range(STATISTICS)] for k in range(len(self.inner))
            ]
            wanted: list[int] = []
            for signs in product((1.0, -1.0), repeat=self.signs):
                way = work.assembled([work.listing.const(sign) for sign in signs])
                poses = work.poses(way)
                wanted += [each for pose in poses for each in pose]
                wanted += work.judged(way, work.gaps(way, poses))
                wanted.append(work.distance(poses, stats))
            self._start = work.formula(wanted)
        return self._start

    _start: Formula | None = None

    @property
    def near(self) -> Near:
        """The formulas by which Newton's method follows a kind that is not in closed form. Raises NotPrinted."""
        if self._near is None:
            self._near = Near(*(Derivation(self).followed(what) for what in (None, False, True)))
        return self._near

    _near: Near | None = None

    def run(self, rates: bool, polished: bool = False) -> Formula:
        """(given links and inputs, numbers) -> rows of the inner links, then what is left open, and how far from where
        two ways to assemble it meet."""
        if (rates, polished) not in self._run:
            work = Derivation(self)
            signs = [work.leaf("p", len(self.measures) + 2 * len(self.angles) + k) for k in range(self.signs)]
            way = work.assembled(signs, polished)
            poses = rows = work.poses(way)
            if rates:
                rows = [[*pose, *more] for pose, more in zip(poses, work.rates(way), strict=True)]
            wanted = [each for pose in rows for each in pose]
            self._run[rates, polished] = work.formula([*wanted, *work.judged(way, work.gaps(way, poses))])
        return self._run[rates, polished]

    @property
    def _run(self) -> dict[tuple[bool, bool], Formula]:
        return self.__dict__.setdefault("_runs", {})


@lru_cache(maxsize=MOST)
def kind(signature: Signature) -> Kind:
    """The kind of a signature; equal ones are one."""
    return Kind(signature, [_like(joint.type) for joint in signature.joints])


@lru_cache
def _like(type_: type[Pair]) -> Pair:
    return type_.samples()[0].pair


class Near(NamedTuple):
    """(given links and inputs, numbers, unknowns: the cosine and sine of angles, or a length and nothing) -> `step`: by
    how much Newton's method goes back, and the square of how regular the slope is; `told` and `moving`: rows of the
    inner links, without and with rates, and what is left open."""

    step: Formula
    told: Formula
    moving: Formula
