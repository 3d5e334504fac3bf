"""Every worked example against what its book prints, and against independent solutions of the same geometry."""

import json

import numpy as np
import pytest

import planar
from planar.analysis.worked.published import compare_published
from planar.document import files
from planar.model.mechanism import Drive
from planar.solving.position import PositionSolver
from tests.closed_forms import piston
from tests.known import MODELS

TEXTBOOK = [file for file in files.model_files() if file.parent.name == "textbook"]
IDS = [
    *("000-P1", "000-P2", "000-P3", "000-P4", "000-P4-BC480", "000-P5"),
    *("002-E3.1", "002-E3.2", "002-E3.3", "002-E3.4", "002-E3.5", "002-E3.6a", "002-E3.6b", "002-S3.5"),
    *("004-COS", "004-EX-P", "004-EX-piston", "004-FORM", "004-IC", "004-OABQ", "004-QR", "004-SC12", "004-TOGGLE"),
]
every_example = pytest.mark.parametrize("file", TEXTBOOK, ids=lambda file: file.stem)


@pytest.mark.parametrize("name", IDS)
def test_every_case_is_a_model_by_its_id(name):
    assert name in planar.load(name).ids


@every_example
def test_published_values_agree_within_the_reading_error_or_are_named_slips(file):
    mechanism = planar.load(file)
    comparisons = compare_published(planar.solve(mechanism))
    assert len(comparisons) == len(mechanism.published) > 0
    wrong = {
        each.published.symbol: (each.solved, each.published.value)
        for each in comparisons
        if each.verdict in ("differs", "sense differs")
    }
    assert not wrong


@every_example
def test_a_slip_has_a_reason_and_is_really_off(file):
    for each in compare_published(planar.solve(planar.load(file))):
        if each.published.slip is not None:
            assert len(each.published.slip) > 20
            assert abs(each.relative_difference) > each.published.tolerance


def test_the_known_mistakes_of_the_chapters_are_marked():
    slips = {
        (name, each.published.symbol)
        for name in ("000-P2", "002-E3.4")
        for each in compare_published(planar.solve(planar.load(name)))
        if each.verdict == "slip in the book"
    }
    assert slips == {("000-P2", "rub_A"), ("000-P2", "T_A"), ("002-E3.4", "v_B")}


@every_example
def test_source_provenance_and_sketch_are_there(file):
    mechanism = planar.load(file)
    assert mechanism.source
    assert mechanism.geometry in ("given", "recovered", "fitted", "underdetermined")
    assert mechanism.about
    assert planar.solve(mechanism).remarks == ()  # the sketch leaves no tie


@every_example
def test_every_printed_value_has_its_case_among_the_ids(file):
    mechanism = planar.load(file)
    assert {item.case for item in mechanism.published} <= set(mechanism.ids)


# Independent values: loop equations solved at 50 digits by Newton's method and differentiated by hand, to 12 digits.
# The toggle's slider against the crank angle (degrees: metres).
TOGGLE = {
    45: 0.6221925886404059,
    85: 0.5610795808982192,
    125: 0.559483345687765,
    165: 0.5988552950554947,
    205: 0.6607665014070173,
    225: 0.6743816455442418,
    245: 0.6344842359425625,
    285: 0.5720700274680582,
    325: 0.6428293974867877,
    365: 0.6739672032554371,
    405: 0.6221925886404058,
}


@pytest.mark.parametrize(("degrees", "x"), TOGGLE.items())
def test_the_toggle_follows_its_branch_round_a_whole_turn(degrees, x):
    state = planar.solve(planar.load("004-TOGGLE"), [Drive("O", np.radians(degrees))])
    assert state.point("D").position[0] == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize("degrees", range(0, 331, 30))
def test_twelve_positions_of_the_slider_crank(degrees):
    r, rod, a = 0.03, 0.1, np.radians(degrees)
    state = planar.solve(planar.load("004-SC12"), [Drive("O", a)])
    assert state.point("B").position == pytest.approx([piston(a, r, rod)[0], 0], abs=1e-15)
    middle = 0.7 * state.point("A").position + 0.3 * state.point("B").position
    assert state.point("D").position == pytest.approx(middle, abs=1e-15)


def test_the_toggles_torque_balances_power():
    state = planar.solve(planar.load("000-P2"))
    speed = state.inputs["O"].velocity
    by_hand = 2000 * abs(state.point("D").velocity[0]) / speed
    assert planar.forces(state).inputs["O"] == pytest.approx(by_hand, rel=1e-12)
    assert by_hand == pytest.approx(216.6, abs=0.05)


