"""What sticks and slips, as it is printed, written to files and drawn."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

import planar
from planar import plot
from tests.command import run


def test_the_command_tells_what_sticks_and_slips_and_when(tmp_path):
    table, drawing = tmp_path / "run.csv", tmp_path / "run.svg"
    told = ["simulate", "stick-slip", "--duration", "2s", "--steps", "4", "--of", "block", "--diagrams", str(drawing)]
    shown = run(tmp_path, *told, "-o", str(table))
    assert shown.status == 0
    rows = re.findall(r"(\S+)\s+block\s+(sticks|slips forward)", shown.out)
    assert rows == [("0", "sticks"), ("0.981000", "slips forward"), ("1.57634", "sticks")]
    assert "kinetic + potential − work + heat stays what it was" in shown.out
    head, *lines = csv.reader(table.read_text(encoding="utf-8").splitlines())
    of = dict(zip(head, zip(*lines, strict=True), strict=True))
    assert [float(each) for each in of["rubbing block sticks [1]"]] == [1, 1, 0, 0, 1]
    assert [float(each) for each in of["rubbing block sense [1]"]] == [0, 0, 1, 1, 0]
    assert of["rubbing block heat [J]"][-1] == of["energy heat [J]"][-1]
    assert drawing.stat().st_size > 0
    found = json.loads(run(tmp_path, "simulate", "stick-slip", "--duration", "1s", "--steps", "4", "--json").out)
    assert [each["change"] for each in found["friction_events"]] == ["sticks", "slips"]
    assert found["friction"]["block"]["slips"] + found["friction"]["block"]["sticks"] == pytest.approx(1.0)
    assert found["rubbing"]["block"]["heat"][-1] == found["energy"]["heat"][-1]
    assert "--diagrams" in run(tmp_path, "simulate", "stick-slip", "--duration", "1s", "--of", "block").refused(2)


def test_diagrams_shade_when_friction_holds():
    found = planar.simulate("stick-slip", 2.0, 20)
    times = [each.time for each in found.friction_events]
    charts = plot.diagrams(found, "block").axes[:3]
    for chart in charts:
        spans = [each.get_extents().transformed(chart.transData.inverted()) for each in _shaded(chart)]
        np.testing.assert_allclose([(each.x0, each.x1) for each in spans], [times[:2], [times[2], 2.0]], atol=1e-9)
    assert not _shaded(plot.diagrams(found.motion, "block").axes[0])


def _shaded(chart):
    return [each for each in chart.patches if each.get_gid() == "held"]
