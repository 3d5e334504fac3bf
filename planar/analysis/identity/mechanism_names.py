"""What a mechanism is called, from its graph, the kinds of its pairs, its dimensions and its fixed link."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, product

from planar.analysis.identity.four_link_names import EITHER_PARALLELOGRAM, QUICK_RETURNS, four_link_names
from planar.analysis.identity.kinematic_scheme import (
    LENGTH_TOLERANCE,
    KinematicLoop,
    KinematicScheme,
    find_single_loop,
    has_equal_lengths,
    kinematic_scheme,
    pin_distance,
)
from planar.foundation.errors import PlanarError
from planar.model.link_graph import (
    JointDiagram,
    JointIsomorphism,
    are_connected,
    independent_loop_count,
    isomorphisms,
    pin_pair_trees,
)
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase
from planar.structures.chain_names import EIGHT_BARS, SIX_BARS

MAX_FAMILY_LINKS = 100
"""Links; a larger mechanism is not compared with those of any number of parts, as that may take long."""
MAX_ISOMORPHISMS = 24
"""So many ways to lay a pattern on a mechanism are tried for one that its dimensions fit."""


@dataclass(frozen=True)
class MechanismPattern:
    """A mechanism by its joints, each written as the letters of the links that meet in it, a slide with a dash.

    The link f is the fixed one; a pattern without an f is a chain, whichever link is fixed. Each text of `equal` lists
    lengths that are the same: a link with two joints, or two of its joints ("da.dq"). `loop` is a loop of four links
    that has to be a quick return.
    """

    name: str
    joints: str
    equal_lengths: tuple[str, ...] = ()
    loop: str = ""

    @property
    def joint_diagram(self) -> JointDiagram:
        """Its graph."""
        joints = tuple(
            (MeasureKind.LENGTH if "-" in each else MeasureKind.ANGLE, tuple(each.rstrip("-")))
            for each in self._joint_words
        )
        return JointDiagram(joints, "f" if "f" in self.joints else None)

    @property
    def _joint_words(self) -> tuple[str, ...]:
        return tuple(self.joints.split())

    def has_equal_lengths_in(self, scheme: KinematicScheme, likeness: JointIsomorphism) -> bool:
        """Whether a mechanism laid under the pattern has its equal lengths."""
        return all(
            has_equal_lengths([self._length(scheme, likeness, each) for each in same.split()])
            for same in self.equal_lengths
        )

    def _length(self, chain: KinematicScheme, likeness: JointIsomorphism, what: str) -> float:
        ends = what.split(".") if "." in what else [each for each in self._joint_words if what in each]
        (letter,) = set(ends[0]) & set(ends[1])
        a, b = (chain.joints[likeness.joints[self._joint_words.index(end)]] for end in ends)
        return pin_distance(a.locations[likeness.links[letter]], b.locations[likeness.links[letter]])


_CELL = "fab fc cpq apx bqy xy"
PATTERNS = (
    # a knee of two links, one on the frame, one on a slider, and the crank's rod at the knee:
    # Machine Elements, 1.3.5 (iv)
    MechanismPattern("toggle mechanism", "fc cr rkl fk ls fs-"),
    # the shaper's ram on the lever by a rod, or by a block in a slot across it: Machine Elements, 1.3.5 (ii)
    MechanismPattern("quick return with ram (shaper)", "fc cb bl- fl lr rm fm-", loop="fcbl"),
    MechanismPattern("quick return with ram (shaper)", "fc cb bl- fl lk km- fm-", loop="fcbl"),
    # A. Peaucellier 1864, L. Lipkin 1871; A. Kempe, How to Draw a Straight Line, 1877: straight where the crank is as
    # long as the frame between the cell's fixed pin and its own, else a circle
    MechanismPattern("Peaucellier-Lipkin linkage", _CELL, ("a b", "p q x y")),
    MechanismPattern("exact straight-line linkage", _CELL, ("a b", "p q x y", "c f")),
    # C. Scheiner 1631: a parallelogram on one fixed pin
    MechanismPattern("pantograph", "fd dq da ac cq", ("a q", "c da.dq")),
    *(MechanismPattern(name, joints) for name, joints in EIGHT_BARS),
)


@dataclass(frozen=True)
class MechanismFamily:
    """Mechanisms of n like parts: how the joints of n parts are, the fixed link, and what dimensions they need."""

    name: str
    joints: Callable[[int], Iterator[tuple[MeasureKind, tuple[str, ...]]]]
    frame: str
    least_parts: int
    condition: Callable[[KinematicScheme, JointIsomorphism, int], bool] | None = None

    def joint_diagram_of_size(self, links: int) -> tuple[JointDiagram, int] | None:
        """The graph of the member with so many links, and its n."""
        first, second = (
            len({link for _, some in self.joints(n) for link in some}) for n in (self.least_parts, self.least_parts + 1)
        )
        n, rest = divmod(links - first, second - first)
        return (
            (JointDiagram(tuple(self.joints(self.least_parts + n)), self.frame), self.least_parts + n)
            if n >= 0 and not rest
            else None
        )


def _star_joints(n: int) -> Iterator[tuple[MeasureKind, tuple[str, ...]]]:
    """A crank, and rods from one crank pin to pistons in n cylinders of one block."""
    yield MeasureKind.ANGLE, ("crank", "cylinders")
    yield MeasureKind.ANGLE, ("crank", *(f"rod {k}" for k in range(n)))
    for k in range(n):
        yield MeasureKind.ANGLE, (f"rod {k}", f"piston {k}")
        yield MeasureKind.LENGTH, (f"piston {k}", "cylinders")


def _coupled_crank_joints(n: int) -> Iterator[tuple[MeasureKind, tuple[str, ...]]]:
    """One rod on n cranks: first the pins on the frame, then those on the rod."""
    for link in ("frame", "rod"):
        for k in range(n):
            yield MeasureKind.ANGLE, (link, f"crank {k}")


def _scissor_joints(n: int) -> Iterator[tuple[MeasureKind, tuple[str, ...]]]:
    """n crossings of two bars each between a base and a platform, on each of these one bar pinned, one sliding."""
    for k in range(n):
        yield MeasureKind.ANGLE, (f"a{k}", f"b{k}")
    yield MeasureKind.ANGLE, ("base", "a0")
    for k in range(1, n):
        yield MeasureKind.ANGLE, (f"a{k}", f"b{k - 1}")
        yield MeasureKind.ANGLE, (f"a{k - 1}", f"b{k}")
    yield MeasureKind.ANGLE, ("platform", f"b{n - 1}")
    for bar, end, on in (("b0", "foot", "base"), (f"a{n - 1}", "head", "platform")):
        yield MeasureKind.ANGLE, (bar, end)
        yield MeasureKind.LENGTH, (end, on)


def _has_parallel_cranks(chain: KinematicScheme, likeness: JointIsomorphism, n: int) -> bool:
    """Cranks of one length, whose pins lie in the rod as in the frame."""
    pins = [[chain.joints[likeness.joints[k + on]] for k in range(n)] for on in (0, n)]
    links = [likeness.links[f"crank {k}"] for k in range(n)]
    lengths = [pin_distance(a.locations[crank], b.locations[crank]) for a, b, crank in zip(*pins, links, strict=True)]
    frame, rod = (
        [complex(*joint.locations[likeness.links[name]].point) for joint in some]
        for name, some in zip(("frame", "rod"), pins, strict=True)
    )
    base = [each - frame[0] for each in frame[1:]]
    if not has_equal_lengths(lengths) or not all(base):
        return False
    turns = [(each - rod[0]) / way for each, way in zip(rod[1:], base, strict=True)]
    return (
        all(abs(turn - turns[0]) <= LENGTH_TOLERANCE for turn in turns) and abs(abs(turns[0]) - 1.0) <= LENGTH_TOLERANCE
    )


def _has_halved_bars(chain: KinematicScheme, likeness: JointIsomorphism, n: int) -> bool:
    """All bars of one length and crossing at their middles."""
    halves = []
    for k, bar in product(range(n), "ab"):
        link, crossing = likeness.links[f"{bar}{k}"], chain.joints[likeness.joints[k]]
        ends = [joint for joint in chain.joints if link in joint.locations and joint is not crossing]
        halves += [pin_distance(crossing.locations[link], end.locations[link]) for end in ends]
    return has_equal_lengths(halves)


FAMILIES = (
    MechanismFamily("rotary engine", _star_joints, "crank", 3),
    MechanismFamily("radial engine", _star_joints, "cylinders", 3),
    MechanismFamily("parallel cranks with a coupling rod", _coupled_crank_joints, "frame", 3, _has_parallel_cranks),
    MechanismFamily("scissor lift", _scissor_joints, "base", 1, _has_halved_bars),
)
"""The engines: the rotary one (Gnome) is the radial one with its crank fixed. Coupled wheels: Reuleaux's parallel
cranks, with a third crank to carry them over the change points."""


def mechanism_names(mechanism: Mechanism) -> tuple[str, ...]:
    """The names that the field gives to a mechanism, from the most general to the most particular; () if none.

    Neither a name in the file nor the order, scale or place of anything in it matters, only the graph with the kinds
    of pairs, dimensions, and the fixed link. Where dimensions leave it open on which side links fold (parallelogram
    or antiparallelogram) the solved position decides. A pin in a slot counts as a block on a pin.
    """
    chain = kinematic_scheme(mechanism)
    if not are_connected(chain.joint_diagram, chain.links):
        return ()
    if chain.higher:
        return _wheel_train_names(chain)
    found = [
        *_open_chain_names(chain),
        *_loop_names(chain, mechanism),
        *_six_bar_names(chain),
        *_pattern_names(chain),
        *_family_names(chain),
    ]
    return tuple(dict.fromkeys(found))


def _open_chain_names(chain: KinematicScheme) -> Iterator[str]:
    """No loop: an open chain, and an arm where the links follow one another."""
    if independent_loop_count(chain.joint_diagram):
        return
    moving = len(chain.links) - 1
    yield f"open chain of {count_phrase(moving, 'moving link')}"
    ends = Counter(link for joint in chain.joints for link in joint.locations)
    if (
        moving > 1
        and max(ends.values()) == 2
        and chain.lower_pair_count == len(chain.joints)
        and ends[chain.frame] == 1
    ):
        yield "serial arm"


def _loop_names(chain: KinematicScheme, mechanism: Mechanism) -> Iterator[str]:
    """One loop of all links."""
    found = find_single_loop(chain) if len(chain.links) <= 5 else None
    if found is None:
        return
    sliders = sum(joint.slides for joint in found.joints)
    if len(found.links) == 3 and sliders == 3:
        if all(
            abs(side.before.line_direction.cross(side.after.line_direction)) > LENGTH_TOLERANCE for side in found.links
        ):
            yield "wedge mechanism"
    elif len(found.links) == 4:
        for name in four_link_names(found):
            yield _parallelogram_name(found, mechanism) if name == EITHER_PARALLELOGRAM else name
    elif len(found.links) == 5 and sliders <= 2:
        yield f"five-bar chain{_slider_suffix(sliders)}"


def _parallelogram_name(loop: KinematicLoop, mechanism: Mechanism) -> str:
    """Which of the two ways of a four-bar of equal opposite links it is, from its position where the file gives one."""
    if not (mechanism.inputs or mechanism.sketch):
        return EITHER_PARALLELOGRAM
    from planar.solving.position import solve  # casadi is slow to load, and only needed here

    try:
        state = solve(mechanism)
    except PlanarError:
        return EITHER_PARALLELOGRAM
    a, b, c, d = (complex(*state.point(joint.name).position) for joint in loop.joints)
    return (
        "parallelogram"
        if abs((b - a) - (c - d)) <= LENGTH_TOLERANCE * (abs(b - a) + abs(d - a))
        else "antiparallelogram"
    )


def _six_bar_names(chain: KinematicScheme) -> Iterator[str]:
    """Watt's and Stephenson's chains by the fixed link, whatever the kinds of their pairs.

    A pin of three links is two pairs between them, in any of three ways; the chain is then a degenerate one of each
    kind that some way gives.
    """
    if len(chain.links) != 6 or chain.lower_pair_count != 7:
        return
    pins = any(len(joint.locations) > 2 for joint in chain.joints)
    sliders = sum(joint.slides for joint in chain.joints)
    ways = list(product(*(pin_pair_trees(tuple(joint.locations)) for joint in chain.joints)))
    for name, letters, frame in SIX_BARS:
        known = JointDiagram(MechanismPattern(name, letters).joint_diagram.joints, frame)
        spread = (
            JointDiagram(tuple((MeasureKind.ANGLE, pair) for each in way for pair in each), chain.frame) for way in ways
        )
        if any(next(isomorphisms(known, figure), None) for figure in spread):
            yield f"{'degenerate ' * pins}{name}{_slider_suffix(sliders)}"


def _pattern_names(chain: KinematicScheme) -> Iterator[str]:
    """The mechanisms of the list."""
    for pattern in PATTERNS:
        figure = pattern.joint_diagram
        ours = chain.joint_diagram if figure.frame else chain.joint_diagram._replace(frame=None)
        for likeness in islice(isomorphisms(figure, ours), MAX_ISOMORPHISMS):
            quick = _quick_return_names(chain, pattern, likeness.links)
            if pattern.has_equal_lengths_in(chain, likeness) and (quick or not pattern.loop):
                yield from (*quick, pattern.name)
                break


def _quick_return_names(chain: KinematicScheme, pattern: MechanismPattern, links: Mapping[str, str]) -> tuple[str, ...]:
    """Which quick return the loop of a pattern is."""
    found = find_single_loop(chain.subscheme(links[letter] for letter in pattern.loop)) if pattern.loop else None
    return tuple(name for name in four_link_names(found) if name in QUICK_RETURNS) if found else ()


def _family_names(chain: KinematicScheme) -> Iterator[str]:
    """The mechanisms of n like parts."""
    for family in FAMILIES if len(chain.links) <= MAX_FAMILY_LINKS else ():
        known = family.joint_diagram_of_size(len(chain.links))
        if known is not None:
            figure, n = known
            some = islice(isomorphisms(figure, chain.joint_diagram), MAX_ISOMORPHISMS)
            if any(family.condition is None or family.condition(chain, likeness, n) for likeness in some):
                yield family.name


def _wheel_train_names(chain: KinematicScheme) -> tuple[str, ...]:
    """Higher pairs that count turns: wheels on a carrier, and where there are none, a rack with its pinion.

    Epicyclic where a carrier moves, be it that a wheel stands still (R. Willis, Principles of Mechanism, 1841). A loop
    of five links of which two neighbours of a third are geared in it is a geared five-bar (R. Norton). What else has
    loops besides its wheels is a geared linkage.
    """
    if not all(pair.counts_turns and not pair.acts_at_distance for pair in chain.higher):
        return ()
    wheels = [pair for pair in chain.higher if pair.input_kind is MeasureKind.TURNS]
    carriers = {body for pair in wheels for body in pair.bodies if body not in pair.links}
    five = find_single_loop(replace(chain, higher=())) if len(chain.links) == 5 else None
    if five is not None and len(chain.higher) == len(wheels) == len(carriers) == 1:
        around = [side.link for side in five.links]
        (at,) = (around.index(carrier) for carrier in carriers)
        if {around[at - 1], around[(at + 1) % 5]} == {*wheels[0].links}:
            return (f"geared five-bar{_slider_suffix(sum(joint.slides for joint in five.joints))}",)
    if not wheels:
        return ("rack and pinion",)
    looped = ("geared linkage",) if independent_loop_count(chain.joint_diagram) else ()
    if carriers - {chain.frame}:
        return (*looped, "epicyclic train")
    return looped or ("train of wheels",)


def _slider_suffix(sliders: int) -> str:
    """What is said of sliding pairs in a chain that has its name from turning ones."""
    return ("", " with a slider")[sliders] if sliders < 2 else f" with {sliders} sliders"
