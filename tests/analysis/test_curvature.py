"""Curvature of paths: Euler-Savary against v^3 / |v x a|, against exact paths, and against closed forms."""

from dataclasses import replace
from math import cos, hypot, inf, isnan, pi, sin

import numpy as np
import pytest

import planar
from planar.analysis.centres.curvature import curvature
from planar.analysis.relative_motion import quarter_turn, relative_motion
from planar.foundation.errors import BadInput, Unknown
from planar.model.mechanism import Drive, replace_inputs
from tests.known import MODELS, some_models, state_of


def driven(mechanism, velocity, acceleration, **positions):
    """The mechanism at other rates of its only input."""
    (given,) = mechanism.inputs
    return replace_inputs(mechanism, (Drive(given.pair, positions.get("position"), velocity, acceleration),))


def velocity_and_acceleration(found, at):
    m = found.motion
    r = at - m.origin
    return (
        m.velocity + m.angular_velocity * quarter_turn(r),
        m.acceleration + m.angular_acceleration * quarter_turn(r) - m.angular_velocity**2 * r,
    )


@pytest.mark.parametrize("model", some_models(3))
def test_euler_savary_agrees_with_velocity_and_acceleration_for_random_points_of_every_link(model):
    state = state_of(model)
    if not any(each.velocity for each in state.inputs.values()):
        pytest.skip("its inputs are at rest")
    rng = np.random.default_rng(1)
    turning = 0
    for link in state.frames:
        if link == state.mechanism.frame:
            continue
        found = curvature(state, link)
        if found.pole is None or np.abs(found.pole - found.motion.origin).max() > 1e3 * found.size:
            continue
        for point in rng.uniform(-1.0, 1.0, (5, 2)) * found.size:
            path = found.path(point)
            assert 1.0 / path.radius == pytest.approx(1.0 / path.direct, rel=1e-6, abs=1e-7 / found.size)
            turning += 1
    assert turning or all(curvature(state, link).reason for link in state.frames if link != state.mechanism.frame)


@pytest.mark.parametrize("model", ["four-bar", "slider-crank", "whitworth", "cardan-gears", "jansen-leg", "002-E3.6a"])
def test_what_belongs_to_pole_inflection_circle_and_acceleration_pole_holds_there(model):
    state = state_of(model)
    for link in state.frames:
        found = curvature(state, link) if link != state.mechanism.frame else None
        if found is None or found.inflection is None:
            continue
        most, hardest = (
            max(hypot(*each) for each in parts)
            for parts in zip(
                *(
                    velocity_and_acceleration(found, found.motion.points_in_other(np.array(at)))
                    for at in found.shape.values()
                ),
                strict=True,
            )
        )
        reach = 1.0 + hypot(*(found.pole - found.motion.origin)) / found.size
        assert hypot(*velocity_and_acceleration(found, found.pole)[0]) <= 1e-9 * reach * most
        assert hypot(*velocity_and_acceleration(found, found.acceleration_pole)[1]) <= 1e-9 * reach * hardest
        # the common tangent is that of the inflection circle in the pole
        out = found.inflection.centre - found.pole
        assert hypot(*out) == pytest.approx(found.inflection.diameter / 2.0)
        assert abs(out @ found.pole_velocity) <= 1e-9 * hypot(*out) * hypot(*found.pole_velocity)
        assert found.inflection.diameter == pytest.approx(
            hypot(*found.pole_velocity) / abs(found.motion.angular_velocity)
        )
        for angle in np.linspace(0.5, 5.5, 6):
            way = np.array([cos(angle), sin(angle)])
            v, a = velocity_and_acceleration(found, found.inflection.centre + found.inflection.diameter / 2.0 * way)
            assert abs(v[0] * a[1] - v[1] * a[0]) <= 1e-9 * hypot(*v) * hypot(*a) * reach**2
            if found.bresse is not None:
                v, a = velocity_and_acceleration(found, found.bresse.centre + found.bresse.diameter / 2.0 * way)
                assert abs(v @ a) <= 1e-9 * hypot(*v) * hypot(*a) * reach**2
        if found.bresse is not None:
            # both circles meet in the pole and in the acceleration pole
            for ring in (found.inflection, found.bresse):
                away = hypot(*(found.acceleration_pole - ring.centre))
                assert away == pytest.approx(ring.diameter / 2.0, rel=1e-7)


