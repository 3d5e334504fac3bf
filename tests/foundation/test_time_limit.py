"""Time limits: nested ones, interruptions, and what is no time."""

import signal
import threading

import pytest

from planar.foundation.errors import BadInput
from planar.foundation.time_limit import time_is_over, time_limit


def test_a_limit_is_over_after_its_time_and_within_others():
    assert time_is_over() == ""
    with time_limit(None):
        assert time_is_over() == ""
        with time_limit(1e-9):
            assert time_is_over() == "the time limit of 1e-09 s was reached"
            with time_limit(1000.0):
                assert time_is_over() == "the time limit of 1e-09 s was reached"
        assert time_is_over() == ""


@pytest.mark.usefixtures("interruptions")
def test_the_first_interruption_ends_a_computation_and_the_second_one_raises():
    before = signal.getsignal(signal.SIGINT)
    with time_limit(None), time_limit(None):
        signal.raise_signal(signal.SIGINT)
        assert time_is_over() == "the user interrupted it"
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert time_is_over() == ""
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_have_limits_without_interruptions():
    told = []

    def work():
        with time_limit(1e-9):
            told.append(time_is_over())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert told == ["the time limit of 1e-09 s was reached"]


@pytest.mark.parametrize("seconds", [0, -1.0, float("nan"), float("inf"), "5", True])
def test_what_is_no_time_is_refused(seconds):
    with pytest.raises(BadInput, match="timeout: a time above zero, in s, is wanted"), time_limit(seconds):
        pass
