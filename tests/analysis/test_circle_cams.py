"""Cams of circles against the closed forms of textbooks, and against their own circles."""

from math import acos, cos, degrees, pi, radians, sin, sqrt

import numpy as np
import pytest

import planar
from tests.cams import FOLLOWERS, cam_document


def circle_cam(follower="point", noses=(((0.0, 23.6), 23.9),), flank=None, radial=True, speed="1 rad/s", **more):
    """A follower on a base circle of 30 mm with noses (mm); `radial`: its line goes through the cam's centre."""
    document = cam_document(follower)
    if radial:
        document["links"]["ground"]["points"]["G"] = [0, 0]
    entry = {key: value for key, value in document["pairs"][2].items() if key not in ("law", "start")}
    entry |= {"base_radius": 30, "noses": [{"at": list(at), "radius": radius} for at, radius in noses]}
    document["pairs"][2] = entry | ({} if flank is None else {"flank_radius": flank}) | more
    document["inputs"] = [{"pair": "O", "position": 0, "velocity": speed}]
    return planar.from_dict(document)


def test_a_tangent_cam_has_the_closed_forms_of_books():
    """Flank: s = (r1 + r2)(sec t - 1); nose: s from l cos + sqrt(l^2 - r^2 sin^2), l = r2 + r3 (Khurmi, Gupta)."""
    r1, r2, ascent, lift = 30.0, 17.5, radians(75), 17.5
    r = lift / (1.0 - cos(ascent))
    r3 = r1 + lift - r
    mechanism = circle_cam("roller", [((0.0, r), r3)], roller_radius=r2, speed="600 rpm")
    speed, on_flank = 20.0 * pi, np.arctan(r * sin(ascent) / (r1 + r2))
    for t in (1e-6, 0.2, on_flank - 1e-6, on_flank + 1e-6, 0.9, ascent):
        state = planar.solve(mechanism, {"O": t - ascent}).point("P")
        if t < on_flank:
            s = (r1 + r2) * (1.0 / cos(t) - 1.0)
            v = (r1 + r2) * sin(t) / cos(t) ** 2
            a = (r1 + r2) * (2.0 - cos(t) ** 2) / cos(t) ** 3
        else:
            p, arm = ascent - t, r2 + r3
            root = sqrt(arm**2 - (r * sin(p)) ** 2)
            s = r * cos(p) + root - r1 - r2
            v = r * sin(p) + r**2 * sin(2.0 * p) / (2.0 * root)
            a = -r * cos(p) - (r**2 * arm**2 * cos(2.0 * p) + r**4 * sin(p) ** 4) / root**3
        assert state.position[1] * 1e3 - r1 - r2 == pytest.approx(s, abs=1e-11)
        assert state.velocity[1] * 1e3 == pytest.approx(v * speed, rel=1e-9)
        assert state.acceleration[1] * 1e3 == pytest.approx(a * speed**2, rel=1e-9)
    first = planar.solve(mechanism, {"O": 1e-9 - ascent}).point("P").acceleration[1]
    assert first == pytest.approx(187.6, abs=0.1)  # as printed, with 62.84 rad/s


def test_a_circular_arc_cam_with_a_flat_face_has_the_closed_forms_of_books():
    """Flank: s = (R - r1)(1 - cos t), nose: s = r cos(a - t) + r2 - r1 (R. S. Khurmi, J. K. Gupta, ch. Cams)."""
    r1, big, r, r2 = 30.0, 120.0, 28.0, 8.0
    mechanism = circle_cam("flat", [((0.0, r), r2)], big, speed="10 rad/s")
    # the triangle of the centres of base circle, flank and nose
    ascent = pi - acos(((big - r1) ** 2 + r**2 - (big - r2) ** 2) / (2.0 * (big - r1) * r))
    on_flank = acos(((big - r1) ** 2 + (big - r2) ** 2 - r**2) / (2.0 * (big - r1) * (big - r2)))
    for t in (1e-6, 0.5 * on_flank, on_flank - 1e-6, on_flank + 1e-6, 0.5 * (on_flank + ascent), ascent):
        state = planar.solve(mechanism, {"O": t - ascent}).point("P")
        flank = (big - r1) * np.array([1.0 - cos(t), 10.0 * sin(t), 100.0 * cos(t)])
        p = ascent - t
        nose = np.array([r * cos(p) + r2 - r1, 10.0 * r * sin(p), -100.0 * r * cos(p)])
        s, v, a = flank if t < on_flank else nose
        assert state.position[1] * 1e3 - r1 == pytest.approx(s, abs=1e-11)
        assert state.velocity[1] * 1e3 == pytest.approx(v, rel=1e-9)
        assert state.acceleration[1] * 1e3 == pytest.approx(a, rel=1e-9)