def circle_through(a, b, c):
    """Radius and centre of the circle through three places."""
    ab, ac = b - a, c - a
    area = 2.0 * (ab[0] * ac[1] - ab[1] * ac[0])
    out = (quarter_turn(ab) * (ac @ ac) - quarter_turn(ac) * (ab @ ab)) / area
    return hypot(*out), a + out


@pytest.mark.parametrize(
    ("model", "link", "point"),
    [("four-bar", "BC", "F"), ("slider-crank", "rod", "E"), ("jansen-leg", None, "foot"), ("002-E3.3", "AC", None)],
)
def test_circles_through_three_places_of_the_exact_path_come_to_the_circle_of_curvature_at_second_order(
    model, link, point
):
    mechanism = MODELS[model]
    (given,) = mechanism.inputs
    state = planar.solve(mechanism)
    link = link or next(name for name in state.frames if point in state.shapes[name].points)
    local = np.array(state.shapes[link].position(point)) if point else np.array([0.3, 0.2])
    path = curvature(state, link).path(local)
    wrong = []
    for step in (0.02, 0.01, 0.005):
        places = [
            _place(planar.solve(mechanism, {given.pair: given.position + by}), link, local) for by in (-step, 0.0, step)
        ]
        radius, centre = circle_through(*places)
        wrong.append((abs(radius - path.radius), hypot(*(centre - path.centre))))
    orders = np.log2(np.array(wrong[:-1]) / np.array(wrong[1:]))
    assert orders[:, 0] == pytest.approx([2.0, 2.0], abs=0.15)
    assert orders[:, 1] == pytest.approx([2.0, 2.0], abs=0.15)


def _place(state, link, local):
    return relative_motion(state.frames, link, state.mechanism.frame).points_in_other(local)


@pytest.mark.parametrize(
    "model", ["four-bar", "offset-slider-crank", "cardan-gears", "elliptical-trammel", "watt-six-bar"]
)
def test_the_rate_of_the_input_does_not_matter_for_curvature(model):
    mechanism = MODELS[model]
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    states = [planar.solve(driven(mechanism, *rates)) for rates in ((1.0, 0.0), (-3.0, 7.0), (0.2, -50.0), (0.0, 0.0))]
    for link in links:
        first, *others = (curvature(state, link) for state in states)
        for found in others:
            if first.inflection is None:
                assert found.inflection is None
                continue
            assert found.pole == pytest.approx(first.pole, abs=1e-9 * first.size)
            assert found.inflection.centre == pytest.approx(first.inflection.centre, abs=1e-8 * first.size)
            assert found.inflection.diameter == pytest.approx(first.inflection.diameter, rel=1e-8)
            for point in ((0.1, 0.2), (-0.3, 0.05)):
                assert found.path(point).direct == pytest.approx(first.path(point).direct, rel=1e-6)
                assert found.path(point).radius == pytest.approx(first.path(point).radius, rel=1e-6)


def test_an_input_at_rest_gets_a_unit_rate_and_the_acceleration_pole_is_then_that_of_steady_running():
    still, steady = (planar.solve(driven(MODELS["four-bar"], rate, 0.0)) for rate in (0.0, 1.0))
    assert curvature(still, "BC").pole_velocity == pytest.approx(curvature(steady, "BC").pole_velocity)
    assert curvature(still, "BC").acceleration_pole == pytest.approx(curvature(steady, "BC").acceleration_pole)


