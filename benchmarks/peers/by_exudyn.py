"""Exudyn: rigid bodies and joints, its static solver from load step to load step."""

from __future__ import annotations

import exudyn
import numpy as np
from exudyn import itemInterface as item  # noqa: N813

from benchmarks.entry import Array, Entry
from benchmarks.peers.bodies import bodies
from benchmarks.swept.base import Swept

SYSTEM = "Exudyn"


def entries(swept: Swept, theta: Array) -> list[Entry]:
    """Positions of the file's own design: every constraint holds at every load step, and nothing else is asked.

    Rates would come from a run in time, with its own errors, and are left out.
    """
    told = bodies(swept.document())
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    ground = system.AddObject(item.ObjectGround())
    nodes, held = {}, {told.frame: ground}
    for name, place in told.places.items():
        nodes[name] = system.AddNode(item.NodeRigidBody2D(referenceCoordinates=list(place)))
        body = item.ObjectRigidBody2D(physicsMass=1.0, physicsInertia=1.0, nodeNumber=nodes[name])
        held[name] = system.AddObject(body)

    def marker(name: str, at: tuple[float, float]) -> object:
        return system.AddMarker(item.MarkerBodyPosition(bodyNumber=held[name], localPosition=[*at, 0.0]))

    for joint in told.joints:
        ends = [marker(joint.first, joint.at_first), marker(joint.second, joint.at_second)]
        system.AddObject(item.ObjectJointRevolute2D(markerNumbers=ends))
    still = system.AddNode(item.NodePointGround())
    ends = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=still, coordinate=0)),
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[told.joints[told.driven].second], coordinate=2)),
    ]
    whole = float(theta[-1] - theta[0])

    def turned(_system: object, t: float, _number: int, _offset: float) -> float:
        return whole * t

    system.AddObject(item.ObjectConnectorCoordinate(markerNumbers=ends, offset=0.0, offsetUserFunction=turned))
    body, at = told.points[swept.point]
    position = exudyn.OutputVariableType.Position
    asked = item.SensorBody(
        bodyNumber=held[body], localPosition=[*at, 0.0], storeInternal=True, outputVariableType=position
    )
    sensor = system.AddSensor(asked)
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.staticSolver.numberOfLoadSteps = len(theta) - 1
    settings.staticSolver.adaptiveStep = False
    settings.staticSolver.newton.relativeTolerance = 1e-12
    settings.staticSolver.newton.absoluteTolerance = 1e-12
    settings.staticSolver.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1e-9

    def solve() -> Array:
        system.SolveStatic(settings, updateInitialValues=False)
        return system.GetSensorStoredData(sensor)

    steps = np.arange(1, len(theta))
    return [Entry(SYSTEM, False, np.arange(1), steps, solve, lambda found: found[-len(steps) :, 1:3].T[..., None])]
