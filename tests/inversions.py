"""Linkages of one large group: a crank on the frame, and four, six or more links that no smaller group holds."""

from __future__ import annotations

from collections.abc import Collection
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.completeness import BlockRoots
from planar.document import files
from planar.equations.symbolic_equations import slice_length
from planar.solving.assembly.block_assemblies import SAME_ASSEMBLY_TOLERANCE
from planar.solving.newton import block_residual_function, damped_newton
from planar.solving.prepared_mechanism import PreparedMechanism
from tests.linkages import Builder, Built, _joints

Joints = tuple[tuple[str, str], ...]


class Group(NamedTuple):
    """A linkage as it was built, made ready, and its unknowns there; its only group is the first."""

    built: Built
    setup: PreparedMechanism
    z: np.ndarray


@cache
def structures(links: int, count: int) -> tuple[Joints, ...]:
    """So many ways in which a crank on the frame and this number of links are one group, all joints turning pairs."""
    found: dict[Joints, None] = {}
    seed = 0
    while len(found) < count:
        rng = np.random.default_rng([links, seed])
        joints = tuple(_joints(rng, ["frame", "L1"], [f"L{k}" for k in range(2, links + 2)]))
        seed += 1
        # three links pinned to each other are one link
        if has_triangle(joints) or joints in found:
            continue
        if one_group(group(joints, rng).setup, links):
            found[joints] = None
    return tuple(found)


def has_triangle(joints: Joints) -> bool:
    """Whether three links are joined to each other."""
    joined = {frozenset(joint) for joint in (*joints, ("frame", "L1"))}
    links = sorted({link for joint in joined for link in joint})
    return any(all(frozenset(two) in joined for two in combinations(three, 2)) for three in combinations(links, 3))


def one_group(setup: PreparedMechanism, unknowns: int) -> bool:
    """Whether all that is unknown is in one group."""
    stages = setup.equations.blocks
    return len(stages) == 1 and slice_length(stages[0].unknowns) == unknowns


def group(joints: Joints, rng: np.random.Generator, sliding: Collection[int] = ()) -> Group:
    """A linkage with these joints and random dimensions; some of its joints are slides."""
    builder = Builder(rng)
    builder.drive(builder.turning("frame", builder.link()), "frame", "L1", 1.0, 0.0)
    for _ in range(len({link for joint in joints for link in joint} - {"frame", "L1"})):
        builder.link()
    for k, joint in enumerate(joints):
        (builder.sliding if k in sliding else builder.turning)(*joint)
    built = builder.built()
    setup = PreparedMechanism(files.from_dict(built.value))
    return Group(built, setup, unknowns_of(setup, built))


def unknowns_of(setup: PreparedMechanism, built: Built) -> np.ndarray:
    """The unknowns at the place where a linkage was built (scaled)."""
    own = {pair.name: own_of(setup, built, pair) for pair in setup.mechanism.pairs if pair.coordinate_kinds}
    frames = {name: frame for name, frame in built.frames.items() if name != "frame"}
    return setup.coordinates(frames, own)[list(setup.equations.unknowns)]


def own_of(setup: PreparedMechanism, built: Built, pair) -> list[float]:
    """A pair's own coordinates, which enter its residual linearly, where the linkage was built."""
    frames = [built.frames[link] for link in pair.bodies]
    numbers = pair.measure([setup.shapes[link] for link in pair.bodies])
    count = len(pair.coordinate_kinds)
    still = np.array(pair.residual(frames, numbers, [0.0] * count))
    slopes = [np.array(pair.residual(frames, numbers, list(unit))) - still for unit in np.eye(count)]
    return np.linalg.lstsq(np.array(slopes).T, -still, rcond=None)[0].tolist()


def listed(setup: PreparedMechanism, found: BlockRoots, unknowns: np.ndarray) -> bool:
    """Whether an assembly of the first group is one of those that were found."""
    e = setup.equations
    angles = np.array([e.coordinates[c].kind.value != "length" for c in e.unknowns[e.blocks[0].unknowns]])
    turned = np.abs(np.exp(1j * found.real) - np.exp(1j * unknowns))
    return bool(
        np.any(np.all(np.where(angles, turned, np.abs(found.real - unknowns)) < SAME_ASSEMBLY_TOLERANCE, axis=1))
    )


def missed(setup: PreparedMechanism, found: BlockRoots, rng: np.random.Generator, starts: int) -> list[np.ndarray]:
    """Assemblies of the first group that random starts lead to and that are not listed."""
    stage = setup.equations.blocks[0]
    z = np.zeros(len(setup.equations.unknowns))
    closing = block_residual_function(setup.functions, stage, z, setup.inputs.u, setup.inputs.p)
    ended = damped_newton(closing, rng.uniform(-np.pi, np.pi, (starts, slice_length(stage.unknowns))))
    return [each for each in ended.unknowns[ended.converged] if not listed(setup, found, each)]
