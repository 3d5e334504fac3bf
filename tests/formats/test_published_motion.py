"""Motion that other programs' projects publish beside their files: a folder of them is named by PLANAR_PEER_FILES."""

import csv
import json
import os
from math import atan2, degrees, hypot
from pathlib import Path

import pytest

import planar
from planar.model.mechanism import Drive
from planar.solving.position import rest_position
from tests.round_trips import read_text

FOLDER = os.environ.get("PLANAR_PEER_FILES")
CASES = sorted(Path(FOLDER).rglob("case.json")) if FOLDER else []
CURVES = sorted(Path(FOLDER).rglob("motiongen-curves.csv")) if FOLDER else []
INCH = 0.0254


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def pmks_text(case: dict) -> str:
    """The mechanism of a case of PMKS_Verification in the text of PMKS."""
    lines = []
    for joint in case["topology"]["joints"]:
        links, kind, angle = joint["links"], "R", 0.0
        if joint["type"] == "P":
            links, kind = sorted(links, key=lambda link: link != "ground"), "RP"
            angle = degrees(atan2(joint["guide_axis"][1], joint["guide_axis"][0]))
        driven = "tfft" if joint["id"] == case["input"]["joint"] else "tfff"
        lines.append(f"{','.join(links)},{kind},{joint['initial'][0]!r},{joint['initial'][1]!r},{angle!r},{driven}")
    for point in case["topology"].get("points", []):
        lines.append(f"{point['link']},R,{point['initial'][0]!r},{point['initial'][1]!r},0.0,tfff")
    return "mech=\n" + "\n".join(lines) + "\n"


@pytest.mark.skipif(not CASES, reason="needs PLANAR_PEER_FILES, a folder with cases of PMKS_Verification")
@pytest.mark.parametrize("path", CASES, ids=lambda each: each.parent.name)
def test_joints_go_where_pmks_found_them(path):
    case = json.loads(path.read_text())
    mechanism = read_text(pmks_text(case))
    (given,), start = mechanism.inputs, planar.solve(mechanism)
    known = {each["id"]: each["initial"] for key in ("joints", "points") for each in case["topology"].get(key, [])}
    drawn = {name: 1e3 * point.position for name, point in start.points.items()}
    own = {key: min(drawn, key=lambda n: hypot(drawn[n][0] - x, drawn[n][1] - y)) for key, (x, y) in known.items()}
    (x, y), (u, v) = (known[each["id"]] for each in case["topology"]["joints"][:2])
    samples = [each for each in rows(path.parent / "pmks" / "samples.csv") if "positive" in each["sample_id"]][::6]
    published = {
        (row["sample_id"], file.stem): (float(row["x"]), float(row["y"]))
        for kind in ("joints", "points")
        for file in (path.parent / "pmks" / kind).glob("*.csv")
        for row in rows(file)
    }
    for sample in samples:
        turn = float(sample["input_angle_rad"]) - atan2(v - y, u - x)
        state = rest_position(mechanism, [Drive(given.pair, given.position + turn)])
        for key, name in own.items():
            if (sample["sample_id"], key) in published:
                wanted = published[sample["sample_id"], key]
                assert 1e3 * state.points[name].position == pytest.approx(wanted, abs=1e-11)


@pytest.mark.skipif(not CURVES, reason="needs PLANAR_PEER_FILES, a folder with curves of MotionGen")
@pytest.mark.parametrize("path", CURVES, ids=lambda each: each.parent.name)
def test_joints_of_a_gripper_go_where_motiongen_found_them(path):
    """Its curves hold six digits after the point, and its slots are met to about a thousandth of an inch."""
    mechanism = planar.load(path.parent / "model.json")
    (given,), start = mechanism.inputs, planar.solve(mechanism)
    (driven,) = (each["at"] for each in json.loads((path.parent / "model.json").read_text())["actuators"])
    for row in rows(path)[::4]:
        went = float(row[f"{driven}_x"]) * INCH - start.points[driven].position[0]
        state = rest_position(mechanism, [Drive(given.pair, given.position + went)])
        for name in (key[:-2] for key in row if key.endswith("_x")):
            wanted = (float(row[f"{name}_x"]), float(row[f"{name}_y"]))
            assert state.points[name].position / INCH == pytest.approx(wanted, abs=1e-3)
