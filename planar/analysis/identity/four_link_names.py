"""The names of a loop of four links, by the kinds of its pairs, its dimensions, and which of its links is fixed."""

from __future__ import annotations

from planar.analysis.identity.kinematic_scheme import LENGTH_TOLERANCE, KinematicLoop, LoopLink
from planar.foundation.geometry import Vector

EITHER_PARALLELOGRAM = "parallelogram or antiparallelogram"
"""Dimensions do not tell which of the two it is, its position does."""
QUICK_RETURNS = frozenset({"Whitworth quick return", "crank and slotted lever"})

_GRASHOF = (
    ("double-crank", "drag link"),
    ("crank-rocker",),
    ("Grashof double-rocker",),
    ("crank-rocker",),
)
"""By how many links after the fixed one the shortest link comes."""
_INVERSIONS = {
    (True, "crank"): ("slider-crank", "{line} slider-crank"),
    (True, "isosceles"): ("slider-crank", "isosceles slider-crank"),
    (True, "swings"): ("fixed-slider inversion", "pendulum pump"),
    (True, "neither"): ("rocker-slider",),
    (False, "crank"): ("inverted slider-crank", "quick return", "Whitworth quick return"),
    (False, "isosceles"): ("inverted slider-crank", "isosceles inverted slider-crank"),
    (False, "swings"): ("inverted slider-crank", "quick return", "crank and slotted lever", "oscillating cylinder"),
    (False, "neither"): ("inverted slider-crank",),
}
"""Of the slider-crank chain: whether a sliding link is fixed, and how the two-pin link r moves against the other."""
_DOUBLE_SLIDER = {
    "PP": ("elliptical trammel",),
    "PR": ("Scotch yoke", "cosine (sine) mechanism"),
    "RR": ("Oldham coupling",),
}
"""By the kinds of the fixed link's pairs."""


def four_link_names(loop: KinematicLoop) -> tuple[str, ...]:
    """The names of a ring of four links, from the general to the particular.

    The chain is told by its pairs in their order round the ring, R turning and P sliding; its inversion by which
    link is fixed (F. Reuleaux, The Kinematics of Machinery, 1876). RPRP is the same whichever link is fixed.
    """
    word = "".join("P" if joint.slides else "R" for joint in loop.joints)
    if "PP" in word + word[0] and word.count("P") == 2:
        return _double_slider_names(loop, word)
    if word in ("RPRP", "PRPR"):
        return ("Rapson's slide", "tangent mechanism")
    return {0: _four_bar_names, 1: _slider_crank_names}.get(word.count("P"), lambda _: ())(loop)


def _four_bar_names(loop: KinematicLoop) -> tuple[str, ...]:
    """RRRR, by F. Grashof's rule (Theoretische Maschinenlehre, 1883): s + l against p + q.

    Less: the shortest link s turns fully against the others, so fixed it makes a double-crank (drag link), next to
    the fixed link a crank-rocker, opposite to it a double-rocker. More: no link turns fully, a triple-rocker
    (C. Barker, Mechanism and Machine Theory 20, 1985). As much: a change-point linkage, whose links can come into
    one line: all equal a rhombus, opposite ones equal a parallelogram or, crossed, an antiparallelogram, adjacent
    ones equal a kite; any other is called as Grashof's with the same shortest link.
    """
    chain: tuple[str, ...] = ("four-bar chain",)
    lengths = [side.length for side in loop.links]
    s, p, q, l = sorted(lengths)  # noqa: E741 - the letters of Grashof's rule
    size = s + p + q + l
    if s <= LENGTH_TOLERANCE * size or l > (0.5 + LENGTH_TOLERANCE) * size:
        return chain
    kind = _GRASHOF[lengths.index(s)]
    if abs(s + l - p - q) > LENGTH_TOLERANCE * size:
        return chain + (kind if s + l < p + q else ("triple-rocker",))
    chain = (*chain, "change-point four-bar")
    a, b, c, d = lengths
    near = LENGTH_TOLERANCE * size
    if l - s <= near:
        return (*chain, "rhombus")
    if abs(a - c) <= near and abs(b - d) <= near:
        return (*chain, EITHER_PARALLELOGRAM)
    if p - s <= near:
        return (*chain, "kite (deltoid)")
    return (*chain, f"change-point {kind[0].removeprefix('Grashof ')}")


def _slider_crank_names(loop: KinematicLoop) -> tuple[str, ...]:
    """RRRP: two links with two pins each, r and s long, and two links that slide on each other with a pin each.

    Slide and block are alike to kinematics, whichever of them carries the line. What tells the inversions apart is
    which of the two-pin links is the shorter, the crank. The offset e is the distance of the one sliding link's pin
    from the line that the other's pin runs along.

    - A sliding link fixed, r pinned to it. r + e <= s: r is a crank, slider-crank. s + e <= r: r swings, and what
      stands still is the block, pendulum pump (hand pump, Bull engine). Else no link turns fully: rocker-slider.
    - A two-pin link fixed, r. r + e <= s: the slotted link turns fully, Whitworth (also the rotary engine).
      s + e <= r: it swings, crank and slotted lever; with a piston rod for the block, oscillating cylinder.
    - r = s and e = 0: isosceles.

    F. Reuleaux, The Kinematics of Machinery, 1876; S. Rattan and R. Khurmi, each Theory of Machines, on the inversions
    of the single slider-crank chain.
    """
    chain = ("slider-crank chain",)
    at = next(index for index, joint in enumerate(loop.joints) if joint.slides)
    x, y, beside_y, beside_x = (loop.links[(at + step) % 4] for step in range(4))
    fixed = loop.links[0]
    mine, other = (beside_x, beside_y) if fixed in (x, beside_x) else (beside_y, beside_x)
    r, s = mine.length, other.length
    near = LENGTH_TOLERANCE * (r + s)
    e = abs(_offset_from_line(x.before.point, x) - _offset_from_line(y.after.point, y))
    if min(r, s) <= near or r + s < e:
        return chain
    cases = {
        "isosceles": abs(r - s) <= near and e <= near,
        "crank": r + e <= s + near,
        "swings": s + e <= r + near,
        "neither": True,
    }
    case = next(case for case, holds in cases.items() if holds)
    line = "in-line" if e <= near else "offset"
    return chain + tuple(name.format(line=line) for name in _INVERSIONS[fixed in (x, y), case])


def _double_slider_names(loop: KinematicLoop, word: str) -> tuple[str, ...]:
    """RRPP: the link with two slides fixed, elliptical trammel; one with a slide and a pin, Scotch yoke; the one
    with two pins, Oldham coupling (S. Rattan, Theory of Machines); the cosine mechanism: Machine Elements, 1.3.5 (iii).

    Where the two slides are parallel nothing turns, and the field has no name for it.
    """
    chain = ("double slider-crank chain",)
    cross = next(side for side in loop.links if side.before.direction is not None and side.after.direction is not None)
    if abs(cross.before.line_direction.cross(cross.after.line_direction)) <= LENGTH_TOLERANCE:
        return chain
    return (*chain, *_DOUBLE_SLIDER["".join(sorted(word[0] + word[-1]))])


def _offset_from_line(pin: Vector, side: LoopLink) -> float:
    """How far to the left of the way of its slide a pin of a link lies (m)."""
    slide = side.after if side.before.direction is None else side.before
    return float(slide.line_direction.cross(pin - slide.point))
