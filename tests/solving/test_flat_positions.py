"""Flat positions: where more than one motion is possible to first order, and only the one that goes on is given."""

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import NoAnswer, Outcome
from tests.builders import four_bar_document
from tests.draws import part


def cranks_on_one_rod(turn, places, omega=3.0, alpha=2.0, frame=0.0, shift=0j, unit="m", radius=1.0, heights=None):
    """Equal cranks on one rod, their shafts at these places (and heights) along a line turned by `frame`."""
    feet = [(x + 1j * y) * radius for x, y in zip(places, heights or [0.0] * len(places), strict=True)]
    shafts = [shift + foot * np.exp(1j * frame) for foot in feet]
    pins = [shaft + radius * np.exp(1j * (turn + frame)) for shaft in shafts]
    links = {
        "f": {"points": {f"G{k}": [at.real, at.imag] for k, at in enumerate(shafts)}},
        "rod": {"points": {f"P{k}": [foot.real, foot.imag] for k, foot in enumerate(feet)}},
    }
    links |= {f"c{k}": {"ends": [f"G{k}", f"P{k}"], "length": radius} for k in range(len(places))}
    value = {
        "planar": 1,
        "units": {"length": unit},
        "frame": "f",
        "links": links,
        "pairs": [{"turning": f"{letter}{k}"} for letter in "GP" for k in range(len(places))],
        "inputs": [{"pair": "G0", "position": turn + frame, "velocity": omega, "acceleration": alpha}],
        "sketch": {f"P{k}": [at.real, at.imag] for k, at in enumerate(pins)},
    }
    return files.from_dict(value)


def flat_four_bar(a, b, c, d, theta, at):
    names, sketch = ["f", "AB", "BC", "DC"], {"C": at}
    return planar.from_dict(four_bar_document(a, b, c, d, theta, names=names, omega=3.0, alpha=0.5, sketch=sketch))


def outcome(mechanism):
    with pytest.raises(NoAnswer) as refused:
        planar.solve(mechanism)
    return refused.value


def translates(state, turn, omega, alpha):
    """Every crank as the first, the rod not turning at all."""
    scale = max(1.0, omega**2, abs(alpha))
    for name, link in state.links.items():
        angle, first, second = (turn, omega, alpha) if name.startswith("c") else (None, 0.0, 0.0)
        if angle is not None:
            assert np.exp(1j * link.angle) == pytest.approx(np.exp(1j * angle), abs=1e-12)
        assert link.angular_velocity == pytest.approx(first, abs=1e-12 * scale)
        assert link.angular_acceleration == pytest.approx(second, abs=1e-12 * scale)


@pytest.mark.parametrize("rates", [(3.0, 2.0, 0.5, -7.0), (0.0, 2.0, 0.0, -7.0), (3.0, 0.0, 0.0, 5.0)])
def test_a_second_input_runs_at_rates_that_are_no_multiple_of_the_first_ones(rates):
    omega, alpha, arm_velocity, arm_acceleration = rates
    value = planar.to_dict(cranks_on_one_rod(0.0, (0, 2, 0.8), omega, alpha))
    value["links"]["rod"]["points"]["R"] = [0.4, 0.3]
    value["links"]["arm"] = {"ends": ["R", "T"], "length": 0.5}
    value["pairs"].append({"turning": "R"})
    value["inputs"].append({"pair": "R", "position": 0.7, "velocity": arm_velocity, "acceleration": arm_acceleration})
    state = planar.solve(planar.from_dict(value))
    assert any("the only one that goes on" in remark for remark in state.remarks)
    for crank in ("c0", "c1", "c2"):
        assert state.link(crank).angular_velocity == pytest.approx(omega, abs=1e-11)
        assert state.link(crank).angular_acceleration == pytest.approx(alpha, abs=1e-11)
    assert state.link("rod").angular_acceleration == pytest.approx(0.0, abs=1e-11)
    assert abs(state.link("arm").angular_acceleration) == pytest.approx(abs(arm_acceleration), abs=1e-11)


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize(
    "places", part([(0, 2, 0.8), (0, 1, 2), (0, 2, -1), (0, 1, 5), (0, 2, 0.8, 1.3), (0, 0.3, 0.6, 0.9, 1.2)], 1)
)
@pytest.mark.parametrize(("omega", "alpha"), part([(3.0, 2.0), (-40.0, 1000.0), (1.0, 0.0), (0.2, -5.0)], 1, 1))
def test_cranks_in_line_are_solved_to_round_off_where_they_lie_flat(turn, places, omega, alpha):
    state = planar.solve(cranks_on_one_rod(turn, places, omega, alpha))
    assert state.mobility == 1
    translates(state, turn, omega, alpha)
    assert any("the only one that goes on" in remark for remark in state.remarks)
    # any point of the rod runs on the cranks' circle
    pin = state.point("P1")
    velocity = 1j * omega * np.exp(1j * turn)
    acceleration = (1j * alpha - omega**2) * np.exp(1j * turn)
    assert complex(*pin.velocity) == pytest.approx(velocity, abs=1e-12 * omega**2 + 1e-12)
    assert complex(*pin.acceleration) == pytest.approx(acceleration, abs=1e-11 * (omega**2 + abs(alpha)))


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize(
    ("unit", "radius", "shift", "frame"),
    part([("mm", 50.0, 0j, 0.0), ("km", 0.002, 0j, 0.0), ("m", 1.0, 3 - 4j, 0.7), ("mm", 8.0, 70 + 10j, -2.5)], 1, 3),
)
def test_flat_cranks_in_any_unit_place_and_direction(turn, unit, radius, shift, frame):
    state = planar.solve(cranks_on_one_rod(turn, (0, 2, 0.8), unit=unit, radius=radius, shift=shift, frame=frame))
    translates(state, turn + frame, 3.0, 2.0)


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize("beside", part([1e-8, 1e-6, 1e-4, 1e-2], 1, 2))
def test_beside_the_flat_position_no_rate_is_wrong(turn, beside):
    """So near to it that rounding hides which branch it is, it may be refused."""
    try:
        state = planar.solve(cranks_on_one_rod(turn + beside, (0, 2, 0.8)))
    except NoAnswer:
        assert beside < 1e-5
        return
    for name in ("c0", "c1", "c2"):
        assert state.link(name).angular_velocity == pytest.approx(3.0, abs=1e-8)
        assert state.link(name).angular_acceleration == pytest.approx(2.0, abs=1e-5)


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize("omega", [1e-3, 1e-5])
def test_how_slowly_flat_cranks_turn_does_not_matter(turn, omega):
    """The same motion in other units of time: rates go with the speed."""
    state = planar.solve(cranks_on_one_rod(turn, (0, 2, 0.8), omega, 0.0))
    for name in ("c0", "c1", "c2"):
        assert state.link(name).angular_velocity == pytest.approx(omega, rel=1e-9)
        assert state.link(name).angular_acceleration == pytest.approx(0.0, abs=1e-9 * omega**2)


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize("omega", [3.0, -0.5])
def test_cranks_out_of_line_need_no_second_order(turn, omega):
    state = planar.solve(cranks_on_one_rod(turn, (0, 2, 0.8), omega, 2.0, heights=(0, 0, 0.7)))
    translates(state, turn, omega, 2.0)
    assert not any("first order" in remark for remark in state.remarks)


