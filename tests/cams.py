"""Cams with followers of every kind, as documents."""

from typing import Any

LAW = [
    {"motion": "cycloidal", "by": 20.0, "in": 100},
    {"motion": "dwell", "in": 40},
    {"motion": "3-4-5", "by": -12.0, "in": 90},
    {"motion": "modified trapezoidal", "by": -8.0, "in": 70, "ramp": 0.2},
    {"motion": "dwell", "in": 60},
]
FOLLOWERS = ("roller", "point", "flat", "swinging roller", "swinging flat")


def cam_document(follower: str, *, clockwise: bool = False, **more: Any) -> dict[str, Any]:
    """A cam about the origin that turns at 10 rad/s, base circle 40 mm; `more` changes its pair's entry."""
    swings, flat = follower.startswith("swinging"), follower.endswith("flat")
    part = 0.5 if swings and flat else 1.0
    law = [piece | {"by": piece["by"] * part} if "by" in piece else piece for piece in LAW]
    entry: dict[str, Any] = {"cam": "K", "links": ["cam", "follower"], "law": law, "start": 25}
    entry |= {"point": "P", "centre": "O", "base_radius": 40}
    if clockwise:
        entry["clockwise"] = True
    if swings:
        ground = {"O": [0, 0], "C": [-90, 15]}
        guide: dict[str, Any] = {"turning": "C", "links": ["ground", "follower"]}
        points = {"C": [0, 0], "P": [80, 20] if not flat else [40, -5]}
        entry |= {"pivot": "C"} | ({"flat": 95} if flat else {"roller_radius": 10})
    else:
        ground = {"O": [0, 0], "G": [12, 0]}
        guide = {"sliding": "S", "links": ["ground", "follower"], "line": {"through": "G", "angle": 90}, "point": "P"}
        points = {"P": [0, 0]}
        entry["line"] = {"through": "G", "angle": 90}
        entry |= {"roller": {"roller_radius": 10}, "point": {}, "flat": {"flat": 0}}[follower]
    return {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "ground",
        "links": {
            "ground": {"points": ground},
            "cam": {"points": {"O": [0, 0]}},
            "follower": {"points": points},
        },
        "pairs": [{"turning": "O", "links": ["ground", "cam"]}, guide, entry | more],
        "inputs": [{"pair": "O", "position": 60, "velocity": "10 rad/s"}],
        "sketch": {"P": [12, 60]},
    }
