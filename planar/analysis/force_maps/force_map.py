"""Efforts and reactions over a grid of positions of several inputs, and the worst cases among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod

import numpy as np

from planar.analysis.force_maps.grid_forces import GridForces
from planar.analysis.force_maps.worst_cases import WorstCase, WorstCaseSearch
from planar.document.first_argument import takes_mechanism
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import BadInput, Outcome, join_names
from planar.foundation.time_limit import stops_in_time
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.input_grid import InputGrid
from planar.solving.position import solved_mechanism

MAX_POSITIONS = 1_000_000
"""Positions of a grid at most."""
USUAL_COUNTS = (181, 41, 13)
"""Positions along each input, of one, two, three and more."""


@dataclass(frozen=True, eq=False)
class ForceMap:
    """Forces over a grid of the positions of inputs, on the assembly to which the motion from the file's own leads.

    `over["O"]` (m,) are the positions of each input of the grid (rad, m), in the order of the axes of all arrays;
    other inputs stay where the file has them. `effort["O"]` (...) is what an input supplies (N m, at a slide N),
    `reaction["B"]` (..., 2) the force of a pair on its second link (N) and `couple["B"]` (...) its couple (N m), as
    `planar.forces` has them; NaN where the position is not reached, or equilibrium does not tell. `is_reached` (...)
    says which are, and `outcome(node)` why one is not. `worst` are the worst cases, solved for between the positions.
    `forces` are all of them as forces over a motion whose rows are the positions that are reached.
    """

    over: Mapping[str, Array]
    forces: Forces
    nodes: IntArray
    "(rows, axes): which position of each input every row of `forces` has"
    outcomes: IntArray
    worst: tuple[WorstCase, ...]

    def __repr__(self) -> str:
        told = f"{len(self.nodes)} of {prod(self.shape)} positions over {join_names(self.over)}"
        return f"<ForceMap of {self.mechanism.name!r}: {told}>"

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return self.forces.mechanism

    @property
    def motion(self) -> Motion:
        """The positions that are reached, side by side."""
        assert isinstance(self.forces.moving, Motion)
        return self.forces.moving

    @property
    def shape(self) -> tuple[int, ...]:
        """How many positions there are of each input."""
        return tuple(len(each) for each in self.over.values())

    @property
    def is_reached(self) -> BoolArray:
        """Which positions the motion comes to (...)."""
        return np.asarray(self.outcomes == [*Outcome].index(Outcome.SOLVED))

    def outcome(self, node: Sequence[int]) -> Outcome:
        """What lies before a position that is not reached: a dead point, a stop; of one that is: solved."""
        found: Outcome = list(Outcome)[int(self.outcomes[tuple(node)])]
        return found

    @cached_property
    def effort(self) -> Mapping[str, Array]:
        """What each input supplies (...)."""
        return {name: self._on_grid(np.asarray(each)) for name, each in self.forces.inputs.items()}

    @cached_property
    def reaction(self) -> Mapping[str, Array]:
        """The force of each pair on its second link (..., 2)."""
        return {name: self._on_grid(np.asarray(each.force)) for name, each in self.forces.reactions.items()}

    @cached_property
    def couple(self) -> Mapping[str, Array]:
        """The couple of each pair (...)."""
        return {name: self._on_grid(np.asarray(each.couple)) for name, each in self.forces.reactions.items()}

    def _on_grid(self, rows: Array) -> Array:
        found = np.full((*self.shape, *rows.shape[1:]), np.nan)
        found[tuple(self.nodes.T)] = rows
        return found


Range = tuple[float, float, int] | tuple[float, float] | int | None


@takes_mechanism
@stops_in_time
def force_map(
    mechanism: Mechanism,
    over: Mapping[str, Range] | Sequence[str],
    inertia: bool = True,
    friction: bool = True,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> ForceMap:
    """Forces over a grid of positions of one or several inputs, with the worst cases.

    `over` names the inputs, each with (start, stop, count) or (start, stop) in rad or m; with a count or None, or as a
    mere list of names, a range is that of the pair's stops, else that of `planar.cycle`. `inertia=False` leaves out the
    inertia of the links, `friction=False` the friction of the pairs. Every position is followed from the file's own;
    those beyond a dead point or a stop are not reached. Of every input the greatest and the least effort, of every pair
    the greatest force and couple are solved for between the positions, and where one grows without bound it is said
    towards which dead point; dead points are looked for along the lines of the grid.

    Raises BadInput for another input or range, and more than a million positions; NoAnswer where none is reached or
    nothing can move, and after `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> arm = planar.load("excavator-arm")
    >>> found = planar.force_map(arm, {"boom cylinder": (2.4, 2.6, 5), "stick cylinder": (2.9, 3.1, 3)}, inertia=False)
    >>> found.effort["boom cylinder"].shape
    (5, 3)
    """
    known = solved_mechanism(mechanism)
    known.check_motion()
    axes = _read_ranges(mechanism, over)
    solver = known.solver
    columns = [[given.pair for given in mechanism.inputs].index(name) for name in axes]
    scales = [solver.unit if solver.is_sliding(name) else 1.0 for name in axes]
    grid = InputGrid(
        solver, known.assembly.z, columns, [axis / scale for axis, scale in zip(axes.values(), scales, strict=True)]
    )
    nodes = np.argwhere(grid.is_reached)
    u = np.array([grid.inputs_at(tuple(node)) for node in nodes.tolist()])
    z = grid.z[grid.is_reached]
    maker = GridForces(solver, known.assembly, inertia, friction)
    found = maker.forces(maker.motion(z, u))
    worst = WorstCaseSearch(maker, grid, nodes, u, z, found).worst_cases()
    return ForceMap(axes, found, nodes, grid.outcomes(), worst)


def _read_ranges(mechanism: Mechanism, over: Mapping[str, Range] | Sequence[str]) -> dict[str, Array]:
    """The positions of each input."""
    given = dict(over) if isinstance(over, Mapping) else dict.fromkeys([over] if isinstance(over, str) else over)
    names = [each.pair for each in mechanism.inputs]
    if not given:
        raise BadInput("over", f"name the inputs that run, of {join_names(names)}")
    usual = USUAL_COUNTS[min(len(given), len(USUAL_COUNTS)) - 1]
    found: dict[str, Array] = {}
    for name, limits in given.items():
        if name not in names:
            raise BadInput("over", f"{name!r} is no input; inputs are at {join_names(names)}")
        found[name] = np.linspace(*_read_range(mechanism, name, limits, usual))
    if prod(map(len, found.values())) > MAX_POSITIONS:
        raise BadInput("over", f"{prod(map(len, found.values()))} positions are more than {MAX_POSITIONS}")
    return found


def _read_range(mechanism: Mechanism, name: str, limits: Range, usual: int) -> tuple[float, float, int]:
    """The first and the last position of an input, and how many. Raises BadInput."""
    wanted = f"give (start, stop, count) for {name!r}: two positions that differ (rad, m), and a whole number from 2 on"
    given = list(limits) if isinstance(limits, list | tuple) else [] if limits is None else [limits]
    if len(given) < 2:
        given = [*_whole_range(mechanism, name), *given]
    try:
        start, stop, count = *(float(each) for each in given[:2]), float(given[2] if len(given) > 2 else usual)
    except (TypeError, ValueError):
        raise BadInput("over", wanted) from None
    is_range = np.isfinite([start, stop]).all() and start != stop and len(given) <= 3
    if not is_range or count < 2 or not count.is_integer():
        raise BadInput("over", wanted)
    return start, stop, int(count)


def _whole_range(mechanism: Mechanism, name: str) -> tuple[float, float]:
    """Of an input whose range is left out: between its stops, else as `cycle` has it."""
    for each in mechanism.stops:
        if each.pair == name and each.low is not None and each.high is not None:
            return each.low, each.high
    motion: Motion = cycle(replace(mechanism, published=()), 8, pair=name)
    positions = motion.inputs[name].position
    return float(positions.min()), float(positions.max())
