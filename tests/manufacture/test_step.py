"""Solids of plates: every edge joins two faces, and a library of solids, where there is one, finds them whole."""

import re
from collections import Counter

import pytest

import planar
from planar.manufacture.plates import plate_area
from tests.draws import is_exhaustive

MODELS = ("klann-leg", "slider-crank", "gear-reducer", "valve-cam")
PINION_AND_WHEEL = {
    "planar": 1,
    "name": "Pinion and wheel",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"A": [0, 0], "B": [35, 0]}},
        "pinion": {"ends": ["A", "C"], "length": 10},
        "wheel": {"ends": ["B", "D"], "length": 20},
    },
    "pairs": [
        {"turning": "A"},
        {"turning": "B"},
        {"gear": "mesh", "links": ["pinion", "wheel"], "teeth": [6, 8], "pressure_angle": 25},
    ],
    "inputs": [{"pair": "A", "position": 30}],
}
"""Few teeth: the time in which a library of solids reads a wheel grows with the square of their number."""


def entities(content: bytes) -> dict[int, tuple[str, str]]:
    """The kind and the rest of each entity, by its number."""
    found = re.findall(r"^#(\d+)=([A-Z_0-9]*)\((.*)\);$", content.decode("ascii"), re.MULTILINE)
    return {int(number): (kind, rest) for number, kind, rest in found}


@pytest.mark.parametrize("model", MODELS)
def test_every_edge_is_gone_along_once_each_way(model):
    found = planar.parts(model)
    known = entities(found.encode(".step"))
    assert {int(each) for _, rest in known.values() for each in re.findall(r"#(\d+)", rest)} <= set(known)
    used = Counter()
    for kind, rest in known.values():
        if kind == "EDGE_LOOP":
            for number in re.findall(r"#(\d+)", rest):
                edge, way = re.search(r"#(\d+),\.([TF])\.", known[int(number)][1]).groups()
                used[edge, way] += 1
    edges = {number for number, (kind, _) in known.items() if kind == "EDGE_CURVE"}
    assert used == {(str(edge), way): 1 for edge in edges for way in "TF"}
    assert sum(kind == "MANIFOLD_SOLID_BREP" for kind, _ in known.values()) == len(found.plates)


def test_names_of_plates_cannot_end_a_text():
    named = planar.from_dict(planar.to_dict("four-bar") | {"name": "a'); #1=X('é\\"})
    content = planar.parts(named).encode(".step").decode("ascii")
    assert "'a''); #1=X(''__'" in content


@pytest.mark.parametrize(
    "model",
    [PINION_AND_WHEEL if stem == "gear-reducer" and not is_exhaustive() else stem for stem in MODELS],
    ids=MODELS,
)
def test_a_library_of_solids_finds_them_valid_and_as_heavy(model, tmp_path):
    """Only where the bindings of Open CASCADE are installed, of which nothing else here has need."""
    pytest.importorskip("OCP")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    found = planar.parts(planar.from_dict(model) if isinstance(model, dict) else model)
    found.save(tmp_path / "a.step")
    reader = STEPControl_Reader()
    reader.ReadFile(str(tmp_path / "a.step"))
    reader.TransferRoots()
    solids, each = [], TopExp_Explorer(reader.OneShape(), TopAbs_SOLID)
    while each.More():
        solids.append(each.Current())
        each.Next()
    for solid, plate in zip(solids, found.plates, strict=True):
        assert BRepCheck_Analyzer(solid).IsValid()
        measured = GProp_GProps()
        BRepGProp.VolumeProperties_s(solid, measured)
        assert measured.Mass() == pytest.approx(3.0 * plate_area(plate), rel=1e-6)
        assert measured.CentreOfMass().Z() == pytest.approx(3.0 * plate.layer + 1.5, abs=1e-6)
