"""Complete lists against closed forms: Freudenstein's equation, Burmester's dyads, circles through three poses."""

import numpy as np
import pytest

import planar
from benchmarks.known_linkages.closed_forms import four_bar
from tests.draws import covering, first_cases

COUPLER = {"points": {"B": [0, 0], "C": [0.66, 0]}}


def task(wanted, free=(), coupler=COUPLER, pivots=((0, 0), (1, 0))):
    start = {
        "planar": 1,
        "frame": "g",
        "links": {
            "g": {"points": {"A": list(pivots[0]), "D": list(pivots[1])}},
            "AB": {"ends": ["A", "B"], "length": 0.4},
            "BC": coupler,
            "DC": {"ends": ["D", "C"], "length": 0.7},
        },
        "pairs": [{"turning": pin} for pin in "ABCD"],
        "inputs": [{"pair": "A", "position": 1.0}],
        "sketch": {"C": [0.9, 0.7]},
    }
    return {"planar": 1, "start": start, "wanted": [wanted]} | ({"free": [*free]} if free else {})


def random_poses(rng, count):
    """Places (count, 2) of the origin of a link's axes, and angles."""
    return rng.uniform(-1.0, 1.0, (count, 2)), rng.uniform(-2.0, 2.0, count)


def pose_item(places, angles):
    pairs = zip(places.tolist(), angles.tolist(), strict=True)
    return {"link": "BC", "poses": [{"at": at, "angle": angle} for at, angle in pairs]}


def to_world(point, place, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return place + turn @ point


def to_link(point, place, angle):
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return turn @ (point - place)


def centre_of_circle(points):
    a, b, c = points
    return np.linalg.solve(2.0 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])


def freudenstein_pairs(seed):
    """Three random pairs, and the crank and rocker (signed) and the squared coupler that meet them."""
    rng = np.random.default_rng(seed)
    phi, psi = np.sort(rng.uniform(0.3, 2.5, 3)), np.sort(rng.uniform(-1.0, 3.0, 3))
    k = np.linalg.solve(np.stack([np.cos(psi), -np.cos(phi), np.ones(3)], axis=1), np.cos(phi - psi))
    crank, rocker = 1.0 / k[0], 1.0 / k[1]
    return phi, psi, crank, rocker, crank**2 + rocker**2 + 1.0 - 2.0 * crank * rocker * k[2]


def signs_of_lengths(seed):
    """Which of the lengths that meet three random pairs are positive."""
    return [tuple(value > 0.0 for value in freudenstein_pairs(seed)[2:])]


@pytest.mark.parametrize("seed", covering(range(8), signs_of_lengths))
def test_three_pairs_are_met_by_freudensteins_lengths_with_their_signs(seed):
    """F. Freudenstein, Trans. ASME 77, 1955: K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi), linear in K."""
    phi, psi, crank, _, coupler_squared = freudenstein_pairs(seed)
    coupler = np.sqrt(coupler_squared)
    wanted = {"from": "A", "to": "D", "pairs": np.stack([phi, psi], axis=1).tolist(), "absolute": True}
    found = planar.synthesise(task(wanted), complete=True)
    assert (found.found, found.complete) == (1, "numerically complete")
    if not np.isfinite(coupler):
        assert not len(found)
        return
    numbers = planar.dimensions(found[0].mechanism)
    for angle, other in zip(phi, psi, strict=True):  # in either assembly
        outputs = [four_bar(numbers, angle, (sign,)).output for sign in (1.0, -1.0)]
        assert min(abs(complex(each.x, each.y) - np.exp(1j * other)) for each in outputs) < 1e-9
    state = planar.solve(found[0].mechanism)
    assert np.hypot(*(state.point("C").position - state.point("B").position)) == pytest.approx(coupler, rel=1e-9)
    drawn = four_bar(numbers, phi[0], (1.0,))
    assert abs(drawn.pins["B"].x - crank * np.cos(phi[0])) < 1e-9 * abs(crank) + 1e-12


