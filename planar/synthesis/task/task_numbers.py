"""The numbers of the mechanisms that a task starts from: their names and kinds, as tasks name them."""

from __future__ import annotations

from collections.abc import Sequence

from planar.derivatives.design_equations import design_dimensions
from planar.document.dimensions import Dimension
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.wording import amount
from planar.synthesis.task.starts import with_wanted_points
from planar.synthesis.task.synthesis_task import ChainStart, SynthesisTask, Wanted, WantedFunction, WantedPath


def start_numbers(mechanism: Mechanism, wanted: Sequence[Wanted]) -> dict[str, Dimension]:
    """The numbers of a start's links and pairs by name; those of wanted points are coordinates, however it wrote
    them."""
    paths = tuple(each for each in wanted if isinstance(each, WantedPath))
    ready = with_wanted_points(mechanism, SynthesisTask("", paths, (mechanism,)), {})
    points = {each.point for each in paths}
    members = {each.name: each.members for each in named_points(ready)}
    own = tuple(f"{link}.{point}." for name in points for link, point in members.get(name, ()))
    found = {each.name: each for each in design_dimensions(mechanism) if not each.name.startswith(own)}
    found |= {each.name: each for each in design_dimensions(ready) if each.name.startswith(own)}
    return {name: each for name, each in found.items() if each.path[0] in ("links", "pairs")}


def motion_kind(mechanism: Mechanism, pair: str) -> str:
    """Whether the position of a relative motion is a "length" or an "angle"."""
    return relative_motions(mechanism)[pair].input_quantity_kinds()[0]


def task_motion_kind(task: SynthesisTask, pair: str | None = None) -> str:
    """That of a pair of a task's starts, or of the running input; angles are those of chains, and of what is not
    there."""
    if isinstance(task.starts, ChainStart) or not task.starts:
        return "angle"
    first = task.starts[0]
    name = pair or first.inputs[0].pair
    return motion_kind(first, name) if name in relative_motions(first) else "angle"


def wanted_miss_kind(task: SynthesisTask, wanted: Wanted) -> str:
    """What a miss of a wanted item is: a "length", or an "angle" where it is a function whose values are angles."""
    return task_motion_kind(task, wanted.to_pair) if isinstance(wanted, WantedFunction) else "length"


def miss_kind(task: SynthesisTask) -> str:
    """What misses of a task are together: an "angle" where all of them are."""
    return "angle" if all(wanted_miss_kind(task, each) == "angle" for each in task.wanted) else "length"


def miss_text(task: SynthesisTask, miss: float, size: float) -> str:
    """A miss of a task with its unit: 0 where it is round-off of the size (m) of what is wanted, or of a radian."""
    kind = miss_kind(task)
    return amount(miss, kind, task.units, size if kind == "length" else 1.0)
