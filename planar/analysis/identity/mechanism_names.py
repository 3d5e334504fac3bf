"""What a mechanism is called, from its graph, the kinds of its pairs, its dimensions and its fixed link."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, product

from planar.analysis.identity.four_link_names import FOLDING, QUICK_RETURNS, four_links
from planar.analysis.identity.kinematic_scheme import NEAR, Ring, Scheme, alike, apart, ring, scheme
from planar.foundation.errors import PlanarError
from planar.model.link_graph import Figure, Likeness, joined, likenesses, loops, trees
from planar.model.mechanism import Mechanism
from planar.model.pairs import Kind
from planar.model.wording import many

LARGEST = 100
"""Links; a larger mechanism is not compared with those of any number of parts, as that may take long."""
LIKENESSES = 24
"""So many ways to lay a pattern on a mechanism are tried for one that its dimensions fit."""


@dataclass(frozen=True)
class Pattern:
    """A mechanism by its joints, each written as the letters of the links that meet in it, a slide with a dash.

    The link f is the fixed one; a pattern without an f is a chain, whichever link is fixed. Each text of `equal` lists
    lengths that are the same: a link with two joints, or two of its joints ("da.dq"). `loop` is a loop of four links
    that has to be a quick return.
    """

    name: str
    joints: str
    equal: tuple[str, ...] = ()
    loop: str = ""

    @property
    def figure(self) -> Figure:
        """Its graph."""
        joints = tuple((Kind.LENGTH if "-" in each else Kind.ANGLE, tuple(each.rstrip("-"))) for each in self._joints)
        return Figure(joints, "f" if "f" in self.joints else None)

    @property
    def _joints(self) -> tuple[str, ...]:
        return tuple(self.joints.split())

    def fits(self, chain: Scheme, likeness: Likeness) -> bool:
        """Whether a mechanism laid under the pattern has its equal lengths."""
        return all(alike([self._length(chain, likeness, each) for each in same.split()]) for same in self.equal)

    def _length(self, chain: Scheme, likeness: Likeness, what: str) -> float:
        ends = what.split(".") if "." in what else [each for each in self._joints if what in each]
        (letter,) = set(ends[0]) & set(ends[1])
        a, b = (chain.joints[likeness.joints[self._joints.index(end)]] for end in ends)
        return apart(a.places[likeness.links[letter]], b.places[likeness.links[letter]])


_WATT = "ab bc cd de ex xa ad"
"""Two ternary links, a and d, joined to one another: two loops of four."""
_STEPHENSON = "ab bd ac cd ae ex xd"
"""Two ternary links, a and d, not joined to one another: a loop of four, abdc, and two of five."""
SIX_BARS = (
    ("Watt I six-bar", _WATT, "b"),
    ("Watt II six-bar", _WATT, "a"),
    ("Stephenson I six-bar", _STEPHENSON, "b"),
    ("Stephenson II six-bar", _STEPHENSON, "e"),
    ("Stephenson III six-bar", _STEPHENSON, "a"),
)
"""The chains of six links and seven pairs by their fixed link: of Watt's a binary one or a ternary one; of Stephenson's
a binary one of the four-bar loop, one of the two binaries joined to each other, a ternary one.

