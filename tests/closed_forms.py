"""Closed forms by which several test files judge: four-bars by the law of cosines, pistons, lengths they are for."""

from math import pi

import numpy as np

TURN = 2 * np.pi


def between(one, two, opposite):
    """The angle between two sides of a triangle, by the law of cosines."""
    return np.arccos((one * one + two * two - opposite * opposite) / (2 * one * two))


def meeting(p, r, q, s):
    """Where circles about p and q (complex) with radii r and s meet, to the left of the way from p to q."""
    far = abs(q - p)
    along = (r**2 - s**2 + far**2) / (2 * far)
    return p + (q - p) / far * (along + 1j * np.sqrt(r**2 - along**2))


def rocker(a, b, c, d, theta, closed=1):
    """The angle of DC by the law of cosines in the triangle BCD."""
    r = np.hypot(d - a * np.cos(theta), a * np.sin(theta))
    back = np.arctan2(a * np.sin(theta), a * np.cos(theta) - d)
    return back - closed * np.arccos(np.clip((c * c + r * r - b * b) / (2 * c * r), -1.0, 1.0))


def coupler(a, b, c, d, theta, phi):
    return np.angle(d + c * np.exp(1j * phi) - a * np.exp(1j * theta))


def rates(a, b, c, theta, beta, phi, omega, alpha):
    """First and second rates of BC and DC: the loop's equation differentiated, resolved along and across each bar."""
    beta1 = a * omega * np.sin(theta - phi) / (b * np.sin(phi - beta))
    phi1 = a * omega * np.sin(theta - beta) / (c * np.sin(phi - beta))
    # what the loop's second derivative leaves for b beta'' i e^(i beta) - c phi'' i e^(i phi)
    known = -a * (1j * alpha - omega**2) * np.exp(1j * theta)
    known += b * beta1**2 * np.exp(1j * beta) - c * phi1**2 * np.exp(1j * phi)
    beta2 = (known * np.exp(-1j * phi)).real / (b * np.sin(phi - beta))
    phi2 = (known * np.exp(-1j * beta)).real / (c * np.sin(phi - beta))
    return beta1, phi1, beta2, phi2


def piston(theta, r, l, e=0.0):  # noqa: E741 - the letters of textbooks
    """How far the rod's end is along its line, with the first and second derivative by the crank's angle."""
    s, c = r * np.sin(theta), r * np.cos(theta)
    g = s - e
    root = np.sqrt(l**2 - g**2)
    return c + root, -s - g * c / root, -c - (c * c - g * s) / root - (g * c) ** 2 / root**3


PARALLELOGRAM = (1.0, 2.0, 1.0, 2.0)
ROCKER = (0.3, 0.9, 0.7, 1.0)
TRIPLE = (0.9, 0.7, 0.85, 1.5)
"""Cranks, couplers, rockers and frames: one that folds flat, a crank-rocker, and one whose crank cannot turn."""


def antiparallelogram(theta):
    """The angle of DC in the antiparallelogram 1, 2, 1, 2, with its rates at angular velocity 2 and acceleration 1.

    tan(phi / 2) = -tan(theta / 2) (d + a) / (d - a), so phi = 2 atan2(-3 sin(theta / 2), cos(theta / 2)): no pole.
    """
    s, c = np.sin(theta / 2), np.cos(theta / 2)
    phi = 2 * np.arctan2(-3 * s, c)
    below = c * c + 9 * s * s
    first = -3 / below
    second = 3 * (-c * s + 9 * s * c) / below**2
    return phi, 2.0 * first, 4.0 * second + first


TRIPLE_LIMIT = float(between(TRIPLE[0], TRIPLE[3], TRIPLE[1] + TRIPLE[2]))
"""The crank of the triple rocker moves between plus and minus this, where coupler and follower stretch."""


def turn_apart(a, b):
    """The angle between two places of a turn."""
    return abs((a - b + pi) % (2.0 * pi) - pi)
