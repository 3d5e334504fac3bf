"""What is to be said of how an assembly was chosen."""

from __future__ import annotations

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.equations.functions import placed
from planar.foundation.units import unit
from planar.model.pairs import Kind
from planar.model.wording import listed, many, quoted
from planar.solving.assembly import nearest_assembly
from planar.solving.assembly.block_assemblies import Candidates
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

MOST = 4
"""Groups of links that are named one by one."""


def remarks(setup: Setup, candidates: Candidates, found: Assembly) -> tuple[str, ...]:
    """Sentences on groups whose assembly the sketch leaves open: how they stand, and how to choose."""
    open_ones = [setup.equations.stages[index] for index in found.ties]
    told = []
    if open_ones:
        lead = "the sketch leaves open" if setup.mechanism.sketch else "there is no sketch to say"
        stand = [_stands(setup, candidates, stage, found.z) for stage in open_ones[:MOST]]
        more = f", and so on for {many(len(open_ones) - MOST, 'more group')}" if len(open_ones) > MOST else ""
        told.append(
            f"{lead} how some links go together; taken is {listed(stand)}{more}: the sliding points ahead of "
            f"'through', else the upper assembly; sketch these points elsewhere to choose another"
        )
    if found.stopped:
        told.append(
            f"the search for the assembly nearest to the sketch stopped after {nearest_assembly.EXPANSIONS} groups and "
            f"took the nearest on its way; sketch more points to be sure of the one that is meant"
        )
    if setup.deflated:
        told.append(_touching(setup))
    return tuple(told)


def _touching(setup: Setup) -> str:
    """What to say of constraints that hold to second order what they leave free to first order, all along."""
    rows = setup.equations.rows
    touching = [stage for stage in setup.equations.stages if any(row.kind is Kind.PURE for row in rows[stage.rows])]
    links = list(dict.fromkeys(link for stage in touching for link in stage.links))
    return (
        f"all along the motion the pairs hold link{'s' * (len(links) != 1)} {quoted(links)} "
        f"to second order only; to first order more could move, so that a little play lets it move far"
    )


def _stands(setup: Setup, candidates: Candidates, stage: Stage, z: Array) -> str:
    """Where a point of a group is: C at [80, 50] mm; of a group without points, its links."""
    placed_here = [
        (name, link, point) for name, (level, link, point) in candidates.first.items() if level == stage.level
    ]
    if not placed_here:
        return f"one assembly of {quoted(stage.links)}"
    name, link, point = max(placed_here, key=lambda each: len(_sharing(candidates, each[0])))
    w = setup.program.coordinates(z, setup.station.u, setup.station.p) * setup.scale
    frames, _ = placed(w, setup.column, [link], {})
    length = unit(setup.mechanism.units.length)
    at = [f"{length.from_si(float(each)):.4g}" for each in frames[link].carry(setup.shapes[link].at(point))]
    return f"{name} at [{', '.join(at)}] {setup.mechanism.units.length}"


def _sharing(candidates: Candidates, name: str) -> list[str]:
    """The links that carry a point: of those that could be named, one that several share says most."""
    return [link for link, points in candidates.points_of.items() if any(name == each for _, each in points)]