def test_quick_return_in_closed_form():
    """The lever points from C at the crank pin; the block's slide and the Coriolis part follow in polar coordinates."""
    state = planar.solve(planar.load("004-QR"))
    crank, w = np.radians(30), 10.0
    z = 0.1 * np.exp(1j * crank) + 0.25j
    z1, z2 = 0.1j * w * np.exp(1j * crank), -0.1 * w * w * np.exp(1j * crank)
    unit = z / abs(z)
    slide, turn = (z1 / unit).real, (z1 / unit).imag / abs(z)
    bend = ((z2 / unit).imag - 2 * slide * turn) / abs(z)
    lever = state.link("CD")
    assert (lever.angular_velocity, lever.angular_acceleration) == pytest.approx((turn, bend), rel=1e-12)
    assert np.linalg.norm(state.relative("A", "C").coriolis) == pytest.approx(abs(2 * turn * slide), rel=1e-12)


# The Andrew engine's layouts: Q, height of the guide, first angles of the cranks, side of AB on which C lies.
ANDREW = {"002-E3.6a": (-0.158, 0.232, 79.2, 208.1, -1), "002-E3.6b": (0.156, 0.254, 99.3, 331.2, 1)}


@pytest.mark.parametrize("name", ANDREW)
@pytest.mark.parametrize("degrees", [0, 57, -200, 360, 1000])
def test_the_andrew_engine_obeys_its_loop_equations(name, degrees):
    """Circle intersections, and the loops differentiated by hand; the ratio being no whole number, turns count."""
    q, guide, first, second, side = ANDREW[name]
    w = 100 * 2 * np.pi / 60
    speeds = np.array([w, -2.122 * w])
    arms = np.array([0.09, 0.045]) * np.exp(1j * np.radians([first + degrees, second - 2.122 * degrees]))
    (a, b), va, acc = arms + np.array([0, q]), 1j * speeds * arms, -(speeds**2) * arms
    base = b - a
    c = (a + b) / 2 + side * 1j * base / abs(base) * np.sqrt(0.185**2 - abs(base) ** 2 / 4)
    rods = np.array([[1j * (c - a), -1j * (c - b)]])
    matrix = np.vstack([rods.real, rods.imag])

    def turning(gap):
        return np.linalg.solve(matrix, [gap.real, gap.imag])

    w_ac, w_bc = turning(va[1] - va[0])
    e_ac, e_bc = turning(acc[1] - acc[0] + w_ac**2 * (c - a) - w_bc**2 * (c - b))
    vc, ac = va[0] + 1j * w_ac * (c - a), acc[0] + (1j * e_ac - w_ac**2) * (c - a)
    cd = np.sqrt(0.24**2 - (guide - c.imag) ** 2) + 1j * (guide - c.imag)
    w_cd = -vc.imag / cd.real
    e_cd = -(ac - w_cd**2 * cd).imag / cd.real

    state = planar.solve(planar.load(name), {"O": np.radians(first + degrees)})
    assert state.link("QB").angle == pytest.approx(np.radians(second - 2.122 * degrees), abs=1e-12)
    for link, turn, bend in (("AC", w_ac, e_ac), ("BC", w_bc, e_bc), ("CD", w_cd, e_cd)):
        assert state.link(link).angular_velocity == pytest.approx(turn, rel=1e-11)
        assert state.link(link).angular_acceleration == pytest.approx(bend, rel=1e-11)
    d = state.point("D")
    np.testing.assert_allclose(d.position, [(c + cd).real, guide], atol=1e-14)
    np.testing.assert_allclose(d.velocity, [(vc + 1j * w_cd * cd).real, 0], atol=1e-12)
    np.testing.assert_allclose(d.acceleration, [(ac + (1j * e_cd - w_cd**2) * cd).real, 0], atol=1e-10)


@pytest.mark.parametrize("file", files.model_files(), ids=lambda file: file.stem)
def test_every_model_is_solved_determinate_and_closed(file):
    mechanism = planar.load(file)
    state = planar.solve(mechanism)
    assert state.mobility == len(mechanism.inputs)
    assert state.residual <= PositionSolver(mechanism).tolerance
    assert mechanism.about
    assert len(mechanism.about) < 90
    assert json.dumps(files.to_dict(mechanism))


def test_names_of_models_and_ids_are_unique():
    names = [name for stem, m in MODELS.items() for name in {stem, *m.ids}]
    assert len(names) == len(set(names))
