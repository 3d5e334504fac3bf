"""What the equations take of a mechanism: its structure, the sizes of its links, the numbers p of its pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.jets import Scalar
from planar.model.link_shapes import Link, LinkShape, link_shape, shape_extent
from planar.model.mechanism import Input, Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair


def equation_structure(mechanism: Mechanism) -> Mechanism:
    """All of a mechanism that its equations depend on: names of links, pairs, which motions are driven."""
    structure: Mechanism | None = mechanism.__dict__.get("_equation_structure")  # kept: asked often, and hashed
    if structure is None:
        structure = Mechanism(
            name="",
            frame=mechanism.frame,
            links=tuple(Link(link.name) for link in mechanism.links),
            pairs=mechanism.pairs,
            inputs=tuple(Input(driven.pair, 0.0) for driven in mechanism.inputs),
            closes_within=None if mechanism.closes_within is None else 0.0,
        )
        object.__setattr__(mechanism, "_equation_structure", structure)
    return structure


def shapes_of_links(mechanism: Mechanism) -> dict[str, LinkShape]:
    """The shape of every link (m)."""
    return {link.name: link_shape(link) for link in mechanism.links}


def mechanism_size(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> float:
    """The mechanism's size (m): the greatest distance between two points of one link, else of a slide's travel."""
    named = relative_motions(mechanism)
    slide = [named[driven.pair].input_kind is MeasureKind.LENGTH for driven in mechanism.inputs]
    return size_from_extents(mechanism, {name: shape_extent(shape) for name, shape in shapes.items()}, slide)


def size_from_extents(mechanism: Mechanism, extents: Mapping[str, float], is_slide: Sequence[bool]) -> float:
    """The mechanism's size (m) from the extents of its links and from which of its inputs slide."""
    slides = [abs(driven.position) for driven, slides in zip(mechanism.inputs, is_slide, strict=True) if slides]
    return max(extents.values(), default=0.0) or max(slides, default=0.0) or 1.0


def pair_numbers(mechanism: Mechanism, shapes: Mapping[str, LinkShape], unit: float) -> Array:
    """p: the numbers of every pair, lengths divided by `unit`."""
    return np.array([number for pair in mechanism.pairs for number in scaled_pair_numbers(pair, shapes, unit)], float)


def scaled_pair_numbers(pair: Pair, shapes: Mapping[str, LinkShape], unit: Scalar) -> list[Scalar]:
    """The numbers of one pair, lengths divided by `unit`."""
    return scale_lengths(pair.measure([shapes[link] for link in pair.bodies]), pair.number_kinds, unit)


def scale_lengths(values: Sequence[Scalar], kinds: Sequence[MeasureKind], unit: Scalar) -> list[Scalar]:
    """Numbers with the lengths among them divided by `unit`."""
    return [value / unit if kind is MeasureKind.LENGTH else value for value, kind in zip(values, kinds, strict=True)]
