"""Every public function with a `timeout`: ended before anything, ended on its way, refused times, nothing changed."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.time_limit import limited_by
from planar.model.mechanism import named_points
from tests.time_limits import REASON, CountedLimit

FORTY = np.linspace(0.17, 0.19, 40)
DISC = planar.CounterweightLimit(thickness=0.01)
TASK = {
    "planar": 1,
    "units": {"length": "mm", "angle": "deg"},
    "start": "slider-crank",
    "wanted": [{"point": "E", "through": [[4 * k, 12 * (k % 5) - k * k / 4] for k in range(12)]}],
}
SEARCH = {
    "synthesise.DRAWS": 40,
    "synthesise.MATCHES": 2,
    "synthesise.ROUNDS": 2,
    "synthesise.GOOD": 0.0,
    "synthesise.SETTLED": 99,
    "fitting.design_fit.MAX_STEPS": 5,
}
"""Numbers of modules in `planar.synthesis`, for a search in which no fit goes on to its end."""


def measured():
    motion = planar.cycle("crank-rocker", 24)
    return {"B": motion.point("B").position}, {"A0": motion.inputs["A0"].position}


def calibrated(**options):
    positions, inputs = measured()
    start = planar.load("crank-rocker").with_values({"coupler.length": 0.182})
    return planar.calibrate(start, positions, ["coupler.length"], inputs=inputs, **options)


def marked(tmp_path, **options):
    (tmp_path / "answers.csv").write_text("seed 7\nstudent,variant,quantity,value,unit\nAnn,3,velocity of C,630,mm/s\n")
    return planar.mark_answers("four-bar", tmp_path / "answers.csv", **options)


def generated(tmp_path, **options):
    folder = tmp_path / f"{len([*tmp_path.iterdir()])}.zarr"
    return planar.generate(folder, 4, 15, steps=12, workers=1, **options)


CASES = {
    "balance": lambda _, **o: planar.balance("two-stroke-engine", counterweights=["crank"], limit=DISC, **o),
    "balance_tradeoff": lambda _, **o: planar.balance_tradeoff("two-stroke-engine", ["crank", "rod"], count=3, **o),
    "calibrate": lambda _, **o: calibrated(**o),
    "centres": lambda _, **o: planar.centres("watt-six-bar", **o),
    "circuits": lambda _, **o: planar.circuits("watt-six-bar", **o),
    "cognates": lambda _, **o: planar.cognates("four-bar", "E", **o),
    "conflict": lambda _, **o: planar.conflict("four-bar", **o),
    "cycle": lambda _, **o: planar.cycle("slider-crank", 12, circuit=True, **o),
    "forces": lambda _, **o: planar.forces(planar.cycle("balanced-lamp", 12), **o),
    "force_map": lambda _, **o: planar.force_map("excavator-arm", {"boom cylinder": (2.4, 2.6, 5)}, False, **o),
    "generate": generated,
    "gradient": lambda _, **o: planar.gradient(planar.cycle("slider-crank", 12), {"stroke": 13 * [1.0]}, **o),
    "harmonics": lambda _, **o: planar.harmonics("slider-crank", "stroke", **o),
    "inspect": lambda _, **o: planar.inspect("four-bar", **o),
    "mark_answers": marked,
    "modes": lambda _, **o: planar.modes("watt-six-bar", certify=False, **o),
    "parts": lambda _, **o: planar.parts("four-bar", **o),
    "problem_variants": lambda _, **o: planar.problem_variants("four-bar", 4, seed=7, **o),
    "sensitivity": lambda _, **o: planar.sensitivity(planar.cycle("slider-crank", 12), "stroke", **o),
    "simulate": lambda _, **o: planar.simulate("door-closer", 1.0, 20, **o),
    "sweep": lambda _, **o: planar.sweep("crank-rocker", {"coupler.length": FORTY}, 12, "B", block=10, workers=1, **o),
    "sweep_each": lambda _, **o: planar.sweep_each(["four-bar", "slider-crank"] * 3, 12, workers=1, **o),
    "synthesise": lambda _, **o: planar.synthesise(TASK, many=2, seed=5, **o),
    "tolerance": lambda _, **o: planar.tolerance(
        planar.solve("slider-crank"), "stroke", {"rod.length": "0.1 mm"}, guaranteed=True, **o
    ),
    "view": lambda folder, **o: planar.view("four-bar", folder / "page.html", **o),
}


def same_prefix(part, whole):
    """Whether a motion has the first rows of another."""
    assert len(part) <= len(whole)
    for each in named_points(part.mechanism):
        np.testing.assert_array_equal(part.point(each.name).position, whole.point(each.name).position[: len(part)])


def same_circuits(part, whole):
    known = [sorted((branch.low, branch.high) for branch in each.branches) for each in whole]
    for each in part:
        assert any(np.allclose(sorted((b.low, b.high) for b in each.branches), own) for own in known if own)
    assert any(REASON in remark for remark in part.remarks)


def same_modes(part, whole):
    assert len(part) <= len(whole)
    for mode, own in zip(part, whole, strict=False):
        assert mode.number == own.number
        np.testing.assert_array_equal(mode.z, own.z)
    assert any(REASON in remark for remark in part.remarks)


def same_designs(part, whole):
    ended = part.status[:, -1] != 0
    assert {part.outcomes[code] for code in part.status[ended, -1]} == {Outcome.INTERRUPTED}
    np.testing.assert_array_equal(part.position["B"][~ended], whole.position["B"][~ended])
    np.testing.assert_array_equal(part.acceleration["B"][~ended], whole.acceleration["B"][~ended])
    assert np.isnan(part.position["B"][ended]).all()
    assert any(f"{ended.sum()} of 40 designs: interrupted" in remark for remark in part.remarks)


def same_mechanisms(part, whole):
    assert len(part) < len(whole)
    for own, other in zip(part, whole, strict=False):
        for name in own.position:
            np.testing.assert_array_equal(own.position[name], other.position[name])
    assert REASON in part.remarks[0]


def same_search(part, whole):
    assert not part.is_finished
    assert any(REASON in remark for remark in part.remarks)


PARTS = {
    "circuits": same_circuits,
    "cycle": same_prefix,
    "modes": same_modes,
    "simulate": lambda part, whole: same_prefix(part.motion, whole.motion),
    "sweep": same_designs,
    "sweep_each": same_mechanisms,
    "synthesise": same_search,
}
"""What makes the part that a function returns one of the complete result; others raise."""


@pytest.fixture(autouse=True)
def small(monkeypatch):
    for name, value in SEARCH.items():
        monkeypatch.setattr(f"planar.synthesis.{name}", value)
    monkeypatch.setattr("planar.structures.linkage_store.BLOCK_SIZE", 5)
    monkeypatch.setattr("planar.batch.sweep_mechanisms.PART_SIZE", 2)


def outcome_of(result):
    if hasattr(result, "motion"):
        result = result.motion
    if hasattr(result, "is_finished"):
        return Outcome.SOLVED if result.is_finished else Outcome.INTERRUPTED
    status = getattr(result, "status", None)
    if status is not None:
        return Outcome.INTERRUPTED if np.any(status) else Outcome.SOLVED
    return result.outcome


def ended(name, folder, checks):
    """What a function returns that is ended after so many checks; None where it raises that it was."""
    with limited_by(CountedLimit(checks)) as limit:
        try:
            result = CASES[name](folder)
        except NoAnswer as problem:
            assert problem.outcome is Outcome.INTERRUPTED
            assert limit.ended_by == REASON
            assert REASON in problem.reason
            assert ";" in problem.reason, "what helps"
            return None
    if checks and not limit.ended_by:
        return None  # what the first run has found is not searched for again
    assert limit.ended_by == REASON
    assert name in PARTS
    assert outcome_of(result) is Outcome.INTERRUPTED
    return result


def test_every_function_with_a_timeout_is_looked_at():
    public = {name: getattr(planar, name) for name in planar.__all__}
    timed = {name for name, each in public.items() if "timeout" in getattr(inspect.unwrap(each), "__annotations__", ())}
    assert timed == set(CASES)
    for name in timed:
        assert "`timeout`" in public[name].__doc__, name


@pytest.mark.parametrize("name", CASES)
def test_a_function_is_ended_before_anything_and_on_its_way(name, tmp_path):
    with limited_by(CountedLimit(None)) as limit:
        whole = CASES[name](tmp_path)
    if name == "modes":
        whole.read()
    assert limit.asked or name == "modes"
    assert limit.ended_by == ""
    for checks in {0, limit.asked // 2, limit.asked - 1} if limit.asked else {0}:
        part = ended(name, tmp_path, checks) if name != "modes" else None
        if part is not None:
            PARTS[name](part, whole)


@pytest.mark.parametrize("checks", [0, 1, 2])
def test_a_list_of_assemblies_is_ended_as_it_is_read(checks):
    whole = planar.modes("watt-six-bar", certify=False)
    whole.read()
    part = planar.modes("watt-six-bar", certify=False)
    with limited_by(CountedLimit(checks)):
        part.read()
        assert part.outcome is Outcome.INTERRUPTED and part.total is None
        assert len(part) == len([*part]) < len(whole)
    same_modes(part, whole)
    assert part.reason == REASON
    assert bool(part) or REASON in part.refusal().reason


@pytest.mark.parametrize("name", CASES)
def test_what_is_no_time_is_refused_and_enough_time_changes_nothing(name, tmp_path):
    with pytest.raises(BadInput, match="timeout: a time above zero, in s, is wanted, not 0"):
        CASES[name](tmp_path, timeout=0)
    result, limited = CASES[name](tmp_path), CASES[name](tmp_path, timeout=1e6)
    if name in PARTS:
        assert outcome_of(result) is outcome_of(limited) is Outcome.SOLVED
    if name in ("cycle", "simulate"):
        PARTS[name](limited, result)
    assert repr(result) == repr(limited)


def test_a_swallowed_end_raises_as_well():
    """What handles an end as if it were none does not make a result of it."""
    with pytest.raises(NoAnswer, match=REASON), limited_by(CountedLimit(0)):
        planar.inspect("four-bar")


def test_reductions_and_stores_are_ended(tmp_path):
    def reduced(**options):
        measures = {"reach": "B.bounding_box", "length": "B.path_length", "count": lambda swept: np.arange(len(swept))}
        return planar.sweep(
            "crank-rocker", {"coupler.length": FORTY}, 12, block=10, workers=1, reduce=measures, **options
        )

    with limited_by(CountedLimit(None)) as limit:
        whole = reduced()
    with limited_by(CountedLimit(limit.asked // 2)):
        part = reduced()
    open_rows = part.status != 0
    assert 0 < open_rows.sum() < len(FORTY)
    for name in part:
        np.testing.assert_array_equal(part[name][~open_rows], whole[name][~open_rows])
        assert np.isnan(part[name][open_rows]).all()
    with pytest.raises(NoAnswer, match="before a block of designs was reduced"), limited_by(CountedLimit(0)):
        reduced()

    def stored():
        return planar.sweep(
            "crank-rocker", {"coupler.length": FORTY}, 12, "B", block=10, workers=1, store=tmp_path / "sweep.zarr"
        )

    half, sentence = (
        CountedLimit(limit.asked // 2),
        "of 40 designs, which the store has; the same sweep into this store",
    )
    with pytest.raises(NoAnswer, match=sentence), limited_by(half):
        stored()
    plain = planar.sweep("crank-rocker", {"coupler.length": FORTY}, 12, "B")
    np.testing.assert_array_equal(stored().position["B"][:], plain.position["B"])


def test_designs_of_the_general_path_are_ended_one_by_one():
    def swept():
        return planar.sweep("antiparallelogram", {"A0.position": np.linspace(1.0, 1.05, 6)}, 4, workers=1)

    with limited_by(CountedLimit(None)) as limit:
        whole = swept()
    with limited_by(CountedLimit(limit.asked // 2)):
        part = swept()
    done = part.status[:, -1] == 0
    assert 0 < done.sum() < 6
    for name in part.points:
        np.testing.assert_array_equal(part.position[name][done], whole.position[name][done])
