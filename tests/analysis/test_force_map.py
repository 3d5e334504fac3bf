"""Worst cases of forces over several inputs: against single positions, closed forms, and dead points."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

import planar
from planar.cli import main
from planar.foundation.errors import BadInput, Outcome
from tests.builders import slider_crank
from tests.draws import first_cases
from tests.known import MODELS

ARM = {"boom cylinder": (2.0, 3.0, 9), "stick cylinder": (2.4, 3.5, 8)}


@pytest.mark.parametrize(
    ("model", "link", "point", "over"),
    first_cases([("open-arm", "upper arm", "B", None), ("excavator-arm", "boom", "E", ARM)]),
)
@pytest.mark.parametrize("inertia", [True, False])
def test_every_position_of_a_map_has_the_forces_of_that_position(model, link, point, over, inertia):
    arm = replace(MODELS[model], masses=(planar.Mass(link, 900.0, point, 50.0),), gravity=(0.0, -9.81), published=())
    over = over or {given.pair: (given.position, given.position + 0.5, 4) for given in arm.inputs[:2]}
    found = planar.force_map(arm, over, inertia=inertia)
    assert found.is_reached.all()
    for node in ((0, 0), (1, 3), (3, 2)):
        at = {name: float(each[k]) for (name, each), k in zip(found.over.items(), node, strict=True)}
        one = planar.forces(planar.solve(arm, at), inertia)
        for name, effort in one.inputs.items():
            assert found.effort[name][node] == pytest.approx(effort, rel=1e-9, abs=1e-6)
        for name, reaction in one.reactions.items():
            assert found.reaction[name][node] == pytest.approx(reaction.force, rel=1e-9, abs=1e-5)


def test_the_worst_case_of_a_two_link_arm_is_solved_for_between_the_positions():
    """A weight at the tip turns the shoulder most where the whole arm lies level."""
    arm = MODELS["open-arm"]
    tip, far = "P", None
    state = planar.solve(arm)
    tip = max(state.points, key=lambda name: hypot(*state.point(name).position))
    arm = replace(arm, loads=(planar.Load(point=tip, force=(0.0, -10.0)),), masses=(), springs=(), published=())
    first, second, third = (given.pair for given in arm.inputs)
    found = planar.force_map(arm, {first: (-1.0, 1.7, 5), second: (-1.1, 1.3, 4), third: (-0.9, 1.2, 4)}, inertia=False)
    worst = next(each for each in found.worst if each.kind == "greatest effort" and each.of == first)
    reach = [planar.solve(arm, {first: 0.0, second: 0.0, third: 0.0}).point(tip).position]
    far = float(np.hypot(*(reach[0] - state.point(first).position)))
    assert not worst.is_unbounded
    assert worst.value == pytest.approx(10.0 * far, rel=1e-8)
    assert np.max(found.effort[first]) < worst.value * (1.0 - 1e-4)


def toggle(**loads):
    """A slider-crank that is driven at its slide, its crank free to stop at both dead centres."""
    mechanism = slider_crank(0.5, 1.7)
    slide = next(pair.name for pair in mechanism.pairs if "displacement" in planar.solve(mechanism).pair(pair.name))
    crank = next(link.name for link in mechanism.links if "crank" in link.name or link.name == "OA")
    load = planar.Load(link=crank, torque=8.0) if "torque" in loads else planar.Load(pair=slide, effort=-50.0)
    at = planar.solve(mechanism).pair(slide)["displacement"]
    return replace(mechanism, inputs=(planar.Input(slide, at),), loads=(load,), masses=(), springs=()), slide


def test_what_grows_without_bound_is_said_with_its_dead_point():
    mechanism, slide = toggle(torque=True)
    found = planar.force_map(mechanism, {slide: (1.0, 2.4, 57)}, inertia=False)
    ends = sorted(abs(each.at[slide]) for each in found.worst if each.is_unbounded and each.of == slide)
    assert ends
    assert all(min(abs(end - 1.2), abs(end - 2.2)) < 1e-6 for end in ends)
    assert all("without bound" in each.remark for each in found.worst if each.is_unbounded)
    assert found.outcome((0,)) is Outcome.DEAD_POINT
    assert np.isnan(found.effort[slide][[0, -1]]).all()


def test_a_force_that_stays_finite_at_a_dead_point_has_a_bound():
    mechanism, slide = toggle()
    found = planar.force_map(mechanism, {slide: (1.0, 2.4, 57)}, inertia=False)
    own = [each for each in found.worst if each.of == slide and each.kind.endswith("effort")]
    assert not any(each.is_unbounded for each in own)
    assert [each.value for each in own] == pytest.approx([50.0, 50.0])


def five_bar(lengths, at, force, sense):
    """Cranks OA and PD, bars AC and CD, a force at C; C to the left of the way from A to D for a sense of 1."""
    a, b, c, d, ground = lengths
    first, second = complex(0.0, 0.0) + a * np.exp(1j * at[0]), ground + d * np.exp(1j * at[1])
    way = second - first
    along = (abs(way) ** 2 + b**2 - c**2) / (2.0 * abs(way))
    corner = first + way / abs(way) * complex(along, sense * np.sqrt(b**2 - along**2))
    links = {"f": {"points": {"O": [0, 0], "P": [ground, 0]}}}
    named = zip("abcd", ("OA", "AC", "CD", "PD"), lengths[:4], strict=True)
    links |= {name: {"ends": list(ends), "length": length} for name, ends, length in named}
    sketch = {name: [z.real, z.imag] for name, z in (("A", first), ("C", corner), ("D", second))}
    inputs = [{"pair": name, "position": position} for name, position in zip("OP", at, strict=True)]
    pairs = [{"turning": name} for name in "OPACD"]
    value = {"planar": 1, "name": "five-bar", "frame": "f", "links": links, "pairs": pairs, "inputs": inputs}
    return planar.from_dict(value | {"loads": [{"point": "C", "force": list(force)}], "sketch": sketch})


def worst(found, kind, of):
    return next(each for each in found.worst if (each.kind, each.of) == (kind, of))


def test_growth_that_begins_between_two_lines_of_the_grid_is_found():
    lengths = (0.45347102170475334, 1.0885012032657382, 0.9113251906884169, 0.6988839743156844, 0.9553214933874714)
    bars = five_bar(lengths, (-0.6664714561253771, -2.189420969865533), (54.08455846858077, 21.46591225063409), 1.0)
    over = {"O": (-1.3873481052543437, -0.4048159790246413, 23), "P": (-3.2303209647192714, -1.8614831752893353, 23)}
    found = worst(planar.force_map(bars, over), "greatest effort", "P")
    assert found.is_unbounded
    assert found.at["O"] == pytest.approx(-1.15266, abs=0.1)


def test_the_greatest_of_two_tops_is_told():
    lengths = (0.5832112825248865, 0.7991849382835157, 0.5225518996188554, 0.6896120012136783, 0.8464475129223028)
    bars = five_bar(lengths, (0.04753596573440477, 1.7444613143761192), (65.86355550421837, 43.90936380317561), -1.0)
    over = {"O": (-0.4085655638407162, 1.8404455396917179, 29), "P": (1.263818161226, 1.9436578062326952, 29)}
    found = worst(planar.force_map(bars, over), "greatest effort", "P")
    assert found.value == pytest.approx(34.557, abs=1e-3)
    assert found.at["O"] == pytest.approx(0.6676, abs=1e-3)


def test_what_is_asked_amiss_is_refused():
    with pytest.raises(BadInput, match="no input"):
        planar.force_map("excavator-arm", ["bucket"])
    with pytest.raises(BadInput, match="two positions"):
        planar.force_map("excavator-arm", {"boom cylinder": (2.0, 2.0, 5)})
    with pytest.raises(BadInput, match="more than"):
        planar.force_map("excavator-arm", dict.fromkeys((*ARM, "bucket cylinder"), (2.0, 3.0, 200)))


def test_the_command_tells_worst_cases(capsys, tmp_path):
    path = tmp_path / "five-bar.json"
    path.write_text(planar.dumps(five_bar((0.6, 0.8, 0.5, 0.7, 0.85), (0.05, 1.7), (66.0, 44.0), -1.0)))
    with pytest.raises(SystemExit):
        main(["forces", str(path), "--over", "O=0deg:60deg,P=80deg:100deg", "--static", "--steps", "3"])
    text = capsys.readouterr().out
    assert "Worst cases over O and P" in text
    assert "16 positions, 4 by 4" in text
