"""Every real assembly of a mechanism at given inputs, as a list that is made as it is read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib.util import find_spec
from itertools import islice
from math import hypot, prod, sqrt
from typing import Any, NamedTuple, overload

import numpy as np

from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.search_tree import BEST_TO_WORST, AssemblyPath, AssemblyTree
from planar.document.first_argument import takes_mechanism
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.symbolic_equations import slice_length
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.geometry import Frame
from planar.foundation.notebook_display import Displayable
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import ComputationEnded, interrupted, time_is_over, time_limit
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Drive, Mechanism, NamedPoint, named_points, replace_inputs
from planar.model.wording import count_phrase, join_all_names
from planar.results.motion import State
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver, solve, solved_mechanism

MAX_SOLVED_FOR_COUNT = 4096
"""Dyads, or larger groups by what they take, that are solved for the sake of a number alone."""
MAX_CERTIFIED_FOR_CLAIM = 256
"""The same, certified, for the sake of a claim about the whole list."""

MAX_PRINTED, MAX_PRINTED_POINTS = 5, 4
"""Assemblies that `print` lists, and the last points of each."""


@takes_mechanism
def modes(
    mechanism: Mechanism,
    drives: Mapping[str, float] | Sequence[Drive] = (),
    *,
    certify: bool = True,
    timeout: float | None = None,
) -> Modes:
    """Every real assembly of a mechanism at its inputs; one beyond a stop is listed too, with the outcome "stop".

    `drives` change inputs, as {pair: position} (rad or m). With `certify` every assembly is proved by intervals, group
    after group: dimensions, inputs and the groups before it are taken as the floats they are. It needs python-flint.
    With a `timeout` (s) the list is made at once, and ends after so long, or by a Ctrl-C, with the first assemblies and
    the outcome "interrupted".

    Raises NoAnswer where inputs leave links free whatever the dimensions, BadInput where pairs may stay open.

    >>> import planar
    >>> len(planar.modes(planar.load("four-bar"), certify=False))
    2
    """
    if isinstance(drives, Mapping):
        drives = [Drive(pair)._replace(position=position) for pair, position in drives.items()]
    solver = solved_mechanism(mechanism).solver
    if any(stage.is_free for stage in solver.equations.blocks):
        raise refusals.free_links(solver)
    solver.refuse_misfit("the assemblies are not listed")
    moved = tuple(drives)
    solver = solver.with_inputs_of(replace_inputs(mechanism, moved)) if moved else solver
    listed = Modes(solver, mechanism, moved, certify)
    if timeout is not None:
        with time_limit(timeout):
            listed.read()
    return listed


class ModesBlock(NamedTuple):
    """One group of links that are assembled together, those before it given.

    `expected` complex solutions are there by the count for this structure (None: it is not known), `found` of them
    were; `real` are assemblies. Where the group hangs on choices before it these are the least and the most.
    """

    links: tuple[str, ...]
    pairs: tuple[str, ...]
    expected: int | None
    found: tuple[int, int]
    real: tuple[int, int]
    complete: Completeness
    curve: bool
    "whether its links can move, the inputs held: a curve of assemblies"
    method: str
    solved: int
    "for how many of the choices before it"


class Modes(Displayable, Sequence["Mode"]):
    """All assemblies in a fixed order, which does not depend on the sketch: group after group of links.

    The list is made as it is read, one assembly after another. `len()` counts without listing: groups that do not
    depend on each other are multiplied, and groups that are joined to congruent positions are counted once. Where even
    that takes more than a few thousand groups, `total` is None, `len()` raises TypeError and `bound` is an upper bound.

    A list that a time limit or a Ctrl-C ended has the first assemblies alone: its `outcome` is "interrupted", `reason`
    says why, `total` is None and `len()` is how many are listed.
    """

    def __init__(self, solver: PositionSolver, mechanism: Mechanism, drives: tuple[Drive, ...], certify: bool):
        self._solver, self._source_mechanism, self._drives = solver, mechanism, drives
        self._certify = certify
        self._lacks_certifier = certify and find_spec("flint") is None
        self._tree = AssemblyTree(solver, certify and not self._lacks_certifier)
        self._uncertified_tree = AssemblyTree(solver, False) if self._tree.certify else self._tree  # to count with
        self._paths = self._tree.paths()
        self._ended = False
        self._listed: list[Mode] = []
        self._interruption = ""

    def __repr__(self) -> str:
        if self._interruption:
            count = f"{len(self._listed)} listed, {Outcome.INTERRUPTED}"
        else:
            count = "more than are counted" if self.total is None else str(self.total)
        return f"<Modes of {self.mechanism.name!r} {self._solver.describe_position()}: {count}>"

    def __str__(self) -> str:
        lines = [repr(self)]
        for mode in islice(self, MAX_PRINTED):
            last = list(mode.points.items())[-MAX_PRINTED_POINTS:]
            places = ", ".join(f"{name} ({at[0]:.6g}, {at[1]:.6g})" for name, at in last)
            lines.append(f"{mode.number}: {'..., ' if len(mode.points) > len(last) else ''}{places} m")
        if self.total is None or self.total > MAX_PRINTED:
            lines.append("..." if self.total is None else f"and {self.total - MAX_PRINTED} more")
        return "\n".join(lines)

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled equations stay in their process: another one lists them again
        return partial(modes, certify=self._certify), (self._source_mechanism, self._drives)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism at the inputs of these assemblies."""
        return self._solver.mechanism

    @property
    def scale(self) -> Array:
        """The units of all coordinates (coordinates,), m or rad, in which the unknowns of modes are."""
        return self._solver.scale

    def __iter__(self) -> Iterator[Mode]:
        number = 0
        while self._list_up_to(number + 1):
            yield self._listed[number]
            number += 1

    @overload
    def __getitem__(self, index: int) -> Mode: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Mode]: ...
    def __getitem__(self, index: int | slice) -> Mode | Sequence[Mode]:
        if isinstance(index, slice):
            ends = [end for end in (index.start, index.stop) if end is not None]
            if index.stop is None or min(ends) < 0 or (index.step or 1) < 0:
                return [self[k] for k in range(*index.indices(len(self)))]
            self._list_up_to(index.stop)
            return self._listed[index]
        if index < 0:
            index += len(self)
        if index < 0 or not self._list_up_to(index + 1):
            raise IndexError(f"there are {count_phrase(len(self._listed), 'assembly', 'assemblies')}")
        return self._listed[index]

    def __bool__(self) -> bool:
        return self._list_up_to(1)

    def __len__(self) -> int:
        if self._interruption:
            return len(self._listed)
        if self.total is None:
            bound = "" if self.bound is None else f": up to {self.bound}"
            raise TypeError(f"there are more assemblies than are listed for their number{bound}; read them one by one")
        return self.total

    @property
    def total(self) -> int | None:
        """How many assemblies there are; None where that cannot be told by solving a few thousand groups."""
        if self._ended:
            return len(self._listed)
        try:
            return None if self._interruption else self._counted_total
        except ComputationEnded:
            return None

    @cached_property
    def _counted_total(self) -> int | None:
        return self._uncertified_tree.count(MAX_SOLVED_FOR_COUNT)

    @property
    def bound(self) -> int | None:
        """How many complex solutions there may be: the product over the groups; None where one is not known."""
        every = self._expected
        known = [each for each in every if each is not None]
        return prod(known) if len(known) == len(every) else None

    @property
    def _expected(self) -> list[int | None]:
        """Of every group how many complex solutions its structure has."""
        self._list_up_to(1)
        solved = [self._tree.solved_roots(index) for index in range(len(self._tree.stages))]
        return [_maximum_if_known([each.expected for each in of]) if of else None for of in solved]

    @property
    def complete(self) -> Completeness:
        """Whether the list, read to its end, is the whole: as the worst of the groups for whatever choices before them.

        All are solved for that, the first few hundred certified; of more than a few thousand it is not known.
        """
        try:
            if not self._interruption and (self._ended or self._tree.count(MAX_CERTIFIED_FOR_CLAIM) is not None):
                return self._tree.complete
        except ComputationEnded:
            return Completeness.NOT
        return Completeness.NOT if self.total is None else self._uncertified_tree.complete

    @property
    def groups(self) -> tuple[ModesBlock, ...]:
        """The groups of links in the order in which they are assembled, with what has been found of them so far."""
        self._list_up_to(1)
        found = []
        for index, stage in enumerate(self._tree.stages):
            solved = self._tree.solved_roots(index)
            if not solved or not slice_length(stage.unknowns):
                continue
            counts = [each.found for each in solved]
            real = [len(each.real) for each in solved]
            worst = max(solved, key=lambda each: BEST_TO_WORST.index(each.complete))
            found.append(
                ModesBlock(
                    stage.links,
                    stage.pairs,
                    _maximum_if_known([each.expected for each in solved]),
                    (min(counts), max(counts)),
                    (min(real), max(real)),
                    worst.complete,
                    any(each.has_curve for each in solved),
                    worst.method,
                    len(solved),
                )
            )
        return tuple(found)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say of the list: how the groups were solved, and what is not proved."""
        how: dict[str, list[int]] = {}
        for number, group in enumerate(self.groups, start=1):
            how.setdefault(group.method, []).append(number)
        told = [f"group{'s' * (len(of) > 1)} {_number_ranges(of)}: {method}" for method, of in how.items()]
        if self._interruption:
            told.insert(0, f"not all assemblies are listed, as {self._interruption}")
        if any(group.curve for group in self.groups):
            told.append(
                "some links can move while the inputs are held: of each curve of assemblies that was found one place "
                "is listed, with what goes together there"
            )
        if self._solver.structure.counts:
            told.append("of angles that count turns the least are taken")
        if self._lacks_certifier:
            told.append('nothing is certified: that needs python-flint (pip install "planar-linkages[modes]")')
        return tuple(told)

    @property
    def outcome(self) -> Outcome:
        """How the list ended: solved, interrupted by a time limit or a Ctrl-C, or that there is no assembly."""
        is_found = bool(self)
        if self._interruption:
            return Outcome.INTERRUPTED
        return Outcome.SOLVED if is_found else self.refusal().outcome

    @property
    def reason(self) -> str:
        """Why there is no assembly, or why the list ended early; empty where neither is so."""
        is_found = bool(self)
        return self._interruption or ("" if is_found else self._refusal_reason)

    @cached_property
    def _refusal_reason(self) -> str:
        return self.refusal().reason

    def refusal(self) -> NoAnswer:
        """The same to be raised, where there is no assembly."""
        if self._interruption:
            return interrupted(self._interruption, "before an assembly was reached")
        moving = () if self else self._tree.moving_links()
        if moving:
            return NoAnswer(
                Outcome.CHANGE_POINT,
                f"{self._solver.describe_position()} {join_all_names(moving)} can move while the inputs are held; what "
                "comes after does not go together with the places of theirs that were tried, but may with others: move "
                "the input, or give one more",
            )
        try:
            self._solver.state(self._solver.find_assembly().z)
        except NoAnswer as problem:
            return solved_mechanism(self._solver.mechanism).structure_refusal(problem) or problem
        return NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, f"{self._solver.describe_position()} no assembly was found")

    @cached_property
    def places(self) -> dict[str, int]:
        """Every named point, and after which of the groups it stands (from 0; -1 where the inputs alone say so)."""
        return {name: level for name, (level, _, _) in self._solver.structure.point_locations.first_link.items()}

    @property
    def nearest(self) -> Mode | None:
        """The assembly that the sketch means, or to which it leads where inputs are moved; None where it is none, or
        was not reached in time."""
        try:
            return self._nearest
        except ComputationEnded:
            return None

    @cached_property
    def _nearest(self) -> Mode | None:
        try:
            if self._drives:
                state = solve(self._source_mechanism, self._drives)
                z = self._solver.coordinates(state.frames, state.own)[list(self._solver.equations.unknowns)]
            else:
                z = solved_mechanism(self._source_mechanism).assembly.z
        except NoAnswer:
            return None
        path = self._tree.path_to(z)
        if path is None:
            return None
        number = self._uncertified_tree.count_before(path, MAX_SOLVED_FOR_COUNT)
        return self._mode(None if number is None else number + 1, path)

    def read(self) -> None:
        """List all assemblies, as far as there is time."""
        while self._list_up_to(len(self._listed) + 1):
            pass

    def _list_up_to(self, number: int) -> bool:
        """Whether there are so many assemblies; they are listed up to there."""
        while len(self._listed) < number:
            if not self._ended and not self._interruption:
                self._interruption = time_is_over()
            if self._interruption:
                return False
            try:
                path = next(self._paths, None)
            except ComputationEnded:
                self._interruption = time_is_over()
                return False
            except BaseException:  # a list that was interrupted has not ended: it is taken up again where it was
                self._paths = islice(self._tree.paths(), len(self._listed), None)
                raise
            if path is None:
                self._ended = True
                return False
            self._listed.append(self._mode(len(self._listed) + 1, path))
        return True

    def _mode(self, number: int | None, path: AssemblyPath) -> Mode:
        shown = [
            rank + 1
            for stage, rank in zip(self._tree.stages, path.choices, strict=True)
            if slice_length(stage.unknowns)
        ]
        return Mode(number, tuple(shown), path.certified, path.double, path.z, self._solver)


def _number_ranges(numbers: Sequence[int]) -> str:
    """Numbers that rise: 1 to 4, 6 and 8."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    told = [[f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(each) for each in run] for run in runs]
    return join_all_names([each for part in told for each in part])


