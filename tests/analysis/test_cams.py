"""Cams against closed forms, printed values, and envelopes computed another way."""

import json
from itertools import product
from math import cos, pi, radians, sin

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import DesignRun
from planar.batch.reference_design import reference_design
from planar.document.revised.changed_numbers import with_values
from tests.cams import FOLLOWERS, cam_document
from tests.draws import first_cases

every_follower = pytest.mark.parametrize("follower", FOLLOWERS)
both_senses = pytest.mark.parametrize("clockwise", [False, True])


def alternating(case):
    """Followers in turn with one sense and the other first."""
    follower, clockwise = case
    return clockwise == bool(FOLLOWERS.index(follower) % 2)


def profiled(follower, **more):
    return planar.cam_profile(planar.from_dict(cam_document(follower, **more)))


def radial_cam(law, velocity="1 rad/s", **more):
    """A radial follower with a point, a roller or a flat face; lengths in mm, angles in deg."""
    document = cam_document("point")
    document["links"]["ground"]["points"]["G"] = [0, 0]
    entry = document["pairs"][2] | {"law": law, "start": 0} | more
    document["pairs"][2] = entry
    document["inputs"] = [{"pair": "O", "position": 0, "velocity": velocity}]
    return planar.from_dict(document)


@pytest.mark.parametrize("follower", [each for each in FOLLOWERS if each != "point"])
@both_senses
def test_the_profile_is_the_envelope_of_the_followers_face(follower, clockwise):
    """By brute force: the follower's face in thousands of positions about the cam leaves just the profile free."""
    found = profiled(follower, clockwise=clockwise)
    assert not found.problem()
    fine = found.at(np.linspace(0.0, 2.0 * pi, 3601))
    if follower.endswith("flat"):
        # in every direction the nearest of all faces; the profile's support there is that of the face that has it
        turned = np.arctan2(*fine.normal.T[::-1])
        for normal, own in zip(found.normal[::50], found.profile[::50], strict=True):
            assert (fine.profile @ normal).max() == pytest.approx(own @ normal, abs=1e-7)
        assert np.ptp(np.unwrap(turned)) == pytest.approx(2.0 * pi)
        return
    apart = np.hypot(*(fine.pitch_curve[:, None] - found.profile[None, ::20]).T)
    np.testing.assert_allclose(apart.min(axis=1), found.roller_radius, atol=5e-7)


@pytest.mark.parametrize(
    ("follower", "clockwise"), first_cases(sorted(product(FOLLOWERS, (False, True)), key=alternating), len(FOLLOWERS))
)
def test_solved_positions_touch_the_profile_and_powers_balance(follower, clockwise):
    document = cam_document(follower, clockwise=clockwise)
    document["masses"] = [{"link": "follower", "mass": 2, "at": "P", "inertia": 0.01}]
    document["loads"] = [{"point": "P", "force": [-5, -100]}]
    mechanism = planar.from_dict(document)
    found = planar.cam_profile(mechanism)
    for degrees in first_cases((75.0, 190.0, 333.0, 10.0), 3):
        state = planar.solve(mechanism, {"O": radians(degrees)})
        angle = found.cam.sense * (radians(degrees) - found.cam.start) % (2.0 * pi)
        at = found.at(np.array([angle]))
        turn = np.exp(1j * radians(degrees))
        touch, normal = (complex(*each[0]) * turn for each in (at.profile, at.normal))
        middle = complex(*state.point("P").position)
        if follower.endswith("flat"):
            assert ((middle - touch) * np.conj(normal)).real == pytest.approx(0.0, abs=1e-14)
        else:
            assert middle == pytest.approx(touch + found.roller_radius * normal, abs=1e-14)
        forces = planar.forces(state)
        reaction = forces.reactions["K"]
        force = complex(*reaction.force)
        assert complex(*reaction.at) == pytest.approx(touch, abs=1e-14)
        assert (force * np.conj(normal)).imag == pytest.approx(0.0, abs=1e-10)
        # the follower's point of contact and the cam's go along the normal alike
        spin, own = state.link("follower").angular_velocity, state.point("P").velocity
        velocity = complex(*own) + 1j * spin * (touch - middle)
        assert (velocity * np.conj(normal)).real == pytest.approx((10j * touch * np.conj(normal)).real, abs=1e-13)
        # what the cam's torque does is what the contact does
        torque = (np.conj(touch) * force).imag
        assert forces.inputs["O"] == pytest.approx(torque, abs=1e-11)