@pytest.mark.parametrize("turn", [0.0, np.pi])
@pytest.mark.parametrize("places", [(0, 2), (0, 2, 2)], ids=["two", "two of them side by side"])
def test_where_two_motions_go_on_neither_is_chosen(places, turn):
    """Crank 2 beside crank 1 is one bar more, and redundant; but the rod may still cross over."""
    refused = outcome(cranks_on_one_rod(turn, places))
    assert refused.outcome is Outcome.CHANGE_POINT
    assert "'rod'" in refused.reason
    assert "'c1'" in refused.reason
    assert "G0" in refused.reason


def test_a_kite_that_opens_goes_on_in_one_way_only():
    """AB = AD and BC = DC: C stays on the bisector of the angle at A; folded, the two bars may also turn about B = D,
    but not while the crank moves."""
    state = planar.solve(flat_four_bar(1, 2, 2, 1, 0.0, [3, 0]))
    # C = rho(theta) e^(i theta / 2) with rho = 3 and rho' = 0 there: phi' = 3/4 omega, beta' = 1/4 omega
    assert state.link("DC").angle == pytest.approx(0.0, abs=1e-12)
    assert state.link("DC").angular_velocity == pytest.approx(0.75 * 3.0, abs=1e-12)
    assert state.link("BC").angular_velocity == pytest.approx(0.25 * 3.0, abs=1e-12)
    assert state.link("DC").angular_acceleration == pytest.approx(0.75 * 0.5, abs=1e-11)
    assert state.link("BC").angular_acceleration == pytest.approx(0.25 * 0.5, abs=1e-11)


def test_a_folded_kite_off_its_line_is_at_a_dead_point():
    refused = outcome(flat_four_bar(1, 2, 2, 1, 0.0, [1, 2]))
    assert refused.outcome is Outcome.DEAD_POINT
    assert "'BC' and 'DC'" in refused.reason


@pytest.mark.parametrize(
    ("lengths", "theta", "at"),
    [
        ((2, 2, 1, 1), 0.0, [3, 0]),
        ((1, 2, 1, 2), 0.0, [3, 0]),
        ((1, 2, 1, 2), np.pi, [1, 0]),
        ((1, 2, 3, 4), np.pi, [1, 0]),
    ],
)
def test_flat_four_bars_at_which_two_motions_cross_are_refused(lengths, theta, at):
    """A kite driven at its long side, the parallelogram, and shortest + longest equal to the other two."""
    refused = outcome(flat_four_bar(*lengths, theta, at))
    assert refused.outcome in (Outcome.CHANGE_POINT, Outcome.DEAD_POINT)
    if lengths[0] + lengths[3] != lengths[1] + lengths[2] or lengths == (1, 2, 1, 2):
        assert refused.outcome is Outcome.CHANGE_POINT
