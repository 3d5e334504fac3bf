"""Dimensions of a mechanism from what was measured of it, with how exactly they are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from planar.analysis.calibration.fitted_residuals import FittedSamples, ResidualFunction, without_dead_points
from planar.analysis.calibration.identifiability import Unidentified, describe_unseen, unseen_changes
from planar.analysis.calibration.measurements import Measurement, read_measurement
from planar.analysis.calibration.outliers import Outlier, find_outliers
from planar.derivatives.design_equations import design_equations
from planar.derivatives.kinematic_slopes import design_dimensions
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import Dimension, file_dimensions, find_dimension
from planar.document.first_argument import takes_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, PlanarError, join_names
from planar.foundation.time_limit import MORE_TIME, stop_if_over, stops_in_time
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase

LOSSES = ("linear", "soft_l1", "huber", "cauchy")
"""How much large residuals count, as scipy's `least_squares` has it: by their squares, else less."""
MAX_EVALUATIONS = 100
TOLERANCE = 1e-10
"""Of the sum of squares, of the numbers and of the slope: a step that wins less is the last."""
MEDIAN_TO_DEVIATION = 1.4826
"""The standard deviation beside the median of absolute values, of a normal distribution."""
LOSS_SCALE = 1.5
"""Standard deviations from which on a residual counts less in a robust loss."""
RESTING = 1e-9
"""Of the greatest singular value: how strongly numbers are held to those of the file."""
NO_FREEDOM = "there are no more measured numbers than free ones: how exact these are cannot be told"
MAX_BEND = 1.0
"""Of a standard deviation of a residual: what bends off more over one deviation of the numbers is not linear."""
CURVED = (
    "within their deviations the numbers do not act linearly: these deviations are rough; more exact samples, or some "
    "of a larger part of the motion, would tell more"
)
NO_INFLUENCE = 1e-9
"""Of the greatest slope: a number with less does not matter."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The dimensions of a mechanism that fit what was measured of it best.

    `values` are the free numbers by name (SI), `covariance` (numbers, numbers) is theirs, by the variance of the
    residuals, and `deviations` their standard deviations; both are NaN for numbers that the measurement does not
    determine alone, which stay near what the file had. `unidentified` are the changes of numbers that it does not see,
    each with a `sentence`; `singular_values` tell how near others are to that.

    `residuals` are what was measured less what the fitted `mechanism` shows, shaped as what was given (SI), by the
    names of what was measured; angles by less than half a turn. `inputs` are the positions of the inputs (n,) at
    the samples: as given, else those of the nearest points of the path. `residual_deviation` is the standard deviation
    of a residual beside the one given for it; where none is given beside the mechanism's size for lengths and a rad for
    angles. `outliers` are samples that do not fit the rest. `remarks` say what else there is to know.
    """

    start: Mechanism
    mechanism: Mechanism
    measurement: Measurement
    values: Mapping[str, float]
    covariance: Array
    deviations: Mapping[str, float]
    residuals: Mapping[str, Array]
    inputs: Mapping[str, Array]
    residual_deviation: float
    degrees_of_freedom: int
    unidentified: tuple[Unidentified, ...]
    outliers: tuple[Outlier, ...]
    singular_values: Array
    evaluations: int
    remarks: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Calibration of {self.mechanism.name!r}: {len(self.values)} numbers, {self.measurement.many} samples>"

    @property
    def is_timed(self) -> bool:
        """Whether the positions of the inputs were given."""
        return self.measurement.inputs is not None


