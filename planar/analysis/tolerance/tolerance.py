"""The band of a result within the tolerances of a mechanism: worst case, statistical, second order, sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from planar.analysis.sensitivity.limit_slopes import dead_point_slopes, travel_slopes
from planar.analysis.tolerance.guaranteed import Guaranteed, guaranteed_band
from planar.analysis.tolerance.guaranteed_limits import guaranteed_dead_points, guaranteed_travel
from planar.analysis.tolerance.sampled import Draw, Sampled, sample_deviations, summarise
from planar.analysis.tolerance.spread import SIGMAS, LinearSpread, NormalSpread
from planar.analysis.tolerance.variations import PinOffset, Variations, find_variations, leave_out_tied
from planar.derivatives.result_slopes import SlopeSystem, second_derivatives
from planar.document.first_argument import takes_result
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, join_names
from planar.foundation.time_limit import stops_in_time
from planar.model.tolerances.tolerances import Tolerances
from planar.results.motion import Motion, State

LINEAR_ERROR = 0.05
"""By this part the linear spread may differ from that of the second order, or of samples."""
LIMIT_RESULTS = ("travel", "time_ratio", "dead_points")


@dataclass(frozen=True, eq=False)
class ToleranceBand:
    """How far a result may be from its nominal value, by the tolerances of numbers and the clearances of pins (SI).

    Arrays are shaped as the result: of a state a number, or (2,) of a point and a force; of a motion or forces over one
    with a first axis for its n positions; a travel is a number, and `dead_points` are (k,). `nominal` is the result
    itself. `lower` and `upper` are the least and the greatest deviation in the worst case, to the first order, and
    `worst` the greatest, of a point its distance from the nominal place (n,). `mean` and `std` are the mean deviation
    and the standard deviation of each part, `covariance` (n, parts, parts) that of the parts, where deviations are
    independent: of numbers normal with three standard deviations at the limits (or uniform, by `distribution`), of a
    pin on the circle of its clearance in any direction. `contribution` is each one's share of the variance, all shares
    adding up to 1; pins are `clearance.B`. Where forces are asked, a load holds each pin against its hole: that shifts
    the result, and the pin's share is 0.

    `second_order` has mean and std with the second derivatives, `sampled` what random mechanisms do, None where none
    were asked for. `guaranteed` are least and greatest deviations that no mechanism exceeds, None where not asked for.
    `share_within` is the share of mechanisms that keep the `limit`. NaN at `singular_rows`, dead points
    and change points.
    """

    of: str
    result: str
    kind: str
    source: State | Motion | Forces
    variations: Variations
    limit: tuple[float, float] | None
    singular_rows: tuple[int, ...]
    sampled: Sampled | None
    distribution: str
    names: tuple[str, ...]
    "of what contributes: numbers, then pins"
    linear: LinearSpread
    "(n, parts, ...), n = 1 of a state"
    nominal_rows: Array
    "(n, parts)"
    guaranteed: Guaranteed | None = None

    def __repr__(self) -> str:
        return f"<ToleranceBand of {self.of!r}, {self.result}, in {self.moving!r}: {len(self.names)} contributions>"

    @property
    def moving(self) -> State | Motion:
        """The state or the motion."""
        return self.source.moving if isinstance(self.source, Forces) else self.source

    @property
    def has_rows(self) -> bool:
        """Whether there is a first axis for the positions of a motion."""
        return isinstance(self.moving, Motion) and self.result not in LIMIT_RESULTS

    def _shaped(self, rows: Array) -> Any:
        """Rows (n, parts, ...) without axes for one position and one part."""
        found = rows[:, 0] if rows.ndim > 1 and rows.shape[1] == 1 else rows
        return found if self.has_rows else found[0]

    @property
    def nominal(self) -> Any:
        """The result itself."""
        return self._shaped(self.nominal_rows)

    @cached_property
    def _limits(self) -> tuple[Array, Array]:
        return self.linear.limits()

    @property
    def lower(self) -> Any:
        """The least deviation in the worst case, part by part."""
        return self._shaped(self._limits[0])

    @property
    def upper(self) -> Any:
        """The greatest deviation in the worst case, part by part."""
        return self._shaped(self._limits[1])

    @cached_property
    def worst(self) -> Any:
        """The greatest deviation in the worst case; of a point the distance from the nominal place."""
        found = self.linear.farthest() if self.result != "dead_points" else np.abs(np.stack(self._limits)).max(axis=0)
        return found if self.has_rows else found[0]

    @cached_property
    def statistical(self) -> NormalSpread:
        """Mean and covariance (n, parts, parts) to the first order."""
        return NormalSpread(self.linear.middle, self.linear.variances.sum(axis=0))

    @property
    def mean(self) -> Any:
        """The mean deviation."""
        return self._shaped(self.statistical.mean)

    @property
    def std(self) -> Any:
        """The standard deviation, part by part."""
        return self._shaped(self.statistical.std)

    @property
    def covariance(self) -> Array:
        """Of the parts (n, parts, parts), of a state without its first axis."""
        whole = self.statistical.covariance
        return whole if self.has_rows else whole[0]

    @cached_property
    def contribution(self) -> Mapping[str, Any]:
        """The share of the variance that each number and pin brings, at each position."""
        shares = np.trace(self.linear.variances, axis1=2, axis2=3)
        whole = shares.sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            parts = shares / whole
        return {name: part if self.has_rows else part[0] for name, part in zip(self.names, parts, strict=True)}

    @property
    def row(self) -> int:
        """The position at which the greatest deviation of the worst case is greatest."""
        return int(np.nanargmax(np.atleast_1d(self.worst))) if self.has_rows else 0

    @cached_property
    def second_order(self) -> NormalSpread | None:
        """Mean deviation (n, parts) and covariance with second derivatives H: tr(H C) / 2 more mean, tr(H C H C) / 2
        more covariance, for normal deviations of covariance C; None of travels."""
        if self.result in LIMIT_RESULTS:
            return None
        offsets = tuple(each.pair for each in self.variations.offsets)
        numbers = [variation.number for variation in self.variations.numbers]
        numbers += [f"clearance.{pair}.{axis}" for pair in offsets for axis in "xy"]
        whole = second_derivatives(self.source, self.of, self.result, self.kind, offsets, numbers)
        half = 0.5 * (self.linear.upper - self.linear.lower) / self.linear.sigmas
        many = len(whole)
        deviations = np.concatenate(
            [np.broadcast_to(half, (many, len(half))), np.repeat(self.linear.radii / np.sqrt(2.0), 2, axis=1)], axis=1
        )
        scaled = whole * deviations[:, None, :, None] * deviations[:, None, None, :]
        mean = self.linear.middle + 0.5 * np.trace(scaled, axis1=2, axis2=3)
        more = 0.5 * np.einsum("npij,nqji->npq", scaled, scaled)
        covariance = self.statistical.covariance + more
        rows = list(self.singular_rows)
        mean[rows], covariance[rows] = np.nan, np.nan
        return NormalSpread(mean, covariance)

    @cached_property
    def share_within(self) -> Any:
        """The share of mechanisms that keep the limit, by the normal distribution; None without a limit."""
        if self.limit is None:
            return None
        found = self.statistical.share_within(*self.limit)
        return found if self.has_rows else found[0]

    @cached_property
    def linear_error(self) -> float:
        """By which part the linear spread differs from that of samples, else of the second order, at most; 0 where it
        is compared with nothing."""
        other = self.sampled.std if self.sampled is not None else self.second_order and self.second_order.std
        if other is None:
            return 0.0
        size = np.nanmax(other, initial=0.0)
        return float(np.nanmax(np.abs(self.statistical.std - other), initial=0.0) / size) if size else 0.0

    def with_limit(self, limit: float | tuple[float, float]) -> ToleranceBand:
        """The same against another limit; samples are judged anew."""
        between = _read_limit(limit)
        sampled = self.sampled and summarise(self.sampled.deviations, between)
        return replace(self, limit=between, sampled=sampled)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say of it."""
        found = list(self.variations.remarks)
        if self.linear_error > LINEAR_ERROR:
            what = "samples" if self.sampled is not None else "the second order"
            found.append(f"the linear spread is off by {100.0 * self.linear_error:.0f} % of that of {what}: trust that")
        if self.singular_rows:
            found.append(f"{len(self.singular_rows)} positions are dead points or change points, and have no band")
        if self.sampled is not None and self.sampled.unsolved:
            found.append(f"{self.sampled.unsolved} of {self.sampled.mechanisms} random mechanisms could not be solved")
        return tuple(found)


