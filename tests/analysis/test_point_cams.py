"""Cams whose profile is given by points: laws that come back, closed forms, and the first contact by brute force."""

from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest

import planar
from planar.document.revised.changed_numbers import with_values
from planar.equations.mechanism_numbers import shapes_of_links
from tests.cams import FOLLOWERS, cam_document
from tests.draws import first_cases, is_exhaustive, part

some_followers = pytest.mark.parametrize("follower", part(FOLLOWERS, 2))


def point_cam(follower, points, speed="10 rad/s", radial=False, **more):
    """A follower on a profile through points (mm)."""
    document = cam_document(follower)
    if radial:
        document["links"]["ground"]["points"]["G"] = [0, 0]
    entry = {key: value for key, value in document["pairs"][2].items() if key not in ("law", "start", "base_radius")}
    document["pairs"][2] = entry | {"profile": np.asarray(points).tolist()} | more
    document["inputs"] = [{"pair": "O", "position": 60, "velocity": speed}]
    return planar.from_dict(document)


def polar(radius, many=90):
    """Points (many, 2) at a radius as a function of the angle."""
    angle = np.linspace(0.0, 2.0 * pi, many, endpoint=False)
    return radius(angle)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def lobes(rng, depth, hollow=0.0):
    """A closed curve of random harmonics about a circle of 40 mm; with four lobes of which some hollows are bridged."""
    size, phase = rng.uniform(-depth, depth, 4), rng.uniform(0.0, 2.0 * pi, 4)
    size[3] += hollow
    return polar(lambda a: 40.0 + sum(size[k] * np.cos((k + 1) * a + phase[k]) for k in range(4)))


@some_followers
def test_points_of_a_profile_give_back_its_law_with_the_fourth_order_of_their_distance(follower):
    law = planar.cam_profile(planar.from_dict(cam_document(follower)))
    angles, errors = np.linspace(0.0, 2.0 * pi, 400), []
    for many in (36, 72, 144):
        points = law.at(np.linspace(0.0, 2.0 * pi, many, endpoint=False)).profile[::-1] * 1e3
        cam = point_cam(follower, points).pairs[2]
        found, wanted = cam.lift_rates(angles, law.shapes), law.cam.lift_rates(angles - law.cam.start, law.shapes)
        apart = (cam.rest_position(law.shapes) - law.cam.rest_position(law.shapes)) * cam.side
        errors.append(np.abs(found[0] + apart - wanted[0]).max())
        velocity = np.abs(found[1] - wanted[1]).max()
    assert np.log2(errors[0] / errors[2]) == pytest.approx(8.0, abs=1.2)  # of two halvings
    assert errors[2] < 4e-7
    assert velocity < 3e-5


@pytest.mark.parametrize("follower", ["roller", "flat", "point"])
def test_an_eccentric_circle_by_points_is_the_closed_form(follower):
    """s = e cos θ + sqrt(R^2 - e^2 sin^2 θ) with R to the roller's middle; of a flat face s = e cos θ + R."""
    e, radius, speed = 9.0, 31.0, 10.0
    circle = radius * np.exp(2j * pi * np.arange(120) / 120) + 1j * e
    mechanism = point_cam(follower, np.stack([circle.real, circle.imag], axis=1), radial=True)
    reach = radius + (10.0 if follower == "roller" else 0.0)
    for angle in first_cases((0.0, 0.4, 3.3, 2.0, 5.0), 3):
        point = planar.solve(mechanism, {"O": angle}).point("P")
        if follower == "flat":
            s, v, a = e * cos(angle) + radius, -e * sin(angle), -e * cos(angle)
        else:
            root = sqrt(reach**2 - (e * sin(angle)) ** 2)
            s, v = e * cos(angle) + root, -e * sin(angle) - e**2 * sin(2.0 * angle) / (2.0 * root)
            a = -e * cos(angle) - e**2 * cos(2.0 * angle) / root - (e**2 * sin(2.0 * angle)) ** 2 / (4.0 * root**3)
        assert point.position[1] * 1e3 == pytest.approx(s, abs=2e-6)
        assert point.velocity[1] * 1e3 == pytest.approx(v * speed, abs=2e-3)
        assert point.acceleration[1] * 1e3 == pytest.approx(a * speed**2, abs=2.0)