def test_a_harmonic_flat_faced_cam_is_an_eccentric_circle():
    """s = 25 (1 - cos θ) mm on a base circle of 25 mm: a circle of 50 mm (H. H. Mabie, C. F. Reinholtz, ch. 3)."""
    law = [{"motion": "harmonic", "by": 50, "in": 180}, {"motion": "harmonic", "by": -50, "in": 180}]
    found = planar.cam_profile(radial_cam(law, base_radius=25, flat=0))
    np.testing.assert_allclose(found.curvature_radius, 0.05, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*(found.profile - [0.0, -0.025]).T), 0.05, rtol=1e-12)
    assert found.face_reach == pytest.approx((-0.025, 0.025), rel=1e-9)


@pytest.mark.parametrize(
    ("motion", "velocity", "acceleration"),
    [
        ("harmonic", 0.5 * pi, 0.5 * pi**2),
        ("parabolic", 2.0, 4.0),
        ("cycloidal", 2.0, 2.0 * pi),
        ("3-4-5", 1.875, 5.7735),
    ],
)
def test_rises_have_the_greatest_rates_of_the_books(motion, velocity, acceleration):
    """A lift h over the angle b at the speed w: velocity h w / b and acceleration h w^2 / b^2 times these."""
    law = [{"motion": motion, "by": 30, "in": 120}, {"motion": "dwell", "in": 30}]
    law += [{"motion": motion, "by": -30, "in": 90}, {"motion": "dwell", "in": 120}]
    motion = planar.cycle(radial_cam(law, "100 rpm", base_radius=30), steps=720)
    speed = 100 * pi / 30
    assert np.abs(motion.point("P").velocity[:, 1]).max() == pytest.approx(velocity * 0.03 * speed / (pi / 2), rel=1e-4)
    wanted = acceleration * 0.03 * (speed / (pi / 2)) ** 2
    assert np.abs(motion.point("P").acceleration[:, 1]).max() == pytest.approx(wanted, rel=1e-4)


def test_the_valve_cam_has_the_printed_speeds():
    """R. S. Khurmi, J. K. Gupta: 0.39 and 0.78 m/s, 6.17 and 24.67 m/s^2 in raising and lowering."""
    motion = planar.cycle("valve-cam", steps=720)
    speed, acceleration = motion.point("P").velocity[:, 1], motion.point("P").acceleration[:, 1]
    assert speed.max() == pytest.approx(0.39, abs=0.005)
    assert -speed.min() == pytest.approx(0.78, abs=0.006)
    rising = speed > 1e-9
    assert np.abs(acceleration[rising]).max() == pytest.approx(6.17, abs=0.01)
    assert np.abs(acceleration).max() == pytest.approx(24.67, abs=0.01)


def test_the_pressure_angle_of_an_offset_follower_is_the_books():
    """tan(alpha) = (s' - e) / (s + sqrt(r^2 - e^2)) (R. L. Norton, Design of Machinery, ch. 8)."""
    found = profiled("roller")
    lift, rate = found.lift[:2]
    # the line passes 12 mm to the right of the centre of a cam that turns to the left
    tangent = (rate - 0.012) / (lift + np.sqrt(0.05**2 - 0.012**2))
    np.testing.assert_allclose(np.tan(found.pressure_angle), tangent, atol=1e-12)


