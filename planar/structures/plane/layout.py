"""Places of a chain's joints on paper: no lines cross that need not, links are neither small nor close to others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.structures.plane.embedding import PlaneEmbedding, plane_embeddings
from planar.structures.plane.energy import LayoutEnergy
from planar.structures.rigid_parts import Joint

FIRST_STEPS, STEPS = 40, 200
"""Of the descent: how many there are of each try, and how many more of the best."""
MAX_EMBEDDINGS, MAX_CROSSED_EMBEDDINGS, BEST_TRIES = 12, 4, 4
"""Embeddings that are looked for, of each choice of crossings, and tries of these that are gone on with."""
RANDOM_TRIES, SMOOTHINGS = 60, 12
"""Of what has no embedding with few crossings of bars: tries, and how often each joint moves to the mean of its links
before them."""
ALIGNMENT, MIRROR_TOLERANCE = np.radians(4.0), 0.06
"""Lines turned less look level, and joints no farther off, in sizes of the drawing, look like mirror images."""
MIRROR_WORTH, HEIGHT_WORTH = 6.0, 8.0
"""How many level lines a mirror image is worth, and how many a drawing is worth less that is as high as it is wide."""


class ChainLayout(NamedTuple):
    """Places of the joints (joints, 2), the joints of each link in their order round it, and how many lines cross."""

    places: Array
    rotations: tuple[tuple[int, ...], ...]
    crossings: int


class _Try(NamedTuple):
    energy: float
    at: Array
    embedding: PlaneEmbedding


def lay_out_chain(links: int, joints: Sequence[Sequence[int]]) -> ChainLayout:
    """Places of all joints. Lines that cross are those of two bars, where the chain cannot be drawn without.

    W. Tutte, How to Draw a Graph, Proc. London Math. Soc. 13 (1963) 743, gives places without crossings from a face
    that is put outside: each inner face with a spot in its middle, each spot in the mean of those beside it. From there
    equal lengths, and the distances of joints from joints and lines, are improved step by step, none of which makes
    lines cross. The best of some embeddings and of all outer faces is taken. Where more than two crossings are needed,
    the fewest that some random starts end with are taken.
    """
    tries = _improve(_starts(links, joints), FIRST_STEPS)
    if tries:
        tries = _improve(sorted(tries, key=lambda each: each.energy)[:BEST_TRIES], STEPS)
        tries = [found for each in tries for found in _without_crossing_spots(each, len(joints))]
    if not tries:
        return _tangled_layout(links, joints)
    best = min(tries, key=lambda each: each.energy)
    sides = best.embedding._replace(crossings=()).sides()
    places = _upright(best.at[: len(joints)], sides)
    return ChainLayout(places, best.embedding.rotations, len(best.embedding.crossings))


def _starts(links: int, joints: Sequence[Sequence[int]]) -> list[_Try]:
    """Drawings without more crossings than there are spots for, of each embedding with each of its faces outside."""
    tries: list[_Try] = []
    known: set[tuple[object, ...]] = set()
    for count, embedding in enumerate(plane_embeddings(links, joints, MAX_EMBEDDINGS)):
        if embedding.crossings and count % MAX_EMBEDDINGS >= MAX_CROSSED_EMBEDDINGS:
            continue
        for face in embedding.faces:
            key = (
                embedding.crossings,
                tuple(sorted(tuple(sorted(each)) for each in embedding.faces)),
                tuple(sorted(face)),
            )
            if key not in known and len({*face}) == len(face) > 2:
                known.add(key)
                tries.append(_Try(0.0, _tutte_places(embedding, face), embedding))
    return tries


def _tutte_places(embedding: PlaneEmbedding, outer: Sequence[int]) -> Array:
    """Places of all spots, those of the outer face on a circle, sides of length 1 in the mean."""
    sides = embedding.sides()
    size = embedding.spots
    groups = [face for face in embedding.faces if face is not outer]
    groups += [each for each in embedding.rotations if len(each) > 3]
    matrix = np.zeros((size + len(groups), size + len(groups)))
    for a, b in [*sides, *embedding.ties, *((spot, size + k) for k, group in enumerate(groups) for spot in group)]:
        matrix[a, b] -= 1.0
        matrix[b, a] -= 1.0
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    fixed = np.zeros(len(matrix), dtype=complex)
    fixed[list(outer)] = np.exp(2j * np.pi * np.arange(len(outer)) / len(outer))
    matrix[list(outer)] = 0.0
    matrix[list(outer), list(outer)] = 1.0
    found: Array = np.linalg.solve(matrix, fixed)[:size]
    a, b = np.array(sides).T
    scaled: Array = found / np.exp(np.mean(np.log(np.maximum(np.abs(found[a] - found[b]), 1e-9))))
    return scaled


def _improve(tries: Sequence[_Try], steps: int) -> list[_Try]:
    """Drawings of less energy; those of which the sides are the same side by side."""
    groups: dict[tuple[object, ...], list[_Try]] = {}
    for each in tries:
        groups.setdefault((each.embedding.crossings, tuple(each.embedding.sides())), []).append(each)
    found = []
    for same in groups.values():
        embedding = same[0].embedding
        plates = [each for each in embedding.rotations if len(each) > 2]
        paths = [embedding.bar_path(link) for link, each in enumerate(embedding.rotations) if len(each) == 2]
        bent = [(path[k], path[k + 1], path[k + 2]) for path in paths for k in range(len(path) - 2)]
        of = LayoutEnergy(embedding.spots, embedding.sides(), plates, bent)
        energies, ends = of.descend(np.array([each.at for each in same]), steps)
        found += [_Try(e, at, each.embedding) for e, at, each in zip(energies, ends, same, strict=True)]
    return found


def _without_crossing_spots(found: _Try, joints: int) -> list[_Try]:
    """The same with bars that cross as straight lines, where no other lines then cross; else nothing."""
    embedding = found.embedding
    if not embedding.crossings:
        return [found]
    straight = embedding._replace(crossings=())
    sides = straight.sides()
    place = {side: k for k, side in enumerate(sides)}
    bars = {link: place[min(own), max(own)] for link, own in enumerate(embedding.rotations) if len(own) == 2}
    may = [(bars[a], bars[b]) for a, b in embedding.crossings]
    of = LayoutEnergy(joints, sides, [each for each in embedding.rotations if len(each) > 2], (), may)
    at = found.at[None, :joints]
    if of.crossings(at)[0]:
        return []
    energies, ends = of.descend(at, STEPS)
    return [_Try(energies[0], ends[0], embedding)]


def _tangled_layout(links: int, joints: Sequence[Sequence[int]]) -> ChainLayout:
    """The drawing with the fewest crossings that random starts end with; joints of a link in their order about it."""
    random = np.random.default_rng(0)
    own = [[k for k, joint in enumerate(joints) if link in joint] for link in range(links)]
    beside = np.zeros((len(joints), len(joints)))
    for each in own:
        beside[np.ix_(each, each)] = 1.0 / len(each)
    tries = []
    for number in range(RANDOM_TRIES):
        start = _spread_start(beside, random)
        embedding = PlaneEmbedding(_rotations(start, own), (), (), ())
        sides, plates = embedding.sides(), [each for each in embedding.rotations if len(each) > 2]
        of = LayoutEnergy(len(joints), sides, plates)
        energies, ends = of.descend(start[None], FIRST_STEPS)
        tries.append((of.crossings(ends)[0], energies[0], number, of, ends, embedding))
    *_, of, ends, embedding = min(tries)
    _, ends = of.descend(ends, STEPS)
    return ChainLayout(_upright(ends[0], embedding.sides()), embedding.rotations, int(of.crossings(ends)[0]))


def _spread_start(beside: Array, random: np.random.Generator) -> Array:
    """Random places (joints) of which those of a link are near each other."""

    def scatter() -> Array:
        places: Array = random.normal(size=len(beside)) + 1j * random.normal(size=len(beside))
        return places

    at = scatter()
    for _ in range(SMOOTHINGS):
        at = at @ beside
        at = (at - at.mean()) / np.std(at)
    spread: Array = np.sqrt(len(at)) / 1.5 * (at + 0.1 * scatter())
    return spread


def _rotations(at: Array, own: Sequence[Sequence[int]]) -> tuple[tuple[int, ...], ...]:
    """The joints of each link in their order about its middle."""
    return tuple(
        tuple(each if len(each) == 2 else sorted(each, key=lambda k: np.angle(at[k] - at[list(each)].mean())))
        for each in own
    )


def _upright(at: Array, sides: Sequence[Joint]) -> Array:
    """Places (joints, 2) about the middle of the paper, turned so that many lines lie level, wide across, and so that
    what is its own mirror image is so from left to right or from top to bottom."""
    first, last = np.array(sides).T
    ways = at[last] - at[first]
    apart = (at[:, None] - at)[np.triu_indices(len(at), 1)]
    reach = np.abs(apart).max()

    def worth(angle: float) -> float:
        level = np.angle((ways * np.exp(-1j * angle)) ** 2) / 2.0
        turned = at * np.exp(-1j * angle)
        height, width = np.ptp(turned.imag), np.ptp(turned.real)
        turned -= turned.real.min() + width / 2.0 + 1j * (turned.imag.min() + height / 2.0)
        off = min(np.abs(turned[:, None] - sign * turned.conj()).min(axis=1).max() for sign in (1.0, -1.0))
        return float(
            np.exp(-((level / ALIGNMENT) ** 2)).sum()
            + MIRROR_WORTH * np.exp(-((off / (MIRROR_TOLERANCE * reach)) ** 2))
            - HEIGHT_WORTH * height / reach
        )

    turned = at * np.exp(-1j * max(np.angle(apart), key=worth))
    places: Array = np.column_stack([turned.real, turned.imag])
    places -= (places.min(axis=0) + places.max(axis=0)) / 2.0
    return places
