"""How a chain with sliding pairs moves where its joints stand in general position: by the rank of its constraints.

Counts alone do not tell: links that slides join keep their angles, so that a pin between two of them cannot turn, and
a loop of slides holds the angles once more than there are any.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.arrays import Array
from planar.structures.rigid_parts import MOTIONS, Joint

SEED = 1
"""Of the position; all but special ones have the same ranks."""
TOLERANCE = 1e-9
"""Of singular values, and of rates between links, beside the greatest."""


class GeneralPosition:
    """The joints of a chain at random places, each with a random way along which it slides where it is a slide.

    A motion has three rates for each link: of its point at the origin, in x and y, and its angular velocity. A multiple
    pin, given by its links, is at one place; `joints` are then any two of its links.
    """

    def __init__(self, links: int, joints: Sequence[Joint], multiple_pins: Sequence[Sequence[int]] = ()):
        random = np.random.default_rng(SEED)
        count = len(joints)
        (x, y), angle = random.uniform(-1.0, 1.0, (2, count)), random.uniform(0.0, np.pi, count)
        self._independent = [*range(count)]
        for pin in multiple_pins:
            own = [k for k, ends in enumerate(joints) if {*ends} <= {*pin}]
            x[own], y[own] = x[own[0]], y[own[0]]
            self._independent = [k for k in self._independent if k not in own or pin[0] in joints[k]]
        self.freedom = MOTIONS * (links - 1) - 2 * len(self._independent)
        velocity = np.zeros((count, 2, MOTIONS * links))  # of the second link against the first, at the joint
        turning = np.zeros((count, MOTIONS * links))
        for k, (first, second) in enumerate(joints):
            for link, sign in ((first, -1.0), (second, 1.0)):
                velocity[k, :, MOTIONS * link : MOTIONS * link + MOTIONS] = [
                    [sign, 0.0, -sign * y[k]],
                    [0.0, sign, sign * x[k]],
                ]
                turning[k, MOTIONS * link + MOTIONS - 1] = sign
        along, across = ([np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)])
        self._held = velocity, np.stack([turning, np.einsum("dk,kdm->km", across, velocity)], axis=1)
        self._rates = turning, np.einsum("dk,kdm->km", along, velocity)
        self._known: tuple[tuple[int, ...], Array] | None = None
        "the motions of the slides that were asked for last"

    def moves_as_counted(self, slides: Sequence[int]) -> bool:
        """Whether, with these joints slides and the others pins, the chain has the freedom that it has by count, and
        every joint of it moves, so that no part of it is rigid."""
        motions = self._motions(slides)
        return len(motions) == MOTIONS + self.freedom and bool(
            np.all(np.abs(self._joint_rates(slides) @ motions.T).max(axis=1) > TOLERANCE)
        )

    def is_driven(self, slides: Sequence[int], drives: Sequence[int]) -> bool:
        """Whether nothing moves where these joints are held, and none of them is held by the others."""
        rates = self._joint_rates(slides)[list(drives)] @ self._motions(slides).T
        return len(drives) == self.freedom == int(np.linalg.matrix_rank(rates, TOLERANCE))

    def _motions(self, slides: Sequence[int]) -> Array:
        """All motions that the joints allow (motions, rates), orthonormal; three are those of the whole plane."""
        if self._known is None or self._known[0] != tuple(slides):
            pins, sliding = self._held
            rows = pins.copy()
            rows[list(slides)] = sliding[list(slides)]
            _, sizes, motions = np.linalg.svd(rows[self._independent].reshape(-1, rows.shape[-1]))
            self._known = tuple(slides), motions[int(np.sum(sizes > TOLERANCE * sizes[0])) :]
        return self._known[1]

    def _joint_rates(self, slides: Sequence[int]) -> Array:
        """What gives the rate of each joint from a motion (joints, rates)."""
        turning, sliding = self._rates
        rates = turning.copy()
        rates[list(slides)] = sliding[list(slides)]
        return rates
