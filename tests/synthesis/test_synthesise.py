"""Designs for tasks, each checked anew by the general path and by closed forms."""

import json

import numpy as np
import pytest

import planar
from tests.command import run
from tests.small_searches import set_small_searches


@pytest.fixture(autouse=True)
def few_designs(monkeypatch):
    """A small catalogue, which is enough for tasks as easy as these."""
    set_small_searches(monkeypatch)


UNITS = {"length": "mm", "angle": "deg"}


def task(start, *wanted, **more):
    return {"planar": 1, "units": UNITS, "start": start, "wanted": list(wanted)} | more


def path(model, point, count, steps=24):
    """Places of a model's own path (mm), rounded to a hundredth of its extent, over most of its motion."""
    motion = planar.cycle(model, steps)
    places = 1e3 * motion.point(point).position[: -2 or None]
    places = places[np.linspace(0, len(places) - 1, count).astype(int)]
    grain = 0.01 * np.ptp(places, axis=0).max()
    return (np.round(places / grain) * grain).tolist()


@pytest.mark.parametrize(
    ("model", "point"),
    [("slider-crank", "E"), ("four-bar", "E"), ("stephenson-3-five-bar", "E")],
)
def test_a_path_of_a_mechanism_is_met_within_its_rounding(model, point):
    found = planar.synthesise(
        task(model, {"point": point, "through": path(model, point, 10), "in_order": True}), many=2
    )
    assert len(found)
    for design in found:
        assert not design.defects
        assert design.greatest_miss < 0.015 * found.size
        check_path(design, found.task.wanted[0])
        assert len(design.cognates) == {"slider-crank": 1, "four-bar": 2}.get(model, len(design.cognates))
        own = planar.solve(design.mechanism).point(point).position
        for each in design.cognates:
            np.testing.assert_allclose(planar.solve(each.mechanism).point(each.point).position, own, atol=1e-9)


def check_path(design, wanted):
    """By `solve`, input by input, from the file that would be written."""
    mechanism = planar.loads(planar.dumps(design.mechanism))
    for at, place, missed in zip(design.inputs[0], wanted.places, design.misses[0], strict=True):
        state = planar.solve(mechanism, {mechanism.inputs[0].pair: float(at)})
        off = float(np.linalg.norm(state.point(wanted.point).position - place))
        assert off == pytest.approx(missed, abs=1e-9)


def test_three_poses_of_a_coupler_are_met_exactly():
    """A four-bar may carry a link through any three poses: its circles through three points always exist."""
    poses = [{"at": [0, 0], "angle": 0}, {"at": [30, 20], "angle": 25}, {"at": [70, 25], "angle": 60}]
    found = planar.synthesise(task("four-bar", {"link": "BC", "poses": poses}), many=2)
    assert found[0].greatest_miss < 1e-3 * found.size
    state = planar.solve(found[0].mechanism, {"A": float(found[0].inputs[0][1])})
    numbers = planar.dimensions(found[0].mechanism)
    own = complex(numbers["BC.B.x"], numbers["BC.B.y"]) * np.exp(1j * state.link("BC").angle)
    origin = state.point("B").position - [own.real, own.imag]
    np.testing.assert_allclose(origin, [0.03, 0.02], atol=1e-3 * found.size)
    assert found[0].cognates == ()


def test_a_function_of_three_pairs_keeps_freudensteins_equation():
    """F. Freudenstein, Trans. ASME 77, 1955: K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi)."""
    pairs = [[0, 0], [25, 14], [50, 33]]
    found = planar.synthesise(task("four-bar", {"from": "A", "to": "D", "pairs": pairs}), many=2)
    best = found[0]
    assert best.greatest_miss < 1e-5
    numbers = planar.dimensions(best.mechanism)
    base = np.array([numbers["AD.D.x"] - numbers["AD.A.x"], numbers["AD.D.y"] - numbers["AD.A.y"]])
    d, tilt = np.hypot(*base), np.arctan2(base[1], base[0])
    a, b, c = (numbers[f"{link}.length"] for link in ("AB", "BC", "DC"))
    for at in best.inputs[0]:
        state = planar.solve(best.mechanism, {"A": float(at)})
        phi, psi = state.link("AB").angle - tilt, state.link("DC").angle - tilt
        left = d / a * np.cos(psi) - d / c * np.cos(phi) + (a * a - b * b + c * c + d * d) / (2 * a * c)
        assert left == pytest.approx(np.cos(phi - psi), abs=1e-7)


