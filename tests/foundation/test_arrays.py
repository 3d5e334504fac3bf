"""Mechanisms of many links are computed on one thread of BLAS, and what the caller has set comes back afterwards."""

import threadpoolctl

from planar.document.first_argument import takes_mechanism
from tests.known import MODELS


def thread_counts():
    return {library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"}


@takes_mechanism
def counts_inside(mechanism):
    return thread_counts()


def test_many_links_are_computed_on_one_thread_of_blas():
    with threadpoolctl.threadpool_limits(2, "blas"):
        set_by_caller = thread_counts()
        assert counts_inside(MODELS["chain-42"]) == {1}
        assert counts_inside(MODELS["four-bar"]) == thread_counts() == set_by_caller