L. Burmester, Lehrbuch der Kinematik, 1888; R. Norton, Design of Machinery, on linkage transformation and isomers;
J. M. McCarthy and G. Soh, Geometric Design of Linkages, on six-bars.
"""

_CELL = "fab fc cpq apx bqy xy"
PATTERNS = (
    # a knee of two links, one on the frame, one on a slider, and the crank's rod at the knee:
    # Machine Elements, 1.3.5 (iv)
    Pattern("toggle mechanism", "fc cr rkl fk ls fs-"),
    # the shaper's ram on the lever by a rod, or by a block in a slot across it: Machine Elements, 1.3.5 (ii)
    Pattern("quick return with ram (shaper)", "fc cb bl- fl lr rm fm-", loop="fcbl"),
    Pattern("quick return with ram (shaper)", "fc cb bl- fl lk km- fm-", loop="fcbl"),
    # A. Peaucellier 1864, L. Lipkin 1871; A. Kempe, How to Draw a Straight Line, 1877: straight where the crank is as
    # long as the frame between the cell's fixed pin and its own, else a circle
    Pattern("Peaucellier-Lipkin linkage", _CELL, ("a b", "p q x y")),
    Pattern("exact straight-line linkage", _CELL, ("a b", "p q x y", "c f")),
    # C. Scheiner 1631: a parallelogram on one fixed pin
    Pattern("pantograph", "fd dq da ac cq", ("a q", "c da.dq")),
    # the eight-bars in which Kennedy's theorem stops short, whichever link is fixed: G. Pennock and A. Hasan, J. of
    # Mechanical Design 124, 2002; D. Foster and G. Pennock, ASME DETC 2004; G. Pennock and D. Raje, Mechanism and
    # Machine Theory 39, 2004. Which of the two fliers is which is inferred from their structure: see the models' notes
    Pattern("double butterfly linkage", "ab ai ae bc cd cg eg eh dh di"),
    Pattern("single flier eight-bar", "ab ai aj bgh cd cg ci dh dj"),
    Pattern("double flier eight-bar", "ab ad ae bc cg ch dg di ei eh"),
)


@dataclass(frozen=True)
class Family:
    """Mechanisms of n like parts: how the joints of n parts are, the fixed link, and what dimensions they need."""

    name: str
    joints: Callable[[int], Iterator[tuple[Kind, tuple[str, ...]]]]
    frame: str
    least: int
    fits: Callable[[Scheme, Likeness, int], bool] | None = None

    def figure(self, links: int) -> tuple[Figure, int] | None:
        """The graph of the member with so many links, and its n."""
        first, second = (
            len({link for _, some in self.joints(n) for link in some}) for n in (self.least, self.least + 1)
        )
        n, rest = divmod(links - first, second - first)
        return (Figure(tuple(self.joints(self.least + n)), self.frame), self.least + n) if n >= 0 and not rest else None


def _star(n: int) -> Iterator[tuple[Kind, tuple[str, ...]]]:
    """A crank, and rods from one crank pin to pistons in n cylinders of one block."""
    yield Kind.ANGLE, ("crank", "cylinders")
    yield Kind.ANGLE, ("crank", *(f"rod {k}" for k in range(n)))
    for k in range(n):
        yield Kind.ANGLE, (f"rod {k}", f"piston {k}")
        yield Kind.LENGTH, (f"piston {k}", "cylinders")


def _cranks(n: int) -> Iterator[tuple[Kind, tuple[str, ...]]]:
    """One rod on n cranks: first the pins on the frame, then those on the rod."""
    for link in ("frame", "rod"):
        for k in range(n):
            yield Kind.ANGLE, (link, f"crank {k}")


def _scissor(n: int) -> Iterator[tuple[Kind, tuple[str, ...]]]:
    """n crossings of two bars each between a base and a platform, on each of these one bar pinned, one sliding."""
    for k in range(n):
        yield Kind.ANGLE, (f"a{k}", f"b{k}")
    yield Kind.ANGLE, ("base", "a0")
    for k in range(1, n):
        yield Kind.ANGLE, (f"a{k}", f"b{k - 1}")
        yield Kind.ANGLE, (f"a{k - 1}", f"b{k}")
    yield Kind.ANGLE, ("platform", f"b{n - 1}")
    for bar, end, on in (("b0", "foot", "base"), (f"a{n - 1}", "head", "platform")):
        yield Kind.ANGLE, (bar, end)
        yield Kind.LENGTH, (end, on)


def _parallel(chain: Scheme, likeness: Likeness, n: int) -> bool:
    """Cranks of one length, whose pins lie in the rod as in the frame."""
    pins = [[chain.joints[likeness.joints[k + on]] for k in range(n)] for on in (0, n)]
    links = [likeness.links[f"crank {k}"] for k in range(n)]
    lengths = [apart(a.places[crank], b.places[crank]) for a, b, crank in zip(*pins, links, strict=True)]
    frame, rod = (
        [complex(*joint.places[likeness.links[name]].at) for joint in some]
        for name, some in zip(("frame", "rod"), pins, strict=True)
    )
    base = [each - frame[0] for each in frame[1:]]
    if not alike(lengths) or not all(base):
        return False
    turns = [(each - rod[0]) / way for each, way in zip(rod[1:], base, strict=True)]
    return all(abs(turn - turns[0]) <= NEAR for turn in turns) and abs(abs(turns[0]) - 1.0) <= NEAR


def _halved(chain: Scheme, likeness: Likeness, n: int) -> bool:
    """All bars of one length and crossing at their middles."""
    halves = []
    for k, bar in product(range(n), "ab"):
        link, crossing = likeness.links[f"{bar}{k}"], chain.joints[likeness.joints[k]]
        ends = [joint for joint in chain.joints if link in joint.places and joint is not crossing]
        halves += [apart(crossing.places[link], end.places[link]) for end in ends]
    return alike(halves)


FAMILIES = (
    Family("rotary engine", _star, "crank", 3),
    Family("radial engine", _star, "cylinders", 3),
    Family("parallel cranks with a coupling rod", _cranks, "frame", 3, _parallel),
    Family("scissor lift", _scissor, "base", 1, _halved),
)
"""The engines: the rotary one (Gnome) is the radial one with its crank fixed. Coupled wheels: Reuleaux's parallel
cranks, with a third crank to carry them over the change points."""


def names(mechanism: Mechanism) -> tuple[str, ...]:
    """The names that the field gives to a mechanism, from the most general to the most particular; () if none.

    Neither a name in the file nor the order, scale or place of anything in it matters, only the graph with the kinds
    of pairs, dimensions, and the fixed link. Where dimensions leave it open on which side links fold (parallelogram
    or antiparallelogram) the solved position decides. A pin in a slot counts as a block on a pin.
    """
    chain = scheme(mechanism)
    if not joined(chain.figure, chain.links):
        return ()
    if chain.higher:
        return _wheels(chain)
    found = [*_open(chain), *_rings(chain, mechanism), *_six_bars(chain), *_patterns(chain), *_families(chain)]
    return tuple(dict.fromkeys(found))


def _open(chain: Scheme) -> Iterator[str]:
    """No loop: an open chain, and an arm where the links follow one another."""
    if loops(chain.figure):
        return
    moving = len(chain.links) - 1
    yield f"open chain of {many(moving, 'moving link')}"
    ends = Counter(link for joint in chain.joints for link in joint.places)
    if moving > 1 and max(ends.values()) == 2 and chain.pairs == len(chain.joints) and ends[chain.frame] == 1:
        yield "serial arm"


def _rings(chain: Scheme, mechanism: Mechanism) -> Iterator[str]:
    """One loop of all links."""
    found = ring(chain) if len(chain.links) <= 5 else None
    if found is None:
        return
    sliders = sum(joint.slides for joint in found.joints)
    if len(found.sides) == 3 and sliders == 3:
        if all(abs(side.before.way.cross(side.after.way)) > NEAR for side in found.sides):
            yield "wedge mechanism"
    elif len(found.sides) == 4:
        for name in four_links(found):
            yield _folded(found, mechanism) if name == FOLDING else name
    elif len(found.sides) == 5 and sliders <= 2:
        yield f"five-bar chain{_with(sliders)}"


def _folded(found: Ring, mechanism: Mechanism) -> str:
    """Which of the two ways of a four-bar of equal opposite links it is, from its position."""
    from planar.solving.position import solve  # casadi is slow to load, and only needed here

    try:
        state = solve(mechanism)
    except PlanarError:
        return FOLDING
    a, b, c, d = (complex(*state.point(joint.name).position) for joint in found.joints)
    return "parallelogram" if abs((b - a) - (c - d)) <= NEAR * (abs(b - a) + abs(d - a)) else "antiparallelogram"


def _six_bars(chain: Scheme) -> Iterator[str]:
    """Watt's and Stephenson's chains by the fixed link, whatever the kinds of their pairs.

    A pin of three links is two pairs between them, in any of three ways; the chain is then a degenerate one of each
    kind that some way gives.
    """
    if len(chain.links) != 6 or chain.pairs != 7:
        return
    pins = any(len(joint.places) > 2 for joint in chain.joints)
    sliders = sum(joint.slides for joint in chain.joints)
    ways = list(product(*(trees(tuple(joint.places)) for joint in chain.joints)))
    for name, letters, frame in SIX_BARS:
        known = Figure(Pattern(name, letters).figure.joints, frame)
        spread = (Figure(tuple((Kind.ANGLE, pair) for each in way for pair in each), chain.frame) for way in ways)
        if any(next(likenesses(known, figure), None) for figure in spread):
            yield f"{'degenerate ' * pins}{name}{_with(sliders)}"


def _patterns(chain: Scheme) -> Iterator[str]:
    """The mechanisms of the list."""
    for pattern in PATTERNS:
        figure = pattern.figure
        ours = chain.figure if figure.frame else chain.figure._replace(frame=None)
        for likeness in islice(likenesses(figure, ours), LIKENESSES):
            quick = _loop(chain, pattern, likeness.links)
            if pattern.fits(chain, likeness) and (quick or not pattern.loop):
                yield from (*quick, pattern.name)
                break


def _loop(chain: Scheme, pattern: Pattern, links: Mapping[str, str]) -> tuple[str, ...]:
    """Which quick return the loop of a pattern is."""
    found = ring(chain.part(links[letter] for letter in pattern.loop)) if pattern.loop else None
    return tuple(name for name in four_links(found) if name in QUICK_RETURNS) if found else ()


def _families(chain: Scheme) -> Iterator[str]:
    """The mechanisms of n like parts."""
    for family in FAMILIES if len(chain.links) <= LARGEST else ():
        known = family.figure(len(chain.links))
        if known is not None:
            figure, n = known
            some = islice(likenesses(figure, chain.figure), LIKENESSES)
            if any(family.fits is None or family.fits(chain, likeness, n) for likeness in some):
                yield family.name


def _wheels(chain: Scheme) -> tuple[str, ...]:
    """Higher pairs that count turns: wheels on a carrier, and where there are none, a rack with its pinion.

    Epicyclic where a carrier moves, be it that a wheel stands still (R. Willis, Principles of Mechanism, 1841). A loop
    of five links of which two neighbours of a third are geared in it is a geared five-bar (R. Norton). What else has
    loops besides its wheels is a geared linkage.
    """
    if not all(pair.counts_turns and not pair.at_a_distance for pair in chain.higher):
        return ()
    wheels = [pair for pair in chain.higher if pair.drive_kind is Kind.TURNS]
    carriers = {body for pair in wheels for body in pair.bodies if body not in pair.links}
    five = ring(replace(chain, higher=())) if len(chain.links) == 5 else None
    if five is not None and len(chain.higher) == len(wheels) == len(carriers) == 1:
        around = [side.link for side in five.sides]
        (at,) = (around.index(carrier) for carrier in carriers)
        if {around[at - 1], around[(at + 1) % 5]} == {*wheels[0].links}:
            return (f"geared five-bar{_with(sum(joint.slides for joint in five.joints))}",)
    if not wheels:
        return ("rack and pinion",)
    looped = ("geared linkage",) if loops(chain.figure) else ()
    if carriers - {chain.frame}:
        return (*looped, "epicyclic train")
    return looped or ("train of wheels",)


def _with(sliders: int) -> str:
    """What is said of sliding pairs in a chain that has its name from turning ones."""
    return ("", " with a slider")[sliders] if sliders < 2 else f" with {sliders} sliders"
