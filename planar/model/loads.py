"""What acts on links from outside, and their masses, as immutable data in SI units."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.argument_types import checked_arguments
from planar.model.link_shapes import PointReference

MAX_LAW_ITEMS = 10_000
"""Pieces of one law of an input, points of one table, places of the course of a load."""
COINCIDENCE_TOLERANCE = 1e-12
"""Of a mechanism's size: two points of a spring or load that are nearer to each other than this have no direction."""


@checked_arguments
class Course(NamedTuple):
    """How a load varies: `factors` times what it says, over the positions `at` of an input, or over the time.

    `input` names the pair (rad or m); None is the time (s). Straight between the places; before the first and after
    the last it stays, but where the places of a turning input span one turn exactly it comes again with every turn.
    """

    input: str | None
    at: tuple[float, ...]
    factors: tuple[float, ...]


@checked_arguments
class Load(NamedTuple):
    """A force (N) at a point, a torque (N m, anticlockwise) on a link, or an effort at a pair or between two points.

    At a pin a `point` without its link is of the link that slides there, else of the first (see
    `planar.dynamics.load_attachment`). The force is given in the frame's axes, or in those of the link `axes`, with
    which it turns. An `effort` (N where the pair's motion is a length, N m where it is an angle) acts on the second
    link, and its opposite on the first: in the positive sense of the pair's motion. Between `points` the effort (N) is
    a pair of equal and opposite forces along the line that joins them: positive pushes the points apart, as the force
    at a slide is positive in the sense in which its displacement grows; negative pulls them together.
    """

    point: str | None = None
    force: tuple[float, float] | None = None
    link: str | None = None
    torque: float | None = None
    pair: str | None = None
    effort: float | None = None
    axes: str | None = None
    varies: Course | None = None
    points: tuple[str, str] | None = None

    @property
    def target(self) -> str:
        """What the load acts on: the name of a point, link or pair; of two points both, as `P,Q`."""
        return self.point or self.link or self.pair or ",".join(self.points or ())

    def scaled(self, factor: float) -> Load:
        """The load multiplied by a factor."""
        return self._replace(
            force=None if self.force is None else (factor * self.force[0], factor * self.force[1]),
            torque=None if self.torque is None else factor * self.torque,
            effort=None if self.effort is None else factor * self.effort,
        )


@checked_arguments
class Spring(NamedTuple):
    """A spring with a damper between two points, or a torsional one between two links.

    `stiffness` in N/m and `damping` in N s/m, `free` the length without force (m); between links N m/rad, N m s/rad,
    and the angle of the second against the first (rad). How often they have turned is not said: at the start the spring
    is wound up the least, but for a free angle beyond half a turn, which is off the angle between -pi and pi.
    """

    points: tuple[str, str] | None = None
    links: tuple[str, str] | None = None
    stiffness: float = 0.0
    free: float = 0.0
    damping: float = 0.0

    @property
    def is_torsional(self) -> bool:
        """Whether it acts by angles."""
        return self.links is not None

    @property
    def ends(self) -> tuple[str, str]:
        """The two points, or the two links."""
        return self.links or self.points or ("", "")


@checked_arguments
class Mass(NamedTuple):
    """The mass of a link (kg), where it is centred, and its moment of inertia about that (kg m^2).

    `at` is a point of the link, or x and y in the axes in which the link was drawn (m). What is said of a link several
    times adds up.
    """

    link: str
    mass: float
    at: PointReference
    inertia: float = 0.0