@pytest.mark.parametrize("follower", FOLLOWERS)
@pytest.mark.parametrize("flank", [None, 150.0])
def test_the_envelope_of_the_follower_is_made_of_the_circles(follower, flank):
    """The law gives back the circles it was made of, whatever follower goes round them."""
    noses = [((10.0, 22.0), 14.0), ((-18.0, 12.0), 17.0)]
    if flank is None and follower.endswith("flat"):
        with pytest.raises(planar.BadInput, match="a flat face would strike straight tangents"):
            circle_cam(follower, noses, flank)
        return
    found = planar.cam_profile(circle_cam(follower, noses, flank, radial=False))
    pieces = found.cam.lift_pieces(found.shapes)
    assert sum(piece.stop - piece.start for piece in pieces) == pytest.approx(2.0 * pi)
    assert found.problem() == ""
    centres = iter([((0.0, 0.0), 30.0), *reversed(noses)])
    for piece, points, radii in zip(
        pieces, np.split(found.profile, len(pieces)), np.split(found.curvature_radius, len(pieces)), strict=True
    ):
        if piece.name in ("base circle", "nose"):
            at, radius = next(centres)
            np.testing.assert_allclose(np.hypot(*(points * 1e3 - at).T), radius, rtol=1e-9)
            np.testing.assert_allclose(radii[1:-1] * 1e3, radius, rtol=1e-6)
        elif flank is not None:
            np.testing.assert_allclose(radii[1:-1] * 1e3, flank, rtol=1e-6)
        else:
            assert np.all(np.abs(radii[1:-1]) > 1e3)
    # the lift and its first derivative go on at every joint
    ends = found.lift[:, [k * 121 + j for k in range(len(pieces)) for j in (0, 120)]]
    after, before = ends[:2, ::2], np.roll(ends[:2, 1::2], 1, axis=1)
    np.testing.assert_allclose(after, before, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"noses": [((0.0, 1.0), 5.0)]}, "a circle lies within the one before or after it"),
        ({"flank_radius": 20}, "flanks of this radius do not reach round the circles that they join"),
        ({"start": 5}, "the circles of a cam stand in its own axes"),
        (
            {"law": [{"motion": "dwell", "in": 360}]},
            "the 'law' of its lift or by the 'noses' of its profile: by one",
        ),
    ],
)
def test_circles_that_make_no_cam_are_refused_in_one_sentence(change, sentence):
    with pytest.raises(planar.BadInput) as refused:
        circle_cam("roller", **change)
    assert sentence in str(refused.value)


def test_the_tangent_cams_of_the_models_are_driven_and_swept():
    mechanism = planar.load("tangent-cam")
    assert degrees(planar.cam_profile(mechanism).greatest_pressure_angle.value) == pytest.approx(25.6473, abs=1e-4)
    radii = np.array([28.0, 30.0, 32.0]) * 1e-3
    swept = planar.sweep(mechanism, {"lift.base_radius": radii}, 36)
    for index, radius in enumerate(radii):
        alone = planar.cycle(
            planar.from_dict(
                planar.to_dict(mechanism) | {"pairs": [*planar.to_dict(mechanism)["pairs"][:2], changed(radius)]}
            ),
            steps=36,
        )
        np.testing.assert_allclose(swept.acceleration["P"][index], alone.point("P").acceleration, atol=1e-9)


def changed(radius):
    entry = planar.to_dict(planar.load("tangent-cam"))["pairs"][2]
    return entry | {"base_radius": f"{radius} m"}