def test_prescribed_timing_is_kept():
    motion = planar.cycle("crank-rocker", 36)
    rows = [2, 8, 14, 20, 26, 32]
    through = [
        {
            "at": (1e3 * motion.point("B").position[k]).tolist(),
            "input": float(np.degrees(motion.inputs["A0"].position[k])),
        }
        for k in rows
    ]
    found = planar.synthesise(task("crank-rocker", {"point": "B", "through": through}), many=1)
    assert found[0].greatest_miss < 1e-4 * found.size
    given = np.radians([each["input"] for each in through])
    between = np.diff(found[0].inputs[0]) - np.diff(given)
    np.testing.assert_allclose(between - 2 * np.pi * np.round(between / (2 * np.pi)), 0.0, atol=1e-8)


def test_demands_are_kept_or_the_one_in_the_way_is_named(monkeypatch):
    monkeypatch.setattr("planar.synthesis.synthesise.MATCHES", 6)
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15], [63, 8]], "in_order": True}
    found = planar.synthesise(task("four-bar", wanted, demands=["whole turn"]), many=1)
    assert len(found) == 1
    for design in found:
        motion = planar.cycle(design.mechanism, 90)
        assert not any("dead point" in each.kind for each in motion.limits)
        assert np.ptp(motion.inputs["A"].position) == pytest.approx(2 * np.pi)
    inside = {"inside": [[-1, -1], [1, 1]]}
    monkeypatch.setattr("planar.synthesis.fitting.design_fit.MAX_STEPS", 8)  # none keeps it, however near it comes
    none = planar.synthesise(task("four-bar", wanted, demands=[inside]), many=1)
    assert not len(none)
    assert none.rejected and any("leaves the region" in each for each in none.rejected[0].defects)
    assert "no design without a defect" in none.remarks[-1]


def test_the_same_seed_gives_the_same_designs():
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15]]}
    first, second = (planar.synthesise(task("four-bar", wanted), many=2, seed=3) for _ in range(2))
    assert [planar.dumps(each.mechanism) for each in first] == [planar.dumps(each.mechanism) for each in second]


def test_the_command_writes_designs_with_pages(tmp_path):
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15]]}
    (tmp_path / "lid.json").write_text(json.dumps(task("four-bar", wanted, name="Lid")))
    out = run(tmp_path, "synthesise", "lid.json", "--many", "2", "-o", "designs").done()
    assert "Lid" in out and "greatest miss" in out
    told = json.loads(run(tmp_path, "synthesise", "lid.json", "--many", "2", "--json").done())
    assert len(told["designs"]) == 2
    for number, design in enumerate(told["designs"], start=1):
        written = planar.load(tmp_path / "designs" / f"{number:02d}.json")
        assert planar.dimensions(written) == planar.dimensions(planar.from_dict(design["mechanism"]))
        assert (tmp_path / "designs" / f"{number:02d}.html").exists()
        for k, each in enumerate(design["cognates"], start=1):
            assert planar.load(tmp_path / "designs" / f"{number:02d}-cognate-{k}.json").name == each["name"]
    assert (tmp_path / "designs" / "index.html").exists()


def test_five_poses_are_met_by_pins_that_lie_off_the_origin_of_the_posed_link():
    """L. Burmester: a plane that takes five poses has pins for them; they do not lie where its axes begin."""
    poses = [([0, 0], 0), ([30, 20], 25), ([70, 25], 60), ([95, 5], 80), ([110, -20], 95)]
    wanted = {"link": "BC", "poses": [{"at": at, "angle": angle} for at, angle in poses]}
    found = planar.synthesise(task("four-bar", wanted), many=1)
    assert found[0].greatest_miss < 1e-3 * found.size
    for at, (_, angle) in zip(found[0].inputs[0], poses, strict=True):
        state = planar.solve(found[0].mechanism, {"A": float(at)})
        off = np.degrees(state.link("BC").angle) - angle
        assert abs(off - 360.0 * round(off / 360.0)) < 0.1
    link = next(each for each in found[0].mechanism.links if each.name == "BC")
    assert link.ends is None
    assert found[0].mechanism.source is None
