"""Catalogues: motions are those of `planar.cycle`, files are made once, and made anew where they are damaged."""

from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.link_shapes import link_shape
from planar.model.mechanism import named_points
from planar.synthesis.swept.array_store import KEPT_SWEEPS
from planar.synthesis.swept.bare_mechanism import bare_mechanism
from planar.synthesis.swept.design_motions import MotionSweeps
from planar.synthesis.swept.swept_catalogue import swept_catalogue

FOUR_BAR = ("AD.D.x", "AD.D.y", "AB.length", "BC.length", "DC.length")
SLIDER_CRANK = ("crank.length", "rod.length", "stroke.line.angle")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path / "cache"))


def bare(model, *points):
    return bare_mechanism(planar.load(model), points)


def misses(found, k, middle):
    """How far a design's points are from those of its own cycles back to where it begins, of each assembly (m)."""
    motions = found.motions
    pair = found.mechanism.inputs[0].pair
    numbers = dict(zip(found.names, map(float, found.numbers[k]), strict=True))
    first, step = float(motions.first_input[k]), float(motions.input_step[k])
    here = first + middle * step
    mechanism = found.mechanism.with_values({**numbers, f"{pair}.position": here})
    shapes = {link.name: link_shape(link) for link in mechanism.links}
    for mode in planar.modes(mechanism, certify=False):
        try:
            motion = planar.cycle(mode.mechanism, middle, here, first, pair)
        except NoAnswer:
            continue
        worst = 0.0
        for name, members in named_points(mechanism):
            for link, point in members:
                if link in found.links:
                    j, at = found.links.index(link), shapes[link].position(point)
                    turn = np.exp(1j * motions.angles[j, k, : middle + 1])
                    own = motions.origins[j, k, : middle + 1] + turn * complex(at.x, at.y)
                    far = own[::-1] - motion.point(name).position @ [1.0, 1.0j]
                    worst = max(worst, np.abs(far).max())
        yield worst