def _maximum_if_known(numbers: Sequence[int | None]) -> int | None:
    """The greatest number; None where one is not known."""
    known = [each for each in numbers if each is not None]
    return max(known) if len(known) == len(numbers) else None


@dataclass(frozen=True, eq=False)
class Mode:
    """One assembly. Its number counts from 1, None where counting so far would take too long."""

    number: int | None
    choices: tuple[int, ...]
    "of every group the number of its assembly, those of the groups before it given"
    certified: bool
    "whether of every group this one is proved to be there, alone, for all numbers as the floats they are"
    double: bool
    "whether two assemblies meet here: a dead point"
    z: Array
    "(unknowns,) of the equations"
    _solver: PositionSolver

    __repr__ = short_repr

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled equations stay in their process: another one makes them again
        of = (self.number, self.choices, self.certified, self.double, self.z)
        return _restore_mode, (of, self._solver.mechanism)

    @cached_property
    def _state_or_refusal(self) -> State | NoAnswer:
        try:
            return self._solver.state(self.z, self._solver.mechanism.remarks)
        except NoAnswer as problem:
            return problem

    @property
    def state(self) -> State | None:
        """The solved position with its rates; None where these are not determined, for which `reason` says why."""
        return self._state_or_refusal if isinstance(self._state_or_refusal, State) else None

    @property
    def outcome(self) -> Outcome:
        """Solved, or why there is no state."""
        return self._state_or_refusal.outcome if isinstance(self._state_or_refusal, NoAnswer) else Outcome.SOLVED

    @property
    def reason(self) -> str:
        """Why there is no state; empty where there is one."""
        return self._state_or_refusal.reason if isinstance(self._state_or_refusal, NoAnswer) else ""

    @property
    def is_beyond_stop(self) -> bool:
        """Whether a pair is beyond its stop: no motion starts there, though the dimensions allow the assembly."""
        return not self._solver.is_inside_stops(self.z)

    @property
    def shapes(self) -> dict[str, LinkShape]:
        """The points of every link in its own axes (m)."""
        return self._solver.shapes

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """Where every link is (m, rad), without rates."""
        setup = self._solver
        w = setup.functions.coordinates(self.z, setup.inputs.u, setup.inputs.p) * setup.scale
        return frames_from_coordinates(w.tolist(), setup.column, setup.shapes, {})[0]

    @cached_property
    def points(self) -> dict[str, Array]:
        """Where every named point is (2,) (m)."""

        def at(named: NamedPoint) -> Array:
            link, point = named.members[0]
            return np.array([*self.frames[link].to_world(self.shapes[link].position(point))], dtype=float)

        return {each.name: at(each) for each in named_points(self._solver.mechanism)}

    @property
    def distance(self) -> float | None:
        """How far the sketched points are from the sketch (m), the root of the mean square; None without a sketch."""
        sketch = self._solver.mechanism.sketch
        gaps = [hypot(self.points[name][0] - x, self.points[name][1] - y) for name, x, y in sketch]
        return sqrt(sum(gap * gap for gap in gaps) / len(gaps)) if gaps else None

    @cached_property
    def mechanism(self) -> Mechanism:
        """The same mechanism, its sketch this assembly with every named point: what solves it takes this one.

        Where angles count turns assemblies may differ in these alone; then the one with the places sketched is taken.
        """
        sketch = tuple((name, float(at[0]), float(at[1])) for name, at in self.points.items())
        return replace(self._solver.mechanism, sketch=sketch)


def _restore_mode(of: tuple[int | None, tuple[int, ...], bool, bool, Array], mechanism: Mechanism) -> Mode:
    """A mode where it has been sent to."""
    return Mode(*of, solved_mechanism(mechanism).solver)