def test_the_least_base_circle_has_just_the_pressure_angle_and_a_smaller_one_is_undercut():
    document = cam_document("roller")
    least = planar.least_base_circle(planar.from_dict(document), radians(25))
    sized = planar.cam_profile(planar.from_dict(cam_document("roller", base_radius=least.pressure * 1e3)))
    assert sized.greatest_pressure_angle.value == pytest.approx(radians(25), abs=1e-9)
    edge = planar.cam_profile(planar.from_dict(cam_document("roller", base_radius=least.curvature * 1e3 * (1 + 1e-9))))
    assert edge.least_curvature_radius.value == pytest.approx(0.0, abs=1e-7)
    flat = planar.least_base_circle(planar.from_dict(cam_document("flat")))
    below = planar.cam_profile(planar.from_dict(cam_document("flat", base_radius=flat.curvature * 1e3 - 1.0)))
    assert below.least_curvature_radius.value == pytest.approx(-1e-3, rel=1e-6)
    assert "undercut at" in below.problem()


def test_a_follower_lifts_off_where_the_force_would_have_to_pull():
    slow, fast = (
        planar.forces(planar.cycle(with_values(planar.load("cam-with-spring"), {"O.velocity": f"{rpm} rpm"})))
        for rpm in (500, 900)
    )
    assert not planar.contact_forces(slow)["lift"].lifts_off.any()
    assert planar.contact_forces(fast)["lift"].lifts_off.any()
    assert planar.contact_forces(slow)["lift"].force.min() > 0.0 > planar.contact_forces(fast)["lift"].force.min()


def test_points_of_a_file_keep_its_tolerance():
    found, tolerance = profiled("swinging roller"), 2e-6
    angle = found.points(tolerance)
    ends, between = found.profile_at(angle), found.profile_at(angle[:-1] + 0.37 * np.diff(angle))
    way = np.diff(ends, axis=0)
    off = between - ends[:-1]
    away = np.abs(way[:, 0] * off[:, 1] - way[:, 1] * off[:, 0]) / np.hypot(*way.T)
    assert away.max() <= tolerance * 1.05


@pytest.mark.parametrize("follower", ["swinging flat", "roller"])
def test_many_designs_of_a_cam_are_what_the_general_path_says(follower):
    mechanism = planar.from_dict(cam_document(follower))
    rng, many = np.random.default_rng(0), 12
    designs = {"K.base_radius": rng.uniform(0.005, 0.08, many), "K.start": rng.uniform(-3.0, 3.0, many)}
    designs |= {"ground.O.x": rng.uniform(-0.03, 0.03, many)}
    swept, base = planar.sweep(mechanism, designs, 40), reference_design(mechanism, None)
    for index in range(many):
        own = with_design_values(base.mechanism, values_of_design(designs, index))
        row = np.broadcast_to(swept.input, swept.status.shape)[index]
        alone = DesignRun(own, base.pair, row, 40).solve(swept.points, True)
        assert alone.status.tolist() == swept.status[index].tolist()
        orders = (swept.position, swept.velocity, swept.acceleration)
        found = np.hstack([order[name][index] for order in orders for name in swept.points])
        np.testing.assert_allclose(found, alone.out, rtol=0.0, atol=1e-9 * np.nanmax(np.abs(alone.out), initial=1.0))


def test_a_cam_on_a_moving_carrier_driven_by_a_linkage():
    """Cam and swinging follower on an arm that turns: seen from the arm all is as on the frame."""
    document = cam_document("swinging roller")
    document["links"]["base"] = {"points": {"Q": [0, 0]}}
    document["links"]["ground"]["points"]["Q"] = [0, -60]
    document["frame"] = "base"
    document["pairs"].insert(0, {"turning": "Q", "links": ["base", "ground"]})
    document["pairs"][-1]["carrier"] = "ground"
    document["inputs"].append({"pair": "Q", "position": 40, "velocity": "-2 rad/s"})
    moving = planar.solve(planar.from_dict(document))
    still = planar.solve(planar.from_dict(cam_document("swinging roller")))
    against = moving.link("follower").angle - moving.link("ground").angle
    assert against == pytest.approx(still.link("follower").angle, abs=1e-13)
    spin = moving.link("follower").angular_velocity + 2.0
    assert spin == pytest.approx(still.link("follower").angular_velocity, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"law": [{"motion": "dwell", "in": 300}]}, "a whole turn of the cam together, 360 deg, not 300 deg"),
        ({"law": [{"motion": "harmonic", "by": 5, "in": 360}]}, "these rises add up to 0.005"),
        ({"base_radius": 1, "roller_radius": 2}, "its line passes the cam's base circle by"),
        ({"flat": 0}, "a roller or a flat face, not both"),
        ({"carrier": "cam"}, "the carrier is a third link"),
        ({"pivot": "P"}, "a follower that slides along a 'line' has no 'pivot'"),
        ({"rest": 5}, "leave one of the two out"),
        ({"law": [{"motion": "table", "in": 360}]}, "'table' is none of"),
    ],
)
def test_a_cam_that_cannot_be_meant_is_refused_in_one_sentence(change, sentence):
    with pytest.raises(planar.BadInput, match=r"pairs\[2\]") as refused:
        planar.from_dict(cam_document("roller", **change))
    assert sentence in str(refused.value)


