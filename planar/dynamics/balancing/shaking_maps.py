"""What the links' inertia does to the frame and to the inputs, as linear maps of the links' mass parameters.

A link with the origin P of its axes, their unit vectors e and e' and the mass parameters m, mx, my, I about P has the
momentum m v_P + mx de/dt + my de'/dt, which is linear in these; so are its moment of momentum about a fixed point, its
kinetic energy, and what follows from them (R. S. Berkof and G. G. Lowen, A New Method for Completely Force Balancing
Simple Linkages, J. Eng. Ind. 91, 1969, write the first so).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.dynamics.balancing.mass_parameters import LinkAxes, link_axes
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.reaction_solver import ReactionSolver, fill_balance
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.results.motion import Motion

RATE_TOLERANCE = 1e-8
"""Velocities with an input at unit rate that open the constraints by more than this are none."""


class ShakingMaps(NamedTuple):
    """Linear maps of mass parameters (4 links,) at n positions.

    `force` (n, 2, 4 links) to the shaking force (N), `moment` (n, 4 links) to the shaking moment about a point (N m),
    `efforts` by input (n, 4 links) to what it supplies for inertia and weights (N m, at a slide N).
    """

    force: Array
    moment: Array
    efforts: Mapping[str, Array]


class UnitRateMomentum(NamedTuple):
    """The momentum of the links with one input alone at unit rate, as maps of mass parameters (4 links,).

    `linear` (n, inputs, 2, 4 links), `angular` (n, inputs, 4 links) about a point; `condition` (n,) is the condition
    number of the equations from which the velocities come, infinite where these do not tell them, as at a dead point.
    """

    linear: Array
    angular: Array
    condition: Array


class LinkKinematics:
    """The axes of all moving links at the positions of a motion, in which their mass parameters are taken."""

    def __init__(self, motion: Motion):
        """Loads and springs have no part in it."""
        bare = replace(motion, mechanism=replace(motion.mechanism, loads=(), springs=()))
        self.motion = motion
        self.reactions: ReactionSolver = fill_balance(KinematicArrays(bare), None, inertia=False)
        self.field = self.reactions.field
        self.axes = link_axes(motion.mechanism, motion.shapes)

    def shaking_maps(self, about: Array) -> ShakingMaps:
        """The maps at every position, the moment about a point of the frame (2,), m."""
        many, links = self.field.position_count, len(self.axes)
        force, moment = np.zeros((many, links, 4, 2)), np.zeros((many, links, 4))
        for k, axes in enumerate(self.axes):
            place, _, acceleration = self._origin_rates(axes)
            (first, _, first_second), (second, _, second_second) = self._unit_vectors(axes)
            arm = place - about
            force[:, k, 0], force[:, k, 1], force[:, k, 2] = acceleration, first_second, second_second
            moment[:, k, 0] = _cross(arm, acceleration)
            moment[:, k, 1] = _cross(arm, first_second) + _cross(first, acceleration)
            moment[:, k, 2] = _cross(arm, second_second) + _cross(second, acceleration)
            moment[:, k, 3] = self.field.angle_rates(axes.link, 2)
        efforts = {given.pair: self._effort_map(number) for number, given in enumerate(self.motion.mechanism.inputs)}
        return ShakingMaps(-force.reshape(many, 4 * links, 2).transpose(0, 2, 1), -moment.reshape(many, -1), efforts)

    def unit_rate_momentum(self, about: Array) -> UnitRateMomentum:
        """The momentum maps of every input alone at unit rate, at every position."""
        many, links, inputs = self.field.position_count, len(self.axes), len(self.motion.mechanism.inputs)
        linear, angular = np.zeros((many, inputs, links, 4, 2)), np.zeros((many, inputs, links, 4))
        for number in range(inputs):
            for k, axes in enumerate(self.axes):
                velocity, turning = self._virtual_velocity(number, axes)
                (first, *_), (second, *_) = self._unit_vectors(axes)
                arm = self._origin_rates(axes)[0] - about
                rates = velocity, turning[:, None] * second, -turning[:, None] * first
                linear[:, number, k, :3] = np.stack(rates, axis=1)
                angular[:, number, k, 0] = _cross(arm, rates[0])
                angular[:, number, k, 1] = _cross(arm, rates[1]) + _cross(first, velocity)
                angular[:, number, k, 2] = _cross(arm, rates[2]) + _cross(second, velocity)
                angular[:, number, k, 3] = turning
        matrix, inverse = np.asarray(self.reactions.equilibrium_matrix), self.reactions.equilibrium.inverse
        condition = np.linalg.norm(matrix, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
        driven = slice(self.reactions.row_count, None)
        wrong = inverse[:, driven] @ matrix - np.eye(matrix.shape[2])[driven]
        condition[np.abs(wrong).max(axis=(1, 2), initial=0.0) > RATE_TOLERANCE] = np.inf
        return UnitRateMomentum(
            linear.reshape(many, inputs, 4 * links, 2).transpose(0, 1, 3, 2),
            angular.reshape(many, inputs, 4 * links),
            condition,
        )

    @property
    def regular_rows(self) -> BoolArray:
        """The positions at which all rates are told (n,)."""
        rates = [self.field.angle_rates(axes.link, 2) for axes in self.axes]
        rates += [part for axes in self.axes for part in self._origin_rates(axes)[2].T]
        return np.isfinite(np.array(rates).reshape(-1, self.field.position_count)).all(axis=0)

    def _origin_rates(self, axes: LinkAxes) -> tuple[Array, Array, Array]:
        """Where the origin of axes is, with two rates, each (n, 2)."""
        at, velocity, acceleration = (self.field.point_rates(axes.link, axes.origin, rate) for rate in range(3))
        return at, velocity, acceleration

    def _unit_vectors(self, axes: LinkAxes) -> tuple[list[Array], list[Array]]:
        """The unit vectors of axes with two rates, each (n, 2)."""
        tip = axes.origin + axes.axis
        first: list[Array] = [
            self.field.point_rates(axes.link, tip, rate) - self.field.point_rates(axes.link, axes.origin, rate)
            for rate in range(3)
        ]
        return first, [np.stack([-each[:, 1], each[:, 0]], axis=-1) for each in first]

    def _virtual_velocity(self, number: int, axes: LinkAxes) -> tuple[Array, Array]:
        """The velocity of the origin of axes (n, 2) and that of the link's angle (n,), with one input at unit rate.

        An effort of the input does on the links what the multipliers tell, and by virtual work these are the rates.
        """
        reactions = self.reactions
        row = reactions.row_count + number
        first = reactions.work.link_columns[axes.link]
        by = reactions.coordinate_scale[first : first + 3] / reactions.column_scale[:, row, None]
        rates = self._input_rows[:, number, first : first + 3] * by
        arm = self._origin_rates(axes)[0] - self.field.point_rates(axes.link, Vector(0.0, 0.0))
        turning = rates[:, 2]
        return rates[:, :2] + turning[:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1), turning

    @cached_property
    def _input_rows(self) -> Array:
        """The rows of the inverse of equilibrium that give the efforts (n, inputs, links)."""
        return self.reactions.equilibrium.inverse_rows(slice(self.reactions.row_count, None))

    def _effort_map(self, number: int) -> Array:
        """What an input supplies for mass parameters, their weights among it (n, 4 links)."""
        gravity = np.array(self.motion.mechanism.gravity)
        found = np.zeros((self.field.position_count, len(self.axes), 4))
        for k, axes in enumerate(self.axes):
            velocity, turning = self._virtual_velocity(number, axes)
            acceleration = self._origin_rates(axes)[2] - gravity
            vectors = self._unit_vectors(axes)
            found[:, k, 0] = (acceleration * velocity).sum(axis=1)
            for column, (unit, _, second) in enumerate(vectors, start=1):
                across = np.stack([-unit[:, 1], unit[:, 0]], axis=-1)
                found[:, k, column] = (second * velocity).sum(axis=1) + turning * (acceleration * across).sum(axis=1)
            found[:, k, 3] = turning * self.field.angle_rates(axes.link, 2)
        return found.reshape(len(found), -1)


def _cross(first: Array, second: Array) -> Array:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
