"""Sweeps whose blocks are solved elsewhere: threads, processes, a Dask cluster; workers that are killed."""

import os
import re
import signal
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import planar
from planar.batch import sweep_mechanisms
from planar.foundation.errors import BadInput
from tests.builders import four_bar
from tests.closed_forms import ROCKER

MANY = 48
STEPS = 24


def designs():
    rng = np.random.default_rng(3)
    b, d = 0.9 * rng.uniform(0.8, 1.2, MANY), rng.uniform(0.8, 1.2, MANY)
    return {"BC.length": b, "AD.D.x": d}


def here(**more):
    return planar.sweep(four_bar(*ROCKER, 0.8), designs(), STEPS, "C", **more)


def agree(found, wanted):
    for order in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(found, order)["C"][:], getattr(wanted, order)["C"], rtol=0, atol=1e-11)
    np.testing.assert_array_equal(found.status[:], wanted.status)
    np.testing.assert_array_equal(found.input, wanted.input)
    # how many positions are left to the general path hangs on which designs run side by side
    assert (found.general > 0) is (wanted.general > 0)
    mine, here = ([re.sub(r"\d+ positions", "positions", each) for each in of.remarks] for of in (found, wanted))
    assert mine == here


def two_processes():
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def test_threads_find_what_is_found_here():
    with ThreadPoolExecutor(2) as pool:
        agree(here(executor=pool, block=16), here())


def test_processes_find_what_is_found_here_and_a_killed_one_loses_nothing():
    told = []

    def progress(done, many):
        told.append((done, many))
        if len(told) == 1:
            os.kill(next(iter(pool._processes)), signal.SIGKILL)

    with two_processes() as pool:
        agree(here(executor=pool, block=5, progress=progress), here())
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert told[-1] == (MANY, MANY)


class Failing(ThreadPoolExecutor):
    """Loses the first blocks it is given; after that takes no more."""

    def __init__(self, lost):
        super().__init__(1)
        self.lost, self.given = lost, 0

    def submit(self, function, *arguments):
        self.given += 1
        if self.given > self.lost:
            raise RuntimeError("no more")
        future = Future()
        future.set_exception(OSError("lost"))
        return future


@pytest.mark.parametrize("lost", [0, 3, 100])
def test_an_executor_that_loses_every_block_loses_nothing(lost):
    with Failing(lost) as pool:
        agree(here(executor=pool, block=20), here())
    assert pool.given <= 6


class Cancelling(ThreadPoolExecutor):
    """Cancels whatever it is given."""

    def submit(self, function, *arguments):
        future = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future


def test_a_cancelled_block_is_solved_all_the_same():
    with Cancelling(1) as pool:
        agree(here(executor=pool, block=20), here())


@pytest.mark.parametrize("pool", [Cancelling(1), Failing(0), Failing(1), ThreadPoolExecutor(2)])
def test_mechanisms_in_parts_come_in_their_order_whatever_the_executor_loses(monkeypatch, pool):
    monkeypatch.setattr(sweep_mechanisms, "PART_SIZE", 2)
    mechanisms = [four_bar(0.3, length, 0.8, 1.0, 0.8) for length in np.linspace(0.9, 1.1, 7)]
    wanted, told = planar.sweep_each(mechanisms, STEPS), []
    with pool:
        found = planar.sweep_each(mechanisms, STEPS, executor=pool, progress=lambda *done: told.append(done))
    assert told == [(2, 7), (4, 7), (6, 7), (7, 7)]
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one.position["C"], other.position["C"])


def test_bad_input_is_told_once_and_not_tried_again():
    with ThreadPoolExecutor(1) as pool, pytest.raises(BadInput, match="no point 'Z'"):
        planar.sweep(four_bar(*ROCKER, 0.8), designs(), STEPS, "Z", executor=pool)


def test_a_dask_cluster_of_two_workers_one_of_which_is_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    told = []

    def progress(done, many):
        told.append(done)
        if len(told) == 1:
            os.kill(next(iter(pids.values())), signal.SIGKILL)

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(tmp_path)
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = client.run(os.getpid)
        agree(here(executor=client.get_executor(), block=8, progress=progress), here())
    assert told[-1] == MANY
