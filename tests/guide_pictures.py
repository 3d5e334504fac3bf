"""The pictures of the guide, made by the tool: `python -m tests.guide_pictures` writes them anew."""

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import planar
from planar import plot
from planar.guide.keys_page import key_sections, read_example
from planar.guide.topics import read_page

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
                "J": {"along": ["B", "C"], "distance": 45, "offset": 20},
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


def example_figure(name: str) -> object:
    """What is shown above the keys of a section."""
    mechanism = planar.from_dict(read_example(name))
    match name:
        case "file":
            return plot.modes(planar.modes(mechanism))
        case "law":
            return law_figure(name)
        case "varies":
            return variation_figure(name)
        case "load":
            return plot.forces(planar.forces(planar.solve(mechanism)))
        case "pairs/lift":
            return plot.cam_profile(mechanism)
        case "input":
            return plot.scheme(planar.solve(mechanism), "1:2")
    return plot.scheme(planar.solve(mechanism))


def law_figure(name: str) -> Figure:
    """Position, velocity and acceleration of an input, piece after piece."""
    (given,) = read_example(name)["inputs"]
    ends = np.cumsum([piece["in"] if "in" in piece else piece["times"][-1] for piece in given["law"]])
    motion = planar.cycle(planar.from_dict(read_example(name)), steps=1980, duration=float(ends[-1]))
    curves = motion.inputs[given["pair"]]
    figure = Figure((7.0, 4.6), layout="constrained")
    axes = figure.subplots(3, sharex=True)
    for axis, order, unit in zip(
        axes, ("position", "velocity", "acceleration"), ("deg", "deg/s", "deg/s²"), strict=True
    ):
        axis.plot(motion.time, np.rad2deg(getattr(curves, order)), color="black", linewidth=1.0)
        axis.set_ylabel(f"{order}\n{unit}", fontsize=7)
        axis.tick_params(labelsize=7)
        for end in ends[:-1]:
            axis.axvline(end, color="0.75", linewidth=0.6)
    for start, end, piece in zip([0.0, *ends], ends, given["law"], strict=False):
        words = piece["motion"].replace(" ", "\n")
        axes[0].text((start + end) / 2, 1.03, words, transform=axes[0].get_xaxis_transform(), **SMALL_TEXT)
    axes[-1].set_xlabel("time, s", fontsize=7)
    return figure


def variation_figure(name: str) -> Figure:
    """The factors of loads over what they vary with."""
    figure = Figure((7.0, 1.9), layout="constrained")
    loads = read_example(name)["loads"]
    for axis, load in zip(figure.subplots(1, len(loads)), loads, strict=True):
        varies = load["varies"]
        axis.plot(varies["at"], varies["factors"], color="black", linewidth=1.0, marker=".")
        axis.set_xlabel(f"position of {varies['with']}, deg" if "with" in varies else "time, s", fontsize=7)
        axis.set_ylabel("factor", fontsize=7)
        axis.tick_params(labelsize=7)
    return figure


LIGHT = planar.CounterweightLimit(mass=0.3)
"""kg: counterweights of an engine that cannot balance it altogether."""
SMALL_TEXT = {"ha": "center", "va": "bottom", "fontsize": 6}
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
    "design/sensitivity": lambda: plot.sensitivity("whitworth", "slot"),
    "design/tolerances": lambda: plot.tolerance("hoeken-straight-line", "P"),
    "design/chains": lambda: plot.chains(planar.chains(8))[0],
    "design/multiple-pins": lambda: plot.chains(planar.chains(8, multiple_pins=2))[0],
    "design/cognates": lambda: plot.cognates("four-bar", "F"),
    "design/exact-synthesis": lambda: plot.dyad_curves(
        planar.synthesise(shown_file("hatch.json", "design/exact-synthesis"), complete=True)
    ),
    "bodies": lambda: plot.forces(planar.forces(planar.solve("two-stroke-engine"))),
    "forces/stick-slip": lambda: plot.diagrams(planar.simulate("stick-slip", 5.0), "block"),
    "forces/balance": lambda: plot.balance(
        planar.balance("two-stroke-engine", "shaking force", ["crank", "rod"], LIGHT),
        planar.balance_tradeoff("two-stroke-engine", ["crank", "rod"], LIGHT),
    ),
    "forces/friction": lambda: plot.forces(planar.forces(planar.solve(thick_clamp()))),
    "circuits": lambda: plot.circuits(planar.circuits("watt-six-bar")),
    **{f"keys/{each.example}": partial(example_figure, each.example) for each in key_sections() if each.example},
}


def shown_file(name: str, page: str = "look-up/recipes") -> dict[str, object]:
    """A file that a page of the guide shows."""
    found = re.search(rf"<!-- file: {re.escape(name)} -->\n```json\n(.*?)```", read_page(page), re.DOTALL)
    value: dict[str, object] = json.loads(found[1]) if found else {}
    return value


def exam_page() -> object:
    """The first page of an exam."""
    from planar.drawing.output.problem_sheets import problem_pages

    variants = planar.problem_variants("whitworth", 1, seed=23)
    return problem_pages(planar.solve("whitworth"), variants, 23)[0]


PICTURES |= {
    "recipes/press": lambda: plot.positions(planar.cycle("toggle-press")),
    "recipes/suspension": lambda: plot.centres(planar.solve(planar.from_dict(shown_file("wishbone.json")))),
    "recipes/excavator": scheme_of("excavator-arm"),
    "recipes/exam": exam_page,
}
COLOURS = 48
"""Of a picture's palette, which makes its file a third as large."""


def thick_clamp() -> planar.Mechanism:
    """The toggle clamp with pins so thick that friction circles are seen."""
    sizes = {f"{pin}.pin_radius": "14 mm" for pin in "OAB"} | {f"{pin}.friction": 0.25 for pin in "OAB"}
    return planar.load("toggle-clamp").with_values(sizes)


def write(folder: Path) -> None:
    """Write all pictures into a folder."""
    for name, make in PICTURES.items():
        write_picture(make(), folder / f"{name}.png")


def write_picture(figure: object, path: Path) -> None:
    """Write a figure in few colours."""
    plot.save(figure, path)
    with Image.open(path) as whole:
        few = whole.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    few.save(path, optimize=True)


if __name__ == "__main__":
    write(FOLDER)
