"""The pictures of the guide, made by the tool: `python -m tests.guide_pictures` writes them anew."""

from collections.abc import Callable
from pathlib import Path

import planar
from planar import plot

FOLDER = Path(__file__).parents[1] / "planar" / "guide" / "pictures"
PLATE = {
    "planar": 1,
    "name": "Points of a link",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"B": [0, 0]}},
        "BC": {
            "ends": ["B", "C"],
            "length": 66,
            "points": {
                "E": {"along": ["B", "C"], "distance": 40},
                "H": {"along": ["B", "C"], "distance": 30, "angle": 90},
                "F": {"distances": {"B": 45, "C": 30}, "right_of": ["B", "C"]},
                "G": [20, -10],
            },
        },
    },
    "pairs": [{"turning": "B"}],
    "inputs": [{"pair": "B", "position": 15}],
}
WIPER = {
    "planar": 1,
    "name": "Wiper",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "car",
    "links": {
        "car": {"points": {"O": [0, 0], "Q": [250, 0]}},
        "crank": {"ends": ["O", "A"], "length": 40},
        "rod": {"ends": ["A", "B"], "length": 245},
        "arm": {"ends": ["Q", "B"], "length": 60, "points": {"T": {"along": ["Q", "B"], "distance": 420}}},
    },
    "pairs": [{"turning": "O"}, {"turning": "A"}, {"turning": "B"}, {"turning": "Q"}],
    "inputs": [{"pair": "O", "position": 90, "velocity": "45 rpm"}],
    "sketch": {"B": [250, 60]},
}


def scheme_of(model: str) -> Callable[[], object]:
    """The scheme of a model."""
    return lambda: plot.scheme(planar.solve(model))


PICTURES: dict[str, Callable[[], object]] = {
    "points": lambda: plot.scheme(planar.solve(planar.from_dict(PLATE))),
    "wiper-path": lambda: plot.loci(planar.cycle(planar.from_dict(WIPER)), ["T"]),
    "sliding": scheme_of("slider-crank"),
    "slot": scheme_of("slotted-lever"),
    "gear": scheme_of("planetary-gear-set"),
    "cams/roller": scheme_of("valve-cam"),
    "cams/geneva": scheme_of("geneva-wheel"),
    "cams/profile": lambda: plot.cam_profile(planar.load("valve-cam")),
    "spring": scheme_of("door-closer"),
    "assemblies": lambda: plot.modes(planar.modes("four-bar")),
    "polygons": lambda: plot.acceleration(planar.solve("four-bar")),
    "centres": lambda: plot.centres(planar.solve("slider-crank")),
    "centrodes": lambda: plot.centrodes(planar.cycle("antiparallelogram"), "coupler"),
    "positions": lambda: plot.positions(planar.cycle("whitworth")),
    "diagrams": lambda: plot.diagrams(planar.cycle("slider-crank")),
    "bodies": lambda: plot.forces(planar.forces(planar.solve("two-stroke-engine"))),
    "circuits": lambda: plot.circuits(planar.circuits("watt-six-bar")),
}


def write(folder: Path) -> None:
    """Write all pictures into a folder."""
    for name, make in PICTURES.items():
        plot.save(make(), folder / f"{name}.png")


if __name__ == "__main__":
    write(FOLDER)
