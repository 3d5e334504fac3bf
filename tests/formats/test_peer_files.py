"""Files that other programs' projects publish, unchanged: a folder of them is named by PLANAR_PEER_FILES."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import planar

FOLDER = os.environ.get("PLANAR_PEER_FILES")
FILES = sorted(path for path in Path(FOLDER).rglob("*") if path.is_file()) if FOLDER else []
REFUSED = (
    *("move in space", "m apart", "no mechanism", "no revolute joint", "no pair of the plane", "no joint in this file"),
    "a marker that is not there",
)
"""What is said of files that are none of the plane, none that are whole, or of an assembly that stands open."""
STUCK = (
    *(planar.Outcome.TOO_FEW_INPUTS, planar.Outcome.DEAD_POINT, planar.Outcome.CHANGE_POINT),
    planar.Outcome.INPUT_JAMMED,
)
"""How files end that hold no input, or were drawn where the input alone does not tell how they go on."""
pytestmark = pytest.mark.skipif(not FILES, reason="needs PLANAR_PEER_FILES, a folder of other programs' files")


@pytest.mark.parametrize("path", FILES, ids=lambda each: each.name)
def test_it_is_read_and_closes_as_it_was_drawn_or_says_why_not(path):
    try:
        mechanism = planar.load(path)
    except planar.BadInput as problem:
        assert any(told in str(problem) for told in REFUSED), problem
        return
    try:
        assert planar.solve(mechanism).residual < 1e-9
    except planar.NoAnswer as problem:
        assert problem.outcome in STUCK


def series(path: Path) -> tuple[list[float], dict[str, dict[str, np.ndarray]]]:
    """The results that an assembly's file holds: times, and of each part what is told over them."""
    lines = path.read_text(errors="replace").splitlines()
    start = next((number for number, line in enumerate(lines) if line.startswith("TimeSeries")), None)
    parts: dict[str, dict[str, np.ndarray]] = {}
    if start is None:
        return [], parts
    times, current = [float(each) for each in lines[start + 2].split("\t")[2:] if each.strip()], None
    for line in lines[start + 3 :]:
        if line.startswith("PartSeries"):
            current = parts.setdefault(line.rpartition("/")[2].strip(), {})
        elif "/" in line:
            current = None
        elif current is not None:
            name, _, *values = line.split("\t")
            current[name] = np.array([float(each) for each in values if each.strip()])
    return times, parts


def angular_speeds(parts):
    """Of each part how fast it turns (rad/s) at every time."""
    return {name: np.linalg.norm([part[f"Omega{axis}"] for axis in "XYZ"], axis=0) for name, part in parts.items()}


def is_even_turn(path):
    """Whether the results in a file are of a second in which a part turns once, evenly."""
    times, parts = series(path)
    if not times or times[-1] != 1.0:
        return False
    return any(np.allclose(each, 2.0 * np.pi, atol=1e-8) for each in angular_speeds(parts).values())


def turning_assemblies() -> Iterator[tuple[Path, planar.Mechanism]]:
    """Assemblies whose file holds the results of an even turn in a second, with their mechanisms."""
    for path in FILES:
        if path.suffix == ".asmt" and is_even_turn(path):
            with suppress(planar.BadInput, planar.NoAnswer):  # told of above
                mechanism = planar.load(path)
                planar.solve(mechanism)
                if len(mechanism.inputs) == 1 and not mechanism.inputs[0].law:
                    yield path, mechanism


@pytest.mark.parametrize(("path", "mechanism"), [*turning_assemblies()], ids=str)
def test_parts_of_an_assembly_turn_as_its_own_solver_found(path, mechanism):
    times, parts = series(path)
    motion = planar.cycle(mechanism, steps=len(times) - 1)
    speeds = angular_speeds(parts)
    for name in set(parts) & {link.name for link in mechanism.links}:
        omega = speeds[name]
        assert np.allclose(np.abs(motion.link(name).angular_velocity), omega, atol=1e-8)
        if np.ptp([parts[name][f"Omega{axis}"] for axis in "XY"]) > 0.0:
            continue  # in another plane, of which three angles one after the other tell nothing
        turned = np.unwrap(np.atleast_1d(motion.link(name).angle))
        published = np.unwrap(parts[name]["Bryantz"])
        assert np.allclose(turned - turned[0], published - published[0], atol=1e-9)
        assert np.allclose(motion.link(name).angular_velocity, parts[name]["OmegaZ"], atol=1e-8)
