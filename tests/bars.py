"""Linkages of bars between pins."""

import planar


def bars(frame: dict, links: dict, driven: tuple[str, float], sketch: dict | None = None) -> planar.Mechanism:
    """A linkage of bars between pins: {name: (end, end, length)}; a pin is wherever two links name it."""
    value = {
        "planar": 1,
        "name": "bars",
        "units": {"length": "m", "angle": "rad"},
        "frame": "frame",
        "links": {"frame": {"points": frame}}
        | {name: {"ends": [a, b], "length": length} for name, (a, b, length) in links.items()},
        "pairs": [{"turning": pin} for pin in dict.fromkeys(end for a, b, _ in links.values() for end in (a, b))],
        "inputs": [{"pair": driven[0], "position": driven[1], "velocity": 1.0}],
        "sketch": sketch or {},
    }
    value["pairs"] = [
        pair
        for pair in value["pairs"]
        if sum(pair["turning"] in each[:2] for each in links.values()) + (pair["turning"] in frame) > 1
    ]
    return planar.from_dict(value)


def four_bar(crank: float, coupler: float, rocker: float, ground: float, at: float) -> planar.Mechanism:
    links = {"crank": ("A", "B", crank), "coupler": ("B", "C", coupler), "rocker": ("D", "C", rocker)}
    return bars({"A": [0.0, 0.0], "D": [ground, 0.0]}, links, ("A", at))


def tower(many: int) -> planar.Mechanism:
    """Triangles one on a side of the other, each of which can be turned over: two assemblies each, whatever before."""
    links = {"crank": ("A", "B", 1.0)}
    ends = ["A", "B"]
    for k in range(many):
        new = f"P{k}"
        links |= {f"a{k}": (ends[-2], new, 1.1), f"b{k}": (ends[-1], new, 0.9)}
        ends.append(new)
    return bars({"A": [0.0, 0.0]}, links, ("A:frame,crank" if many else "A", 1.0))
