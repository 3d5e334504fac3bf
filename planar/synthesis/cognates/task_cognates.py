"""The cognates of a design that do the same task."""

from __future__ import annotations

from planar.foundation.errors import PlanarError
from planar.model.mechanism import Mechanism
from planar.synthesis.cognates.cognates import Cognate, cognates
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedPath
from planar.synthesis.task.wanted_expressions import carried_name


def task_cognates(mechanism: Mechanism, task: SynthesisTask) -> tuple[Cognate, ...]:
    """Other linkages that do the task as this one does: where it wants the path of one point and nothing else.

    Of a path whose timing is prescribed those that keep it, else all.
    """
    paths = [each for each in task.wanted if isinstance(each, WantedPath)]
    points = {each.point for each in paths}
    if len(paths) < len(task.wanted) or len(points) != 1:
        return ()
    try:
        found = cognates(mechanism, carried_name(mechanism, points.pop()))
    except PlanarError:
        return ()  # it has none
    if all(each.inputs is None for each in paths):
        return tuple(found[1:])
    return tuple(each for each in found.timed if all(one.scale == 1.0 for one in each.inputs))
