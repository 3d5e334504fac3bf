"""Cams with their rollers and flat faces, and racks with their pinions: what is cut touches, and cuts into nothing."""

from math import hypot, pi, radians, tan

import numpy as np
import pytest
from matplotlib.path import Path as Polygon

import planar
from planar.manufacture.plates import Plate, room_within, sampled
from planar.manufacture.rack_teeth import rack_outline
from planar.results.motion import Motion
from tests.cams import cam_document
from tests.cut_plates import drawn, meet

CAMS = ("valve-cam", "tangent-cam", "measured-cam", "cam-with-spring")
RUNS = {  # input that runs, from where to where, and what fits
    "rack-differential": ("lower", -0.06, 0.12, {}),
    "rolling-wheel": ("axle box", 0.0, 1.0, {"scale": 1.0, "sheet": (9.0, 9.0)}),
    "rack-steering": ("O", -2.0, 2.0, {"sheet": (1.3, 0.4), "pin": 0.002}),
}


def plate_of(found: planar.Parts, kind: str) -> Plate:
    return next(plate for plate in found.plates if plate.kind == kind)


def centre_of(plate: Plate, motion: Motion, row: int) -> np.ndarray:
    """Where the middle of a round plate is (m)."""
    return drawn(plate, motion, row).mean(axis=0)


@pytest.mark.parametrize(
    "model",
    [
        *map(planar.load, CAMS),
        *(planar.from_dict(cam_document("roller", clockwise=backwards)) for backwards in (False, True)),
        planar.from_dict(cam_document("swinging roller", clockwise=True)),
    ],
    ids=[*CAMS, "sliding", "sliding, clockwise", "swinging, clockwise"],
)
def test_a_roller_touches_its_cam_all_round(model):
    found = planar.parts(model, scale=1.0, pin=0.004)
    assert found.is_clear
    cam, roller = plate_of(found, "profile"), plate_of(found, "roller")
    assert cam.layer == roller.layer
    motion = planar.cycle(model, steps=36)
    for row in range(0, 37, 4):
        profile, (x, y) = drawn(cam, motion, row), centre_of(roller, motion, row)
        assert -room_within([*map(tuple, profile)], (x, y)) == pytest.approx(roller.reach / 1e3, abs=1e-5)


@pytest.mark.parametrize("follower", ["flat", "swinging flat"])
@pytest.mark.parametrize("clockwise", [False, True])
def test_the_shoe_of_a_flat_face_touches_its_cam_within_its_length(follower, clockwise):
    mechanism = planar.from_dict(cam_document(follower, clockwise=clockwise))
    found = planar.parts(mechanism, pin=0.004)
    assert found.is_clear
    cam, shoe = plate_of(found, "profile"), plate_of(found, "shoe")
    motion = planar.cycle(mechanism, steps=36)
    for row in range(0, 37, 3):
        profile, corners = drawn(cam, motion, row), drawn(shoe, motion, row)
        end, start, back = corners[0], corners[1], corners[3]
        way = (end - start) / np.linalg.norm(end - start)
        normal = (back - end) / np.linalg.norm(back - end)
        up, along = (profile - start) @ normal, (profile - start) @ way
        assert up.max() == pytest.approx(0.0, abs=1e-5)
        assert 0.0 < along[up.argmax()] < np.linalg.norm(end - start)


@pytest.mark.parametrize("model", RUNS)
def test_a_rack_and_its_pinion_mesh_without_cutting_into_each_other(model):
    pair, start, stop, more = RUNS[model]
    found = planar.parts(model, pair=pair, start=start, stop=stop, **more)
    assert found.is_clear
    wheel = plate_of(found, "wheel")
    racks = [plate for plate in found.plates if plate.kind == "strip"]
    assert {plate.layer for plate in racks} == {wheel.layer}
    motion = planar.cycle(model, 24, start, stop, pair)
    scale = found.scale
    for rack in racks:
        assert rack.module == pytest.approx(wheel.module)
        reached = []
        for row in range(25):
            teeth, gear = (scaled(each, motion, row, scale) for each in (rack, wheel))
            assert not meet(teeth, gear)
            reached.append(min(np.linalg.norm(teeth[:, None] - gear[None], axis=2).min(axis=1)))
        # corners lie off the flanks, so that the nearest of them are not much more than the play of the teeth apart
        assert min(reached) < 0.3 * rack.module / 1e3