@takes_result("State", "Motion", "Forces")
@stops_in_time
def tolerance(  # many: what is asked, of which tolerances, and how it is sampled; # long: its docstring
    source: State | Motion | Forces,
    of: str,
    tolerances: Tolerances | Mapping[str, Any] | None = None,
    *,
    result: str | None = None,
    limit: float | tuple[float, float] | None = None,
    samples: int = 0,
    seed: int = 0,
    distribution: str = "normal",
    guaranteed: bool = False,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> ToleranceBand:
    """How far a result of a point, link, pair or input may be off by the tolerances of the mechanism.

    `tolerances` are those of the file, or others as a file has them (SI numbers, or texts with units). `result` is one
    of those that a state, a motion or forces tell of that name, left out the first; or "travel" (stroke or swing),
    "time_ratio" and, of the running input, "dead_points". `limit` is a deviation, plus and minus, or the least and
    the greatest; of a point a distance. With `samples` so many random mechanisms are solved, too, from a `seed`. See
    `ToleranceBand` for what is assumed and told. `guaranteed` asks for a band that is proved, of a motion at all
    positions of its inputs from one to the next; see `planar.analysis.tolerance.guaranteed`.

    The worst case adds |slope| t of all; the statistical one squares (root sum of squares: ASME Y14.5; K. W. Chase,
    A. R. Parkinson, Research in Engineering Design 3 (1991) 23). Raises Unknown, BadInput, and NoAnswer where there are
    no derivatives at any position, or nothing can be guaranteed, and after `timeout` s or a Ctrl-C, with the outcome
    "interrupted".

    >>> import planar
    >>> state = planar.solve(planar.load("slider-crank"))
    >>> band = planar.tolerance(state, "stroke", {"rod.length": "0.1 mm"})
    >>> f"{1e3 * band.worst:.4f} mm"
    '0.1036 mm'
    """
    moving = source.moving if isinstance(source, Forces) else source
    if distribution not in SIGMAS:
        raise BadInput("distribution", f"{distribution!r} is none of {join_names(SIGMAS)}")
    variations = find_variations(moving.mechanism, tolerances)
    between = _read_limit(limit)
    if result in LIMIT_RESULTS:
        return _of_limits(source, of, result, variations, between, distribution, guaranteed)
    offsets = tuple(each.pair for each in variations.offsets)
    system = SlopeSystem(source, offsets)
    found = system.named_slopes(of)
    if result is not None and result not in found.slopes:
        raise BadInput("result", f"of {of!r} are told {join_names(found.slopes)}, and no {result!r}")
    if found.is_singular.all():
        told = f"{of!r} has no derivatives here: at a dead point or change point; move the input away from it"
        raise NoAnswer(Outcome.DEAD_POINT, told)
    variations = leave_out_tied(variations, found.tied)
    name = result or next(iter(found.slopes))
    slopes, names = found.slopes[name], system.names
    linear = _linear_spread(source, slopes, names, variations, SIGMAS[distribution])
    sampled = None
    if samples:
        if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2:
            raise BadInput("samples", f"a whole number of mechanisms from 2 on is wanted, not {samples!r:.40}")
        draw = Draw(samples, seed, SIGMAS[distribution], distribution == "normal")
        by_pins = (linear.offset_slopes, linear.radii)
        deviations = sample_deviations(source, of, name, variations, draw, by_pins, linear.slopes)
        deviations = deviations + (linear.shift if np.any(linear.shift) else 0.0)
        sampled = summarise(deviations, between)
    return ToleranceBand(
        of,
        name,
        found.kinds[name],
        source,
        variations,
        between,
        tuple(map(int, np.flatnonzero(found.is_singular))),
        sampled,
        distribution,
        _contributor_names(variations),
        linear,
        found.values[name],
        guaranteed_band(source, of, name, variations) if guaranteed else None,
    )


def _contributor_names(variations: Variations) -> tuple[str, ...]:
    pins = (f"clearance.{each.pair}" for each in variations.offsets)
    return (*(each.number for each in variations.numbers), *pins)


def _read_limit(limit: float | tuple[float, float] | None) -> tuple[float, float] | None:
    if limit is None:
        return None
    both = (-abs(float(limit)), abs(float(limit))) if np.ndim(limit) == 0 else tuple(map(float, limit))  # type: ignore[arg-type]
    if len(both) != 2 or not np.isfinite(both).all() or both[0] >= both[1]:
        raise BadInput("limit", "a deviation, plus and minus, or the least and the greatest is wanted here")
    return both[0], both[1]


def _linear_spread(
    source: State | Motion | Forces,
    slopes: Array,
    names: tuple[str, ...],
    variations: Variations,
    sigmas: float,
) -> LinearSpread:
    columns = [names.index(each.number) for each in variations.numbers]
    pins = [names.index(f"clearance.{each.pair}.x") for each in variations.offsets]
    many, parts = slopes.shape[:2]
    by_pin = np.stack([slopes[:, :, [k, k + 1]] for k in pins], axis=2) if pins else np.zeros((many, parts, 0, 2))
    radii = np.tile([each.radius for each in variations.offsets], (many, 1)).reshape(many, len(pins))
    shift = np.zeros((many, parts))
    if isinstance(source, Forces):
        for m, each in enumerate(variations.offsets):
            towards = _held_towards(source, each)
            shift += np.einsum("npd,nd,n->np", by_pin[:, :, m], towards, radii[:, m])
            radii[:, m] = np.where(towards.any(axis=1), 0.0, radii[:, m])
    return LinearSpread(
        slopes[:, :, columns],
        np.array([each.lower for each in variations.numbers]),
        np.array([each.upper for each in variations.numbers]),
        by_pin,
        radii,
        shift,
        sigmas,
    )


def _held_towards(forces: Forces, offset: PinOffset) -> Array:
    """Where the load holds a pin (n, 2), in the axes of the pair's first link: against the force on its second one.

    0 where there is no force, and the pin may stand anywhere.
    """
    first = next(pair.links[0] for pair in forces.mechanism.pairs if pair.name == offset.pair)
    force = np.atleast_2d(np.asarray(forces.reactions[offset.pair].force, dtype=float))
    angle = np.ravel(np.asarray(forces.moving.link(first).angle, dtype=float))
    x, y = force[:, 0], force[:, 1]
    size = np.hypot(x, y)
    known = size > 0.0
    unit = np.stack([np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x], axis=1)
    return np.where(known[:, None], -unit / np.where(known, size, 1.0)[:, None], 0.0)


def _of_limits(  # many: a limit, what varies, and what is asked of it
    source: State | Motion | Forces,
    of: str,
    result: str,
    variations: Variations,
    limit: tuple[float, float] | None,
    distribution: str,
    guaranteed: bool,
) -> ToleranceBand:
    """The band of a stroke or swing, of its time ratio, or of the dead points of the running input."""
    moving = source.moving if isinstance(source, Forces) else source
    if not isinstance(moving, Motion):
        raise BadInput("result", f"{result!r} is told of a whole motion, as `planar.cycle` gives it")
    offsets = tuple(each.pair for each in variations.offsets)
    kind = "length"
    if result == "dead_points":
        dead = dead_point_slopes(moving, offsets) if moving.running_input == of else ()
        nominal, slopes = [each.input for each in dead], [each.input_slopes for each in dead]
    else:
        known = of in moving.frames or of in moving._relative_motions
        travel = travel_slopes(moving, of, offsets) if known else None
        is_ratio = result == "time_ratio"
        told = None if travel is None else travel.time_ratio_slopes if is_ratio else travel.travel_slopes
        value = None if travel is None else travel.time_ratio if is_ratio else travel.travel
        nominal, slopes = ([value], [told]) if told is not None and value is not None else ([], [])
        kind = "number" if is_ratio else kind
    if not slopes:
        raise BadInput("result", f"{of!r} has no {result.replace('_', ' ')} here, or none with derivatives")
    if kind == "length":
        motions = moving._relative_motions
        kind = motions[of].input_kind.value if of in motions else "angle"
    names = tuple(slopes[0])
    whole = np.array([[each[name] for name in names] for each in slopes])[None]
    unknown = {name for k, name in enumerate(names) if not np.isfinite(whole[:, :, k]).all()}
    known_numbers = tuple(each for each in variations.numbers if each.number in names)
    kept = leave_out_tied(variations._replace(numbers=known_numbers), unknown)
    spread = _linear_spread(moving, whole, names, kept, SIGMAS[distribution])
    rows, names = np.array(nominal)[None], _contributor_names(kept)
    proved = _guaranteed_limits(moving, of, result, kept) if guaranteed else None
    return ToleranceBand(of, result, kind, source, kept, limit, (), None, distribution, names, spread, rows, proved)


def _guaranteed_limits(motion: Motion, of: str, result: str, variations: Variations) -> Guaranteed:
    if result == "time_ratio":
        raise BadInput("guaranteed", "guaranteed bands are told of places, angles, lengths and travels, not of ratios")
    return (
        guaranteed_travel(motion, of, variations) if result == "travel" else guaranteed_dead_points(motion, variations)
    )
