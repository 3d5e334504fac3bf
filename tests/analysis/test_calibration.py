"""Calibration: dimensions found back from noisy samples, what cannot be told apart, and what is refused."""

import json

import numpy as np
import pytest

import planar
from planar.document.tables.measured_table import read_measured_table
from tests.command import run

NOISE = 1e-4


def noisy(model, point, steps=40, seed=1):
    motion = planar.cycle(model, steps)
    path = motion.point(point).position[1:-1]
    rng = np.random.default_rng(seed)
    return motion, path + rng.normal(size=path.shape) * NOISE


@pytest.mark.parametrize("is_timed", [True, False])
def test_dimensions_are_found_back_from_a_noisy_path(is_timed):
    true = planar.dimensions("hoeken-straight-line")
    motion, path = noisy("hoeken-straight-line", "P")
    start = motion.mechanism.with_values({"crank.length": 0.101, "rocker.length": 0.252, "coupler.length": 0.497})
    inputs = {"O": motion.inputs["O"].position[1:-1]} if is_timed else None
    order = np.random.default_rng(2).permutation(len(path)) if not is_timed else slice(None)
    found = planar.calibrate(start, {"P": path[order]}, inputs=inputs)
    assert len(found.values) == 9
    assert not found.unidentified
    for name, value in found.values.items():
        assert abs(value - true[name]) < 3.0 * found.deviations[name]
    size = found.residual_deviation * found.measurement.series[0].deviation
    assert size == pytest.approx(NOISE, rel=0.3)


def test_what_cannot_be_told_apart_is_said():
    motion = planar.cycle("crank-rocker", 24)
    inputs = {"A0": motion.inputs["A0"].position}
    found = planar.calibrate("crank-rocker", {"rocker": motion.link("rocker").angle}, inputs=inputs)
    assert found.unidentified
    assert np.isnan(found.deviations["coupler.length"])
    free = ["crank.length", "coupler.length"]
    alone = planar.calibrate("crank-rocker", {"A": motion.point("A").position}, free, inputs=inputs)
    assert [each.sentence for each in alone.unidentified] == ["the measurement does not depend on coupler.length"]


def test_deviations_beyond_what_is_linear_are_called_rough():
    """Of a few degrees of the crank a path does not tell much."""
    motion = planar.cycle("crank-rocker", 360)
    path, inputs = motion.point("B").position[20:50], {"A0": motion.inputs["A0"].position[20:50]}
    noise = np.random.default_rng(3).normal(size=path.shape)
    rough, fine = (planar.calibrate("crank-rocker", {"B": path + each * noise}, inputs=inputs) for each in (1e-4, 1e-8))
    assert any("do not act linearly" in remark for remark in rough.remarks)
    assert not any("do not act linearly" in remark for remark in fine.remarks)


def test_a_wrong_sample_is_named_and_counts_less_in_a_robust_loss():
    motion, path = noisy("crank-rocker", "B")
    path[7] += 0.002
    inputs = {"A0": motion.inputs["A0"].position[1:-1]}
    free = ["rocker.length", "coupler.length"]
    plain = planar.calibrate("crank-rocker", {"B": path}, free, inputs=inputs)
    assert plain.outliers[0].row == 7
    robust = planar.calibrate("crank-rocker", {"B": path}, free, inputs=inputs, loss="cauchy")
    assert abs(robust.values["rocker.length"] - 0.12) < abs(plain.values["rocker.length"] - 0.12)


def test_what_is_measured_amiss_is_refused_in_a_sentence():
    with pytest.raises(planar.BadInput, match="name what was measured"):
        planar.calibrate("crank-rocker", {})
    with pytest.raises(planar.Unknown, match="'Z'"):
        planar.calibrate("crank-rocker", {"Z": [[0.0, 0.0]]})
    with pytest.raises(planar.BadInput, match="shape"):
        planar.calibrate("crank-rocker", {"B": [1.0, 2.0]})
    with pytest.raises(planar.BadInput, match="no input 'Q'"):
        planar.calibrate("crank-rocker", {"B": [[0.0, 0.0]]}, inputs={"Q": [0.0]})


def test_a_table_with_decimal_commas_is_read(tmp_path):
    file = tmp_path / "m.csv"
    file.write_bytes("\ufeffC x [mm];C y [mm]\r\n1,5;2\r\n;\r\n-3;4,25\r\n".encode())
    table = read_measured_table(file)
    assert [each.numbers for each in table.columns] == [(1.5, -3.0), (2.0, 4.25)]
    assert table.lines == (2, 4)


def test_the_command_reads_a_run_back_and_writes_the_fitted_file(tmp_path):
    motion = planar.cycle("crank-rocker", 24)
    lines = ["input A0 position [deg],B x [mm],B y [mm]"]
    for turn, (x, y) in zip(motion.inputs["A0"].position, motion.point("B").position * 1e3, strict=True):
        lines.append(f"{np.degrees(turn)!r},{x!r},{y!r}".replace("np.float64(", "").replace(")", ""))
    (tmp_path / "m.csv").write_text("\n".join(lines))
    fitted, drawing = tmp_path / "fit.json", tmp_path / "fit.svg"
    options = [
        "--free",
        "coupler.length",
        "--set",
        "coupler.length=182mm",
        "-o",
        str(fitted),
        "--drawing",
        str(drawing),
    ]
    done = run(tmp_path, "calibrate", "crank-rocker", "m.csv", "--json", *options)
    assert json.loads(done.out)["values"]["coupler.length"] == pytest.approx(0.18, rel=1e-9)
    assert planar.dimensions(fitted)["coupler.length"] == pytest.approx(0.18, rel=1e-9)
    assert drawing.stat().st_size > 1000