def test_the_commands_file_and_record_say_the_same(tmp_path):
    from tests import command

    record = json.loads(command.run(tmp_path, "cams", "valve-cam", "--json").done())
    assert record["greatest_pressure_angle"]["value"] == pytest.approx(radians(53.9736), abs=1e-6)
    command.run(tmp_path, "cams", "valve-cam", "-o", "profile.csv", "--tolerance", "0.02mm").done()
    told, head, *rows = (tmp_path / "profile.csv").read_text().splitlines()
    assert "keep within 0.02 mm" in told
    assert head.startswith("law angle (deg),x (mm),y (mm)")
    assert [float(cell) for cell in rows[0].split(",")[1:3]] == pytest.approx([0.0, 25.0], abs=1e-12)
    radius = 25.0 + 10.0
    angle = radians(60.0)
    middle = (radius + 25.0) * np.array([cos(pi / 2 - angle), sin(pi / 2 - angle)])
    near = min(rows, key=lambda row: abs(float(row.split(",")[0]) - 60.0)).split(",")
    at, normal = np.array(near[1:3], float), np.array(near[3:5], float)
    assert at + 10.0 * normal == pytest.approx(middle, abs=1e-9)


def test_what_is_round_off_of_the_lift_is_zero_in_the_table(tmp_path):
    """The nose of a tangent cam begins and ends at the same lift."""
    from tests import command

    (nose,) = (line for line in command.run(tmp_path, "cams", "tangent-cam").done().splitlines() if "nose" in line)
    assert nose.split()[:4] == ["nose", "310.647", "409.353", "0"]


@pytest.mark.parametrize(
    ("face", "radius"),
    [({"roller_radius": 10}, lambda rho: 1.0 / (1.0 / rho + 1.0 / 0.010)), ({"flat": 0}, lambda rho: rho)],
)
def test_the_stress_of_steel_on_steel_is_the_books(face, radius):
    """0.418 sqrt(F E / (b R)) (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, for Poisson's ratio 0.3), and by
    the half width of the contact, 2 F / (pi a b) (J. E. Shigley, J. J. Uicker)."""
    law = [{"motion": "cycloidal", "by": 10, "in": 180}, {"motion": "cycloidal", "by": -10, "in": 180}]
    contact = {"width": 12, "modulus": "206 GPa", "poisson_ratio": 0.3}
    bare = planar.to_dict(radial_cam(law, contact=contact, base_radius=60, **face))
    cam = planar.from_dict(bare | {"loads": [{"point": "P", "force": [0, -400]}]})
    assert planar.from_dict(planar.to_dict(cam)) == cam
    motion = planar.cycle(cam, steps=24)
    found = planar.contact_forces(planar.forces(motion))["K"]
    profile = planar.cam_profile(cam).at(motion.inputs["O"].position)
    equivalent = radius(profile.curvature_radius)
    assert found.stress == pytest.approx(0.418 * np.sqrt(found.force * 206e9 / (0.012 * equivalent)), rel=1e-3)
    half = np.sqrt(4.0 * found.force * equivalent / (pi * 0.012) * 2.0 * (1.0 - 0.09) / 206e9)
    assert found.stress == pytest.approx(2.0 * found.force / (pi * half * 0.012), rel=1e-12)