@takes_mechanism
@stops_in_time
def calibrate(  # many: what is measured, and how it is fitted
    mechanism: Mechanism,
    measured: Mapping[str, Any],
    free: Sequence[str] = (),
    *,
    inputs: Mapping[str, Any] | None = None,
    deviations: Mapping[str, float] | None = None,
    loss: str = "linear",
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Calibration:
    """The numbers of a mechanism's file that fit best what was measured of it, by least squares on exact derivatives.

    `measured` by name: the positions of a point (n, 2), the angle of a link (n,), the position of a pair (n,), or the
    distance of two points (n,) as "B to E"; or by the names of results, as `{"C": {"relative_angle": ...}}` of a pair
    that shares a point's name. All in SI, NaN for what is missing. `inputs` are the positions (n,) of the inputs at the
    samples, by name; left out, each sample lies somewhere on the path that the mechanism runs through (see
    `planar.cycle`), in no order, and counts by its distance from it. `free` are the numbers that are sought, by the
    names of `planar.dimensions`; left out, all of links and pairs that the measurement depends on. `deviations` are
    the standard deviations (SI) of what was measured, by name. A `loss` other than "linear" lets outliers count less:
    "soft_l1", "huber", "cauchy" (scipy.optimize.least_squares).

    The numbers of the file are where the search starts; the assembly is the file's. Raises BadInput, Unknown, and
    NoAnswer where a sample cannot be reached by the mechanism, and after `timeout` s or a Ctrl-C, with the outcome
    "interrupted".

    >>> import planar
    >>> motion = planar.cycle("crank-rocker", 24)
    >>> start = planar.load("crank-rocker").with_values({"coupler.length": 0.182})
    >>> measured, inputs = {"B": motion.point("B").position}, {"A0": motion.inputs["A0"].position}
    >>> found = planar.calibrate(start, measured, ["coupler.length"], inputs=inputs)
    >>> round(found.values["coupler.length"], 9)
    0.18
    """
    if loss not in LOSSES:
        raise BadInput("loss", f"{join_names(LOSSES, last_joiner=' or ')} is wanted, not {loss!r:.40}")
    size = design_equations(mechanism).solver.unit
    measurement = read_measurement(mechanism, measured, inputs, deviations, size)
    measurement, lost = without_dead_points(mechanism, measurement)
    dimensions, is_chosen = _free_dimensions(mechanism, free), bool(free)
    first = ResidualFunction(mechanism, measurement, [each.name for each in dimensions]).at(mechanism)
    if not is_chosen:
        scale = np.array([size if each.kind == "length" else 1.0 for each in dimensions])
        strength = np.abs(first.slopes * scale).max(axis=0, initial=0.0)
        matters = strength > NO_INFLUENCE * strength.max(initial=0.0)
        dimensions = tuple(each for each, kept in zip(dimensions, matters, strict=True) if kept)
    if not dimensions:
        raise BadInput("free", "what was measured depends on no number of the file")
    return _Fit(mechanism, measurement, dimensions, size, loss).calibration(lost)


def _free_dimensions(mechanism: Mechanism, free: Sequence[str]) -> tuple[Dimension, ...]:
    """The numbers that are sought. Raises BadInput."""
    known = {each.name: each for each in design_dimensions(mechanism) if each.path[0] in ("links", "pairs")}
    if isinstance(free, str):
        raise BadInput("free", f"a list of names is wanted, as [{free!r}]")
    tied = {*tied_dimensions(mechanism, free or None)}
    for name in free:
        find_dimension(file_dimensions(mechanism), name)
        if name not in known:
            raise BadInput(str(name), "this is no dimension of a link or a pair; only these are found by measuring")
        if name in tied:
            raise BadInput(str(name), "this number cannot change alone, since others have to go with it")
    if len(set(free)) < len(free):
        raise BadInput("free", "a name stands twice")
    return tuple(known[name] for name in free) or tuple(each for name, each in known.items() if name not in tied)


class _Fit:
    """One fit: scaled numbers x = d / scale, and what the last refusal was."""

    def __init__(
        self,
        mechanism: Mechanism,
        measurement: Measurement,
        dimensions: Sequence[Dimension],
        size: float,
        loss: str,
    ):
        self.mechanism, self.measurement, self.dimensions, self.loss = mechanism, measurement, dimensions, loss
        self.scale = np.array([size if each.kind == "length" else 1.0 for each in dimensions])
        self.function = ResidualFunction(mechanism, measurement, [each.name for each in dimensions])
        self.problem: PlanarError | None = None
        self.evaluations = 0
        self._last: tuple[Array, FittedSamples] | None = None

    def samples(self, x: Array) -> FittedSamples | None:
        """The residuals at scaled numbers; None where there are none."""
        if self._last is None or not np.array_equal(self._last[0], x):
            stop_if_over(
                f"after {self.evaluations} evaluations of the residuals",
                f"{MORE_TIME}, or give fewer free numbers or samples",
            )
            self.evaluations += 1
            try:
                self._last = (x.copy(), self.function.at(self.function.changed(x * self.scale)))
                self.problem = None
            except PlanarError as problem:
                self.problem = problem
                return None
        return self._last[1]

    def rows(self, x: Array) -> Array:
        """The residuals; what cannot be assembled is no number, and the step is taken back."""
        found = self.samples(x)
        resting = self._rest * (x - self._start)
        return np.full(self._count, np.nan) if found is None else np.concatenate([found.rows, resting])

    def slopes(self, x: Array) -> Array:
        """Their derivatives in the scaled numbers."""
        found = self.samples(x)
        assert found is not None
        return np.concatenate([found.slopes * self.scale, self._rest * np.eye(len(x))])

    def calibration(self, lost: int) -> Calibration:
        """The result, where so many samples are left out already. Raises NoAnswer."""
        x = np.array([each.value for each in self.dimensions]) / self.scale
        start = self.function.at(self.mechanism)
        self._count, self._start = len(start.rows) + len(x), x
        # what the samples do not see stays where it is, by rows that are nothing beside the others
        self._rest = RESTING * float(np.linalg.norm(start.slopes * self.scale, 2))
        self._last = (x, start)
        x, is_done = self._minimise(x, "linear", 1.0)
        if self.loss != "linear":
            x, is_done = self._minimise(x, self.loss, LOSS_SCALE * self._robust_deviation(x))
        found = self.samples(x)
        if found is None or (not is_done and self.problem is not None):
            problem = self.problem
            assert problem is not None
            if isinstance(problem, NoAnswer):
                raise NoAnswer(
                    problem.outcome, f"the numbers that would fit better cannot be assembled: {problem}"
                ) from None
            raise problem
        return self._result(x, found, self._remarks(found, lost, is_done))

    def _minimise(self, x: Array, loss: str, f_scale: float) -> tuple[Array, bool]:
        from scipy.optimize import least_squares  # slow to load, and only needed here

        found = least_squares(
            self.rows,
            x,
            self.slopes,
            method="trf",
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=None,
            loss=loss,
            f_scale=f_scale,
            max_nfev=MAX_EVALUATIONS,
        )
        return np.asarray(found.x), found.status > 0

    def _robust_deviation(self, x: Array) -> float:
        found = self.samples(x)
        assert found is not None
        return max(MEDIAN_TO_DEVIATION * float(np.median(np.abs(found.rows[found.is_active]))), np.finfo(float).tiny)

    def _result(self, x: Array, found: FittedSamples, remarks: list[str]) -> Calibration:
        slopes = found.slopes[found.is_active] * self.scale
        singular, unseen, rank = unseen_changes(slopes)
        freedom = int(found.is_active.sum()) - rank
        squares = float(found.rows @ found.rows)
        deviation = (squares / freedom) ** 0.5 if freedom > 0 else float("nan")
        if self.loss != "linear":
            deviation = self._robust_deviation(x)
        covariance = deviation**2 * np.linalg.pinv(slopes.T @ slopes, rcond=1e-14, hermitian=True)
        covariance *= np.outer(self.scale, self.scale)
        is_unseen = (unseen != 0.0).any(axis=0)
        covariance[is_unseen] = covariance[:, is_unseen] = np.nan
        numbers = x * self.scale
        names = [each.name for each in self.dimensions]
        told = tuple(describe_unseen(each * self.scale, self.dimensions, self.mechanism.frame) for each in unseen)
        remarks = [*remarks, *self._linearity_remark(x, found, deviation)]
        return Calibration(
            self.mechanism,
            self.function.changed(numbers),
            self.measurement,
            dict(zip(names, map(float, numbers), strict=True)),
            covariance,
            dict(zip(names, map(float, np.sqrt(np.diag(covariance))), strict=True)),
            self._named_residuals(found),
            dict(zip(self.function.names, found.inputs.T, strict=True)),
            deviation,
            freedom,
            told,
            find_outliers(found, slopes, deviation, freedom, self.measurement),
            singular,
            self.evaluations,
            (*remarks, *([] if freedom > 0 else [NO_FREEDOM])),
        )

    def _linearity_remark(self, x: Array, found: FittedSamples, deviation: float) -> list[str]:
        """Whether residuals go on as they change here, for one deviation of the change that is seen least."""
        slopes = found.slopes[found.is_active] * self.scale
        _, singular, changes = np.linalg.svd(slopes, full_matrices=False)
        rank = unseen_changes(slopes)[2]
        if not rank or not deviation > 0.0:
            return []
        change = deviation / singular[rank - 1] * changes[rank - 1]
        with suppress(PlanarError):
            there = self.function.at(self.function.changed((x + change) * self.scale))
            if np.array_equal(there.is_active, found.is_active):
                expected = found.rows[found.is_active] + slopes @ change
                if np.linalg.norm(there.rows[found.is_active] - expected) <= MAX_BEND * deviation:
                    return []
        return [CURVED]

    def _named_residuals(self, found: FittedSamples) -> dict[str, Array]:
        ends = np.cumsum([each.values.shape[1] for each in self.measurement.series])[:-1]
        residuals: dict[str, Array] = {}
        for each, own in zip(self.measurement.series, np.split(found.differences, ends, axis=1), strict=True):
            name = each.name if each.name not in residuals else f"{each.name} {each.result.replace('_', ' ')}"
            residuals[name] = own if own.shape[1] > 1 else own[:, 0]
        return residuals

    def _remarks(self, found: FittedSamples, lost: int, is_done: bool) -> list[str]:
        told = []
        if not is_done:
            told.append(f"the fit was stopped after {MAX_EVALUATIONS} steps, and may go on from the fitted file")
        kinds = {each.kind for each in self.measurement.series}
        if len(kinds) > 1 and not self.measurement.has_deviations:
            told.append("lengths and angles are weighed alike, by the mechanism's size and a rad; give deviations")
        if self.measurement.values.shape[1] > 1 or self.measurement.inputs is not None:
            lost += len({*found.row_samples.tolist()} - {*found.row_samples[found.is_active].tolist()})
        if lost:
            told.append(f"{count_phrase(lost, 'sample')} at dead points left out, where nothing follows smoothly")
        return told
