"""Tasks of exact synthesis that several test files take, and the rows of their unknowns."""

import json
from functools import cache

import planar
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.task.starts import start_mechanisms

UNITS = {"length": "mm", "angle": "deg"}
POSES = [(0, 0, 0), (30, 20, 25), (70, 25, 60), (95, 5, 80)]


def task(start, *wanted, **more):
    return {"planar": 1, "units": UNITS, "start": start, "wanted": list(wanted)} | more


def with_points_on_coupler():
    start = planar.to_dict(planar.load("four-bar"))
    start["links"]["BC"] = {"points": {"B": [0, 0], "C": [66, 0]}}
    return start


def poses(count):
    return {"link": "BC", "poses": [{"at": [x, y], "angle": angle} for x, y, angle in POSES[:count]]}


def five_poses():
    return {"link": "BC", "poses": [*poses(4)["poses"], {"at": [110, -30], "angle": 95}]}


def family_of(value):
    """The first component of a task; made once, since nothing of it can be changed."""
    return _component_of(json.dumps(value))


@cache
def _component_of(text):
    wanted = planar.read_task(json.loads(text))
    (component, *_) = ExactProblem(wanted, next(iter(start_mechanisms(wanted)))).components
    return component