def scaled(plate: Plate, motion: Motion, row: int, scale: float) -> np.ndarray:
    """The outline (m) in the size of the mechanism, shrunk again to that of the plates."""
    larger = plate._replace(outline=tuple((x / scale, y / scale, bulge) for x, y, bulge in plate.outline))
    return drawn(larger, motion, row) * scale


def test_a_rack_holds_as_much_pitch_as_its_teeth_and_two_pins_hold_it():
    found = planar.parts("rack-differential", pair="lower", start=-0.06, stop=0.12)
    rack, bar = plate_of(found, "strip"), next(plate for plate in found.plates if plate.name == "lower rack")
    assert [hole.pin for hole in rack.holes] == ["lower mesh 1", "lower mesh 2"]
    assert {hole.pin for hole in rack.holes} < {hole.pin for hole in bar.holes}
    assert {hole.at for hole in rack.holes} < {hole.at for hole in bar.holes}
    assert abs(rack.layer - bar.layer) == 1
    (x, y), (u, v) = (hole.at for hole in rack.holes)
    assert rack.teeth == 15  # a whole number but for round-off
    assert hypot(u - x, v - y) > rack.teeth * pi * rack.module - 3.0 * pi * rack.module


def test_teeth_of_a_rack_are_as_wide_as_iso_53_says():
    module, angle = 2.0, radians(20.0)
    outline, teeth = rack_outline((-30.0, 30.0), module, angle, 0.5, 0.0, 10.0)
    assert teeth == 9
    tips = sorted(x for x, y, _ in outline if y == pytest.approx(module))
    wide = pi * module / 2.0 - 2.0 * module * tan(angle)
    assert np.diff(tips)[::2] == pytest.approx([wide] * teeth)
    assert np.diff(tips[::2]) == pytest.approx([pi * module] * (teeth - 1))
    assert any((a + b) / 2.0 == pytest.approx(0.5) for a, b in zip(tips[::2], tips[1::2], strict=True))
    roots = sorted(x for x, y, _ in outline if y == pytest.approx(-1.25 * module))
    assert len(roots) == 2 * teeth + 2
    area = sum(x * v - u * y for (x, y, _), (u, v, _) in zip(outline, [*outline[1:], outline[0]], strict=True)) / 2.0
    assert area > 0.0
    assert area == pytest.approx(
        60.0 * (10.0 - 1.25 * module) + teeth * 2.25 * module * (wide + 2.25 * module * tan(angle))
    )


def test_how_far_a_place_is_within_a_polygon():
    loop = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 4.0), (0.0, 10.0)]
    assert room_within(loop, (2.0, 2.0)) == pytest.approx(2.0)
    assert room_within(loop, (5.0, 9.0)) < 0.0 < room_within(loop, (5.0, 2.0))
    rng = np.random.default_rng(5)
    for x, y in rng.uniform(-2.0, 12.0, (60, 2)):
        assert (room_within(loop, (x, y)) > 0.0) == bool(Polygon([*loop, loop[0]]).contains_point((x, y)))


@pytest.mark.parametrize(
    ("document", "told"),
    [
        (cam_document("point"), "a bare point"),
        (cam_document("roller") | {"units": {"length": "mm", "angle": "deg"}}, "no room for a pin"),
    ],
)
def test_cams_that_are_no_plates_say_why(document, told):
    with pytest.raises(planar.BadInput, match=told):
        planar.parts(planar.from_dict(document), pin=0.014)


def test_a_strap_round_a_sector_has_no_teeth():
    with pytest.raises(planar.BadInput, match=r"horsehead: .*that is a strap"):
        planar.parts("pump-jack")


def test_all_outlines_go_round_anticlockwise():
    found = [planar.parts("rack-differential", pair="lower", start=-0.06, stop=0.12), *map(planar.parts, CAMS)]
    for plate in (plate for each in found for plate in each.plates):
        points = sampled(plate.outline)
        turned = sum(x * v - u * y for (x, y), (u, v) in zip(points, [*points[1:], points[0]], strict=True))
        assert turned > 0.0
