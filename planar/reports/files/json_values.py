"""Results as JSON values, in SI units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from planar.analysis.worked.published import Comparison
from planar.foundation.errors import Outcome
from planar.results.motion import State
from planar.results.records import RelativeState


def record(
    state: State, comparisons: Iterable[Comparison] = (), relatives: Mapping[str, RelativeState] | None = None
) -> dict[str, Any]:
    """A solved position: every link, point and pair by name, and the relative motions that are asked for."""
    found: dict[str, Any] = {
        "mechanism": state.mechanism.name,
        "outcome": Outcome.SOLVED.value,
        "mobility": state.mobility,
        "residual": state.residual,
        "inputs": {name: given._asdict() for name, given in state.inputs.items()},
        "links": {name: link._asdict() for name, link in state.links.items()},
        "points": {
            name: {
                "position": point.position.tolist(),
                "velocity": point.velocity.tolist(),
                "acceleration": point.acceleration.tolist(),
                "sense": point.sense,
            }
            for name, point in state.points.items()
        },
        "pairs": state.pairs,
        "remarks": list(state.remarks),
    }
    if state.misfits:
        found["misfits"] = {name: float(each) for name, each in state.misfits.items()}
    published = [each.record() for each in comparisons]
    relative = {
        text: {name: part if isinstance(part, str) else part.tolist() for name, part in each._asdict().items()}
        for text, each in (relatives or {}).items()
    }
    return found | ({"published": published} if published else {}) | ({"relative": relative} if relative else {})