@pytest.mark.parametrize(
    ("model", "names"),
    [("four-bar", FOUR_BAR), ("slider-crank", SLIDER_CRANK), ("geared-five-bar", ("AC.length", "OA.length"))],
)
def test_motions_are_those_of_cycles(model, names):
    found = swept_catalogue(bare(model), names, size=60, samples=40)
    assert len(found) == 60
    motions = found.motions
    kinds = [np.flatnonzero(motions.is_closed), np.flatnonzero(~motions.is_closed)]
    for k in [*kinds[0][:3], *kinds[1][:3]]:
        count = int(motions.sample_count[k])
        assert min(misses(found, k, count // 2)) < 2e-6
        assert np.isfinite(motions.angles[:, k, :count]).all()
        assert np.isnan(motions.origins[:, k, count:]).all()


def test_a_sliding_input_runs_between_its_limits():
    mechanism = bare("two-stroke-engine")
    slide = next(name for name in planar.dimensions(mechanism) if name.endswith(".line.angle")).split(".")[0]
    driven = replace(mechanism, inputs=(mechanism.inputs[0]._replace(pair=slide, position=0.1),))
    names = tuple(name for name in planar.dimensions(driven) if name.endswith(".length"))
    found = swept_catalogue(driven, names, size=20, samples=30)
    motions = found.motions
    assert (motions.sample_count == 30).all()
    assert not motions.is_closed.any()
    numbers = found.numbers[:, [names.index(name) for name in names]]
    stroke = motions.input_step * 29
    assert np.allclose(stroke, 2.0 * numbers.min(axis=1), rtol=1e-6)


def test_closed_motions_come_back():
    found = swept_catalogue(bare("four-bar"), FOUR_BAR, size=200)
    motions, closed = found.motions, found.motions.is_closed
    assert closed.mean() > 0.5
    turned = np.abs(np.exp(1j * motions.angles[:, closed, 0]) - np.exp(1j * motions.angles[:, closed, -1]))
    steps = np.abs(np.diff(np.exp(1j * motions.angles[:, closed]), axis=2)).max(axis=(0, 2))
    assert (turned.max(axis=0) <= 2.0 * steps).all()
    assert np.allclose(motions.input_step * motions.angles.shape[2], 2.0 * np.pi)


def test_geared_motions_take_the_turns_that_they_need():
    found = swept_catalogue(bare("geared-five-bar"), ("AC.length",), size=8)
    assert np.allclose(found.motions.input_step * found.sample_count, 4.0 * np.pi)
    assert found.motions.is_closed.any()


def test_numbers_keep_their_bounds():
    lower, upper = np.array([-0.1, 0.0, 0.02, -np.inf, 0.05]), np.array([0.2, 0.0, 0.05, 0.1, np.inf])
    found = swept_catalogue(bare("four-bar"), FOUR_BAR, lower, upper, size=100)
    assert (found.numbers >= lower).all()
    assert (found.numbers <= upper).all()
    assert np.ptp(found.numbers[:, 0]) > 0.1


def test_relative_motions_are_kept_where_they_are_asked_for():
    found = swept_catalogue(bare("four-bar"), FOUR_BAR, pairs=("C", "D"), size=20)
    turn = found.motions.angles
    told = found.motions.values["C"]
    between = turn[found.links.index("DC")] - turn[found.links.index("BC")]
    solved = np.isfinite(told)
    assert np.allclose(np.exp(1j * told[solved]), np.exp(1j * between[solved]), rtol=0, atol=1e-5)


def test_the_same_seed_draws_the_same_designs(monkeypatch):
    monkeypatch.setenv("PLANAR_CACHE", "off")
    one, same, other = (swept_catalogue(bare("four-bar"), FOUR_BAR, size=50, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one.numbers, same.numbers)
    assert np.array_equal(one.motions.angles, same.motions.angles, equal_nan=True)
    assert not np.array_equal(one.numbers, other.numbers)


def test_what_is_kept_is_not_swept_again(monkeypatch):
    made = swept_catalogue(bare("four-bar"), FOUR_BAR, size=50, pairs=("D",))
    monkeypatch.setattr(MotionSweeps, "run", None)
    kept = swept_catalogue(bare("four-bar"), FOUR_BAR, size=50, pairs=("D",))
    assert np.array_equal(made.numbers, kept.numbers)
    assert np.array_equal(made.motions.origins, kept.motions.origins, equal_nan=True)
    assert np.array_equal(made.motions.values["D"], kept.motions.values["D"], equal_nan=True)
    assert not kept.numbers.flags.writeable
    with pytest.raises(TypeError):  # another size is another catalogue
        swept_catalogue(bare("four-bar"), FOUR_BAR, size=51)


def test_a_damaged_file_is_made_anew():
    made = swept_catalogue(bare("four-bar"), FOUR_BAR, size=50)
    (path,) = KEPT_SWEEPS.folder().glob("*.designs")
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], whole[:-9] + b"x" * 9, b""):
        path.write_bytes(damaged)
        again = swept_catalogue(bare("four-bar"), FOUR_BAR, size=50)
        assert np.array_equal(made.numbers, again.numbers)
        assert path.read_bytes() == whole


def test_points_that_no_pair_needs_refuse_no_design():
    mechanism = bare("four-bar", "E")
    assert [link.names for link in mechanism.links] == [("A", "D"), ("A", "B"), ("B", "C", "E"), ("D", "C")]
    assert bare("klann-leg").sketch == planar.load("klann-leg").sketch


def test_a_mechanism_without_input_is_refused():
    with pytest.raises(BadInput, match="no input"):
        swept_catalogue(replace(bare("four-bar"), inputs=()), FOUR_BAR, size=5)


def test_progress_is_told():
    told = []
    swept_catalogue(bare("four-bar"), FOUR_BAR, size=40, progress=lambda done, of: told.append((done, of)))
    assert told[-1] == (40, 40)
    assert told == sorted(told)
