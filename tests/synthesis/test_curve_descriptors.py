"""Descriptors of curves beside integrals and exhaustive comparison; what is invariant is so to round-off."""

import numpy as np
import pytest

from planar.synthesis.matching.curve_descriptors import (
    align_curves,
    even_points,
    fourier_coefficients,
    lengths_along,
)

HARMONICS = 10


def random_curves(count, corners=40, seed=0):
    """Smooth closed curves of random series."""
    random = np.random.default_rng(seed)
    n = np.arange(-4, 5)
    c = (random.normal(size=(count, 9)) + 1j * random.normal(size=(count, 9))) / (1.0 + n**2)
    return c @ np.exp(2j * np.pi * np.outer(n, np.arange(corners)) / corners)


def resampled(curve, count):
    """Points evenly by length, by interpolation."""
    ends = np.append(curve, curve[0])
    along = np.append(0.0, np.cumsum(np.abs(np.diff(ends))))
    wanted = along[-1] * np.arange(count) / count
    return np.interp(wanted, along, ends.real) + 1j * np.interp(wanted, along, ends.imag)


def test_coefficients_are_the_integrals_by_length():
    curves = random_curves(3)
    found = fourier_coefficients(curves, HARMONICS)
    for curve, own in zip(curves, found, strict=True):
        n = np.arange(-HARMONICS, HARMONICS + 1)
        # Simpson's rule on every side, which the length goes along evenly
        ends = np.append(curve, curve[0])
        side = np.abs(np.diff(ends))
        along = np.append(0.0, np.cumsum(side)) / side.sum()
        x, weight = np.polynomial.legendre.leggauss(12)
        part = 0.5 * (x + 1.0)
        s = along[:-1, None] + part * np.diff(along)[:, None]
        z = ends[:-1, None] + part * np.diff(ends)[:, None]
        w = 0.5 * weight * np.diff(along)[:, None]
        by_integral = [(w * z * np.exp(-2j * np.pi * k * s)).sum() for k in n]
        assert np.allclose(own, by_integral, rtol=0, atol=1e-13)


def test_a_curve_without_length_is_its_place():
    found = fourier_coefficients(np.full((1, 8), 2.0 + 1.0j), 3)[0]
    assert found[3] == 2.0 + 1.0j
    assert not np.delete(found, 3).any()


def test_descriptors_follow_every_move_to_round_off():
    curves = random_curves(4)
    n = np.arange(-HARMONICS, HARMONICS + 1)
    own = fourier_coefficients(curves, HARMONICS)
    moved = fourier_coefficients((1.5 - 2.0j) * curves + (3.0 + 4.0j), HARMONICS)
    assert np.allclose(moved, (1.5 - 2.0j) * own + np.where(n == 0, 3.0 + 4.0j, 0.0), rtol=0, atol=1e-13)
    back = fourier_coefficients(curves[:, ::-1], HARMONICS)
    assert np.allclose(np.abs(back), np.abs(own[:, ::-1]), rtol=0, atol=1e-14)
    along = lengths_along(curves, True)
    begun = fourier_coefficients(np.roll(curves, -7, axis=1), HARMONICS)
    shift = along[:, 7:8] / along[:, -1:]
    assert np.allclose(begun, own * np.exp(2j * np.pi * n * shift), rtol=0, atol=1e-13)


def test_a_moved_curve_lies_upon_itself():
    curves = random_curves(30)
    coefficients = fourier_coefficients(curves, HARMONICS)
    wanted = np.roll(curves[17], -11)[::-1] * (0.4 + 0.9j) - 2.0
    found, alignment = align_curves(fourier_coefficients(wanted[None], HARMONICS)[0], coefficients)
    assert found[0] == 17
    assert alignment.distance[0] < 2e-4  # of shifts of a 65536th
    assert alignment.is_reversed[0]
    whole = lengths_along(curves[17:18], True)[0]
    assert np.isclose(alignment.shift[0], whole[10] / whole[-1], rtol=0, atol=1e-4)


@pytest.mark.parametrize("can_move", [True, False])
def test_alignment_is_that_of_exhaustive_search(can_move):
    curves, wanted, count = random_curves(25, seed=1), random_curves(1, seed=2)[0], 360
    found, alignment = align_curves(
        fourier_coefficients(wanted[None], 40)[0], fourier_coefficients(curves, 40), can_move
    )
    assert sorted(found) == list(range(25))
    assert (np.diff(alignment.distance) >= 0.0).all()
    w = resampled(wanted, count)
    size = 2.0 * np.sqrt(np.mean(np.abs(w - w.mean()) ** 2))
    for k, distance in zip(found, alignment.distance, strict=True):
        z = resampled(curves[k], count)
        best = np.inf
        for each in (z, z[::-1]):
            for shift in range(count):
                v = np.roll(each, shift)
                if can_move:
                    columns = np.stack([v, np.ones(count)], axis=1)
                    off = w - columns @ np.linalg.lstsq(columns, w, rcond=None)[0]
                else:
                    off = w - v
                best = min(best, np.mean(np.abs(off) ** 2))
        assert distance == pytest.approx(np.sqrt(best) / size, abs=2e-3)


def test_the_nearest_of_many_are_the_first_of_all():
    coefficients = fourier_coefficients(random_curves(500), HARMONICS)
    wanted = fourier_coefficients(random_curves(1, seed=5), HARMONICS)[0]
    every, whole = align_curves(wanted, coefficients)
    some, part = align_curves(wanted, coefficients, many=20)
    assert np.array_equal(some[:5], every[:5])
    assert np.allclose(part.distance[:5], whole.distance[:5], rtol=0, atol=0)


@pytest.mark.parametrize("is_closed", [True, False])
def test_points_lie_evenly_by_length(is_closed):
    curves = random_curves(6)
    along = lengths_along(curves, is_closed)
    found = even_points(curves, along, 33)
    for curve, own, points in zip(curves, along, found, strict=True):
        ends = np.append(curve, curve[0]) if is_closed else curve
        wanted = own[-1] * (np.arange(33) / 33 if is_closed else np.linspace(0.0, 1.0, 33))
        expected = np.interp(wanted, own, ends.real) + 1j * np.interp(wanted, own, ends.imag)
        assert np.allclose(points, expected, rtol=0, atol=1e-12)
