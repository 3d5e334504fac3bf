"""Remarks on how an assembly was chosen."""

from __future__ import annotations

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.foundation.units import parse_unit
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_NAMED_BLOCKS = 4
"""Blocks of links that are named one by one."""


def sketch_remarks(setup: PreparedMechanism, candidates: BlockAssemblies, found: Assembly) -> tuple[str, ...]:
    """Sentences on blocks whose assembly the sketch leaves open: how they stand, and how to choose."""
    open_ones = [setup.equations.blocks[index] for index in found.ties]
    told = []
    if open_ones:
        lead = "the sketch leaves open" if setup.mechanism.sketch else "there is no sketch to say"
        stand = [_describe_block_position(setup, candidates, stage, found.z) for stage in open_ones[:MAX_NAMED_BLOCKS]]
        more = (
            f", and so on for {count_phrase(len(open_ones) - MAX_NAMED_BLOCKS, 'more group')}"
            if len(open_ones) > MAX_NAMED_BLOCKS
            else ""
        )
        told.append(
            f"{lead} how some links go together; taken is {join_all_names(stand)}{more}: the sliding points ahead of "
            f"'through', else the upper assembly; sketch these points elsewhere to choose another"
        )
    if found.is_cut_off:
        told.append(
            "the search for the assembly nearest to the sketch stopped before it had tried all combinations and took "
            "the nearest so far; sketch more points to choose the one that is meant"
        )
    if setup.is_deflated:
        told.append(_second_order_remark(setup))
    return tuple(told)


def links_held_to_second_order(setup: PreparedMechanism) -> list[str]:
    """The links that constraints hold to second order only, and leave free to first order, all along the motion."""
    rows = setup.equations.rows
    touching = [
        stage for stage in setup.equations.blocks if any(row.kind is MeasureKind.PURE for row in rows[stage.rows])
    ]
    return list(dict.fromkeys(link for stage in touching for link in stage.links))


def _second_order_remark(setup: PreparedMechanism) -> str:
    links = links_held_to_second_order(setup)
    return (
        f"all along the motion the pairs hold link{'s' * (len(links) != 1)} {quote_names(links)} "
        f"to second order only; to first order more could move, so that a little play lets it move far"
    )


def _describe_block_position(setup: PreparedMechanism, candidates: BlockAssemblies, stage: Block, z: Array) -> str:
    """Where a point of a block is: C at [80, 50] mm; of a block without points, its links."""
    placed_here = [
        (name, link, point)
        for name, (level, link, point) in candidates.first_link.items()
        if level == stage.block_index
    ]
    if not placed_here:
        return f"one assembly of {quote_names(stage.links)}"
    name, link, point = max(placed_here, key=lambda each: len(_links_with_point(candidates, each[0])))
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p) * setup.scale
    frames, _ = frames_from_coordinates(w, setup.column, [link], {})
    length = parse_unit(setup.mechanism.units.length)
    at = [f"{length.from_si(float(each)):.4g}" for each in frames[link].to_world(setup.shapes[link].position(point))]
    return f"{name} at [{', '.join(at)}] {setup.mechanism.units.length}"


def _links_with_point(candidates: BlockAssemblies, name: str) -> list[str]:
    """The links that carry a point: of those that could be named, one that several share says most."""
    return [link for link, points in candidates.points_of.items() if any(name == each for _, each in points)]