@pytest.mark.parametrize("seed", first_cases(range(8), 2))
def test_three_poses_with_pivots_given_have_joints_at_centres_of_circles(seed):
    """Seen from the link, each pivot is at three places, and the joint is the centre of the circle through them."""
    rng = np.random.default_rng(seed)
    pivots = rng.uniform(-1.0, 1.0, (2, 2))
    places, angles = random_poses(rng, 3)
    free = ["AB.length", "DC.length", "BC.B", "BC.C"]
    found = planar.synthesise(task(pose_item(places, angles), free, pivots=pivots.tolist()), complete=True)
    assert (found.expected, found.found, len(found), found.complete) == (1, 1, 1, "numerically complete")
    numbers = planar.dimensions(found[0].mechanism)
    for pivot, joint, link in zip(pivots, "BC", ("AB", "DC"), strict=True):
        centre = centre_of_circle([to_link(pivot, *pose) for pose in zip(places, angles, strict=True)])
        size = 1.0 + np.abs(centre).max()
        np.testing.assert_allclose([numbers[f"BC.{joint}.{axis}"] for axis in "xy"], centre, atol=1e-9 * size)
        length = np.linalg.norm(to_world(centre, places[0], angles[0]) - pivot)
        assert numbers[f"{link}.length"] == pytest.approx(length, rel=1e-9)


def dyads_by_resultant(places, angles):
    """The joints of the dyads of five poses at the first pose: where two of Burmester's cubics meet, by a resultant.

    A joint z and its pivot c obey |T_k z - c| = |z - c| for all poses, linear in c; three such rows depend on each
    other on a cubic. Two cubics share four joints of all four rows; what else they share is told by the fourth row.
    """
    turns = np.exp(1j * (angles - angles[0]))
    moved = places @ [1.0, 1j]
    shifts = moved - turns * moved[0]

    def rows(x, y):
        """(4, 3) of (1, c.x, c.y) at a joint, whose products are exact in complex x and y."""
        found = []
        for turn, shift in zip(turns[1:], shifts[1:], strict=True):
            px = turn.real * x - turn.imag * y + shift.real
            py = turn.imag * x + turn.real * y + shift.imag
            found.append([px * px + py * py - x * x - y * y, -2.0 * (px - x), -2.0 * (py - y)])
        return np.array(found)

    def cubic(which, x):
        """Coefficients in y of a minor, the highest power first."""
        ys = np.exp(2j * np.pi * np.arange(4) / 4)
        values = [np.linalg.det(rows(x, y)[which]) for y in ys]
        return np.fft.fft(values)[[3, 2, 1, 0]] / 4

    def resultant(x):
        p, q = cubic([0, 1, 2], x), cubic([0, 1, 3], x)
        sylvester = np.zeros((6, 6), dtype=complex)
        for k in range(3):
            sylvester[k, k : k + 4], sylvester[k + 3, k : k + 4] = p, q
        return np.linalg.det(sylvester)

    radius, count = 2.0, 16
    xs = radius * np.exp(2j * np.pi * np.arange(count) / count)
    coefficients = np.fft.fft([resultant(x) for x in xs]) / count / radius ** np.arange(count)
    joints = []
    for x in np.roots(coefficients[9::-1]):
        for y in np.roots(cubic([0, 1, 2], x)):
            values = np.linalg.svd(rows(x, y), compute_uv=False)
            if values[2] < 1e-6 * values[0] and values[1] > 1e-6 * values[0]:
                joints.append((x, y))
    return joints


def count_of_real_dyads(seed):
    """How many of the four dyads of five random poses are real."""
    joints = dyads_by_resultant(*random_poses(np.random.default_rng(seed), 5))
    return [sum(max(abs(x.imag), abs(y.imag)) < 1e-6 for x, y in joints)]


@pytest.mark.parametrize("seed", covering(range(4), count_of_real_dyads))
def test_five_poses_have_burmesters_dyads(seed):
    """L. Burmester, Lehrbuch der Kinematik, 1888: four dyads, real ones in pairs."""
    rng = np.random.default_rng(seed)
    places, angles = random_poses(rng, 5)
    joints = dyads_by_resultant(places, angles)
    assert len(joints) == 4
    found = planar.synthesise(task(pose_item(places, angles)), complete=True)
    real = [complex(x.real, y.real) for x, y in joints if max(abs(x.imag), abs(y.imag)) < 1e-6]
    assert (found.expected, found.found, len(found)) == (6, 6, len(real) * (len(real) - 1) // 2)
    for design in found:
        numbers = planar.dimensions(design.mechanism)
        for joint in "BC":
            drawn = np.array([numbers[f"BC.{joint}.{axis}"] for axis in "xy"])
            place = complex(*to_world(drawn, places[0], angles[0]))
            assert min(abs(place - each) for each in real) < 1e-5 * (1.0 + abs(place))