def test_points_of_a_trammel_are_curved_as_their_ellipses():
    state = state_of("elliptical-trammel")
    found = curvature(state, "bar")
    x, y = state.point("E").position
    # half axes 180 mm across, 300 mm up: radius (b^2 cos^2 + a^2 sin^2)^(3/2) / (a b) at x = a cos, y = b sin
    a, b = 0.18, 0.3
    assert (x / a) ** 2 + (y / b) ** 2 == pytest.approx(1.0)
    turn = np.arctan2(y / b, x / a)
    radius = (a**2 * sin(turn) ** 2 + b**2 * cos(turn) ** 2) ** 1.5 / (a * b)
    evolute = (a**2 - b**2) / a * cos(turn) ** 3, (b**2 - a**2) / b * sin(turn) ** 3
    path = found.path("E")
    assert path.radius == pytest.approx(radius, rel=1e-12)
    assert path.direct == pytest.approx(radius, rel=1e-12)
    assert path.centre == pytest.approx(evolute)


@pytest.mark.parametrize(
    ("model", "link", "radius"), [("elliptical-trammel", "bar", 0.06), ("cardan-gears", "wheel", 0.05)]
)
def test_of_cardan_motion_the_inflection_circle_is_the_moving_centrode(model, link, radius):
    state = state_of(model)
    found = curvature(state, link)
    # R = 2 r: 1 / d = 1 / r - 1 / R, so that d = 2 r
    assert found.inflection.diameter == pytest.approx(2.0 * radius)
    middle = found.motion.points_in_other(np.array([radius, 0.0])) if link == "bar" else state.point("C").position
    assert found.inflection.centre == pytest.approx(middle)
    on_rim = [(0.0, 0.0), (0.12, 0.0), (0.06, 0.06)] if link == "bar" else ["T", "N"]
    for point in on_rim:
        path = found.path(point)
        assert path.radius == path.direct == inf
        assert path.centre is None


def test_a_wheel_that_rolls_on_a_rail_has_its_own_half_as_inflection_circle():
    mechanism = MODELS["rolling-wheel"]
    state = planar.solve(mechanism)
    found = curvature(state, "wheel")
    centre = state.point("C").position
    assert found.pole == pytest.approx([centre[0], 0.0], abs=1e-12)
    assert found.pole_velocity == pytest.approx([1.0, 0.0], abs=1e-12)
    assert found.inflection.diameter == pytest.approx(0.2)
    assert found.inflection.centre == pytest.approx([centre[0], 0.1], abs=1e-12)
    # of the cycloid the radius is twice the way from the pole
    assert found.path("P").radius == pytest.approx(2.0 * hypot(*(state.point("P").position - found.pole)))
    assert found.path("C").radius == inf


def test_a_point_in_the_pole_has_a_cusp():
    # the rim touches the rail with P down
    state = planar.solve(MODELS["rolling-wheel"], {"axle box": 0.0})
    path = curvature(state, "wheel").path("P")
    assert path.radius == path.direct == 0.0
    assert path.centre == pytest.approx(path.position, abs=1e-12)


def test_a_crank_curves_its_points_about_its_pin_and_its_pin_not_at_all():
    found = curvature(state_of("four-bar"), "AB")
    path = found.path("B")
    assert (path.radius, path.direct) == pytest.approx((0.05, 0.05))
    assert path.centre == pytest.approx([0.0, 0.0], abs=1e-12)
    assert found.inflection is None
    assert "stays where it is" in found.reason
    pin = found.path("A")
    assert isnan(pin.radius)
    assert isnan(pin.direct)
    assert pin.centre is None


def test_coupler_pins_are_curved_about_the_frames_pins():
    state = state_of("four-bar")
    found = curvature(state, "BC")
    assert found.path("B").centre == pytest.approx(state.point("A").position, abs=1e-10)
    assert found.path("C").centre == pytest.approx(state.point("D").position, abs=1e-10)
    assert found.path("BC.C").radius == pytest.approx(0.056)


