"""The balance of virtual work at many positions, in the coordinates of the links alone."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.lagrangian import Work
from planar.equations.casadi_call import Called
from planar.model.mechanism import Input, Mechanism

Array = np.ndarray


class Balance(NamedTuple):
    """Everything at positions (n, ...), over the coordinates of the links alone (links: 3 per moving link).

    `constraints` (n, rows, links) with the pairs' own coordinates gone, `drives` (n, inputs, links), `loads` (n, links)
    what loads, weights, springs and dampers put on them, `inertia` (n, links) what accelerating them takes.
    """

    constraints: Array
    drives: Array
    loads: Array
    inertia: Array


class Balancing:
    """The function of one mechanism that fills a balance in."""

    def __init__(self, work: Work):
        self.work, self.many = work, work.many
        self.rows: dict[str, slice] = {}
        "of every pair: its rows of the constraints"
        at = 0
        for pair in work.mechanism.pairs:
            self.rows[pair.name] = slice(at, at + len(pair.constrains) - len(pair.coordinates))
            at = self.rows[pair.name].stop
        self.count = at
        # what efforts do is told by their places: how a pair's own coordinates follow those of its links is not unique
        drives = ca.vertcat(ca.SX(0, work.q.numel()), *(work.effort(given.pair).T for given in work.mechanism.inputs))
        outputs = [ca.jacobian(work.gaps, work.q), drives, ca.sum2(work.acting), work.inertia]
        given = [work.q, work.q1, work.q2, work.factors, work.turns]
        self._called = Called(ca.Function("balance", given, [ca.densify(each) for each in outputs]))

    def over(self, q: Array, q1: Array, q2: Array, factors: Array, wound: Array) -> Balance:
        """Everything at coordinates with their rates (n, coordinates), each alike; factors of the loads (n, loads), and
        `wound` as `Work.wound` has it."""
        parts = self._called.over(len(q), q, q1, q2, factors, wound)
        slopes, drives = (each.transpose(0, 2, 1) for each in parts[:2])
        loads, inertia = (each[:, 0] for each in parts[2:])
        constraints = np.zeros((len(q), self.count, self.many))
        first = 0
        for pair in self.work.mechanism.pairs:
            rows, own = slice(first, first + len(pair.constrains)), self.work.own[pair.name]
            first = rows.stop
            of_links, of_own = slopes[:, rows, : self.many], slopes[:, rows, own]
            count = of_own.shape[2]
            if count:
                # what is left to hold the links, square to what its own coordinates do
                basis = np.linalg.qr(of_own, mode="complete")[0]
                of_links = (basis.transpose(0, 2, 1) @ of_links)[:, count:]
            constraints[:, self.rows[pair.name]] = of_links
        return Balance(constraints, *(each[..., : self.many] for each in (drives, loads, inertia)))


def balancing(mechanism: Mechanism) -> Balancing:
    """The function of a mechanism, kept for the next time, wherever its inputs then stand and however fast they run."""
    inputs = tuple(Input(given.pair, 0.0) for given in mechanism.inputs)
    loads = tuple(load._replace(varies=None) for load in mechanism.loads)
    acted_on = mechanism.links, mechanism.pairs, inputs, loads, mechanism.springs, mechanism.masses, mechanism.gravity
    return _balancing(Mechanism("", mechanism.frame, *acted_on))


@lru_cache(maxsize=32)
def _balancing(mechanism: Mechanism) -> Balancing:
    return Balancing(Work(mechanism))
