"""The band of a result within tolerances, drawn."""

import numpy as np
import pytest

import planar
from planar.drawing.diagrams.tolerance_band import tolerance_pictures
from planar.drawing.paper.picture import Fill, Label, Polyline
from planar.drawing.paper.scales import Scale
from planar.foundation.errors import BadInput

TOLERANCES = {"crank.length": 2e-4, "rocker.length": 3e-4}


def areas(picture, fill):
    return [mark for mark in picture.marks if isinstance(mark, Polyline) and mark.fill is fill]


def test_round_a_path_the_band_reaches_as_far_as_the_worst_case_by_the_factor_that_it_tells():
    band = planar.tolerance(planar.cycle("hoeken-straight-line", 36), "P", TOLERANCES)
    picture, shares = tolerance_pictures(band, Scale("length", 0.01, "mm"))
    (factor,) = {float(word) for word in picture.notes[0].split() if word.replace(".", "").isdigit()} - {
        float(f"{1e3 * band.worst.max():.6g}")
    }
    centre = band.nominal_rows[band.row] / 0.01
    spots = np.concatenate([each.points for each in areas(picture, Fill.WORST)])
    assert len(areas(picture, Fill.WORST)) == len(areas(picture, Fill.LIKELY)) == 36
    near = np.linalg.norm(spots - centre, axis=1)
    reach = factor * band.worst[band.row] / 0.01
    assert np.abs(near - reach).min() < 0.02 * reach
    texts = [mark.text for mark in shares.marks if isinstance(mark, Label)]
    assert texts[0] == max(TOLERANCES, key=lambda name: band.contribution[name][band.row])


def test_over_a_motion_the_strips_lie_between_the_limits():
    band = planar.tolerance(planar.cycle("hoeken-straight-line", 36), "rocker", TOLERANCES)
    picture, _ = tolerance_pictures(band)
    (worst,), (likely,) = areas(picture, Fill.WORST), areas(picture, Fill.LIKELY)
    heights = [np.ptp(np.array(each.points)[[k, -1 - k], 1]) for each in (worst, likely) for k in (0, 20)]
    ratio = 3.0 * band.std / band.upper
    assert heights[2] / heights[0] == pytest.approx(ratio[0], rel=1e-9)
    assert heights[3] / heights[1] == pytest.approx(ratio[20], rel=1e-9)


def test_one_position_has_no_band_to_draw():
    with pytest.raises(BadInput, match="over a motion"):
        tolerance_pictures(planar.tolerance(planar.solve("slider-crank"), "stroke", {"rod.length": 1e-4}))