@pytest.mark.parametrize(
    ("model", "link", "point", "drive"),
    [("hoeken-straight-line", "coupler", "P", pi), ("watt-parallel-motion", "AB", "P", 0.05)],
)
def test_straight_lines_are_drawn_by_points_near_the_inflection_circle(model, link, point, drive):
    mechanism = MODELS[model]
    state = planar.solve(mechanism, {mechanism.inputs[0].pair: drive})
    found = curvature(state, link)
    path = found.path(point)
    assert path.radius > 7.0 * found.size
    away = hypot(*(path.position - found.inflection.centre)) - found.inflection.diameter / 2.0
    assert abs(away) < 0.05 * found.inflection.diameter


def test_without_turning_the_pole_is_at_infinity_and_curvature_is_that_of_velocity_and_acceleration():
    found = curvature(state_of("three-parallel-cranks"), "rod")
    assert found.pole is None
    assert found.inflection is None
    assert "at infinity" in found.reason
    state = state_of("three-parallel-cranks")
    crank = next(name for name in state.frames if name not in ("rod", state.mechanism.frame))
    radius = max(hypot(*at) for at in state.shapes[crank].points.values())
    for point in ((0.0, 0.0), (0.3, -0.1)):
        path = found.path(point)
        assert path.radius == path.direct == pytest.approx(radius)
    # a piston: straight, and no centre
    piston = curvature(state_of("slider-crank"), "piston").path("B")
    assert piston.radius == inf
    assert piston.centre is None


def test_a_coupler_that_just_does_not_turn_still_curves_its_paths():
    # crank at top: rod against frame slides with v along, the piston's end straight, the crank's pin on its circle
    mechanism = MODELS["slider-crank"]
    state = planar.solve(mechanism, {"O": pi / 2.0})
    found = curvature(state, "rod")
    assert found.pole is None
    assert found.path("A").radius == pytest.approx(0.48)
    assert found.path("A").centre == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found.path("B").radius == inf
    assert found.acceleration_pole is not None
    assert hypot(*velocity_and_acceleration(found, found.acceleration_pole)[1]) < 1e-9


def test_seen_from_another_link_the_motion_is_the_relative_one():
    state = state_of("cardan-gears")
    found = curvature(state, "wheel", "arm")
    # against the arm the wheel turns about its pin
    assert found.pole == pytest.approx([0.05, 0.0], abs=1e-12)
    assert found.path("T").radius == pytest.approx(0.05)
    ring = curvature(state, state.mechanism.frame, "wheel")
    assert hypot(*(ring.pole)) == pytest.approx(
        hypot(
            *(
                curvature(state, "wheel").motion.vectors_in_link(
                    curvature(state, "wheel").pole - curvature(state, "wheel").motion.origin
                )
            )
        )
    )


def test_links_that_move_as_one_are_said_to():
    state = state_of("planetary-gear-set")
    frozen = replace(state, frames=state.frames | {"sun": state.frames["arm"]})
    found = curvature(frozen, "sun", "arm")
    assert "move as one" in found.reason
    assert isnan(found.path((0.1, 0.0)).radius)


def test_names_that_are_not_there_and_inputs_that_are_all_at_rest_are_refused():
    state = state_of("four-bar")
    with pytest.raises(Unknown, match="no link 'XY'"):
        curvature(state, "XY")
    with pytest.raises(Unknown, match="both are 'BC'"):
        curvature(state, "BC", "BC")
    with pytest.raises(Unknown, match="carries no point 'D'"):
        curvature(state, "BC").path("D")
    several = next(each for each in MODELS.values() if len(each.inputs) > 1)
    still = replace_inputs(several, tuple(Drive(given.pair, None, 0.0, 0.0) for given in several.inputs))
    moving = next(link.name for link in several.links if link.name != several.frame)
    with pytest.raises(BadInput, match="all at rest"):
        curvature(planar.solve(still), moving)