@pytest.mark.parametrize("follower", ["roller", "swinging roller", "flat", "swinging flat"])
@pytest.mark.parametrize("seed", part([0, 1, 2], 3))
def test_the_first_contact_is_that_of_brute_force(follower, seed):
    """Of thousands of points of the curve the highest that the follower's face meets, by its own geometry."""
    rng = np.random.default_rng(seed)
    flat = follower.endswith("flat")
    mechanism = point_cam(
        follower, lobes(rng, 0.6 if flat else 1.0, 0.0 if flat else 9.0), **({} if flat else {"roller_radius": 14})
    )
    cam = mechanism.pairs[2]
    assert flat == (not mechanism.remarks)  # over hollows the contact jumps
    outline = cam.profile_by_points.outline(20001)
    shapes = shapes_of_links(mechanism)
    lift = cam.profile_by_points.solved(cam._follower_rest([shapes[body] for body in cam.bodies]))
    tolerance = 2e-8 + lift.deviation * (0.09 if follower.startswith("swinging") else 1.0)  # m, of an arm of 80 mm
    assert tolerance < 6e-7
    for angle in rng.uniform(0.0, 2.0 * pi, 12 if is_exhaustive() else 5):
        state = planar.solve(with_values(mechanism, {"O.position": angle}))  # not followed from another angle
        turned = complex(cos(angle), sin(angle)) * (outline[:, 0] + 1j * outline[:, 1])
        middle = complex(*state.point("P").position)
        if flat:
            tilt = pi / 2 if follower == "flat" else state.link("follower").angle + radians(95)
            normal = complex(cos(tilt), sin(tilt))
            gap = ((middle - turned) * np.conj(normal)).real
        else:
            gap = np.abs(turned - middle) - 0.014
        assert gap.min() == pytest.approx(0.0, abs=tolerance)


@some_followers
def test_velocities_are_those_of_differences_and_batches_say_the_same(follower):
    rng, step = np.random.default_rng(5), 1e-6
    mechanism = point_cam(follower, lobes(rng, 0.6 if follower.endswith("flat") else 3.0))
    for angle in (0.3, 2.2, 4.1):
        before, state, after = (planar.solve(mechanism, {"O": angle + by}) for by in (-step, 0.0, step))
        slope = (after.point("P").position - before.point("P").position) / (2.0 * step)
        np.testing.assert_allclose(state.point("P").velocity, slope * 10.0, atol=1e-7)
    single = planar.cycle(mechanism, steps=36)
    moved = np.array([-0.001, 0.0, 0.002])
    name = "ground.C.x" if follower.startswith("swinging") else "ground.G.x"
    here = planar.dimensions(mechanism)[name]
    swept = planar.sweep(mechanism, {name: here + moved}, 36)
    np.testing.assert_allclose(swept.position["P"][1], single.point("P").position, atol=1e-13)
    np.testing.assert_allclose(swept.acceleration["P"][1], single.point("P").acceleration, atol=1e-9)
    other = planar.cycle(planar.from_dict(planar.to_dict(mechanism)), steps=36)
    np.testing.assert_allclose(other.point("P").position, single.point("P").position, atol=1e-15)
    run = planar.prepared(mechanism, steps=36)()
    np.testing.assert_allclose(run.position["P"], single.point("P").position, atol=1e-13)


@pytest.mark.xfail(strict=True, raises=AssertionError, reason="the follower is not followed over jumps")
def test_a_sliding_follower_beside_the_centre_goes_on_where_the_contact_jumps():
    points = lobes(np.random.default_rng(1), 1.0, 9.0)
    assert "branch lost" not in repr(planar.cycle(point_cam("roller", points, roller_radius=14), steps=36))
