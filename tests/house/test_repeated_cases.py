"""The cases that a plain run leaves out: of tests that are there, and never all of one."""

from pathlib import Path

import numpy as np

from tests.repeated_cases import FULL, covering_tests, repeated_cases, without_repeated

ROOT = Path(__file__).parents[2]


def test_the_file_names_tests_that_are_there_and_that_lines_tell_all_of():
    for test in repeated_cases():
        path, _, function = test.partition("::")
        assert f"def {function}(" in (ROOT / path).read_text(encoding="utf-8")
        assert not test.startswith(FULL)


def test_of_every_test_a_case_is_left():
    test, cases = next(iter(repeated_cases().items()))
    repeated = [f"{test}[{case}]" for case in cases]
    assert without_repeated([*repeated, f"{test}[another]"]) == {f"{test}[another]"}
    assert without_repeated(repeated) == {*repeated}
    assert without_repeated(["tests/test_other.py::test_other[1]"]) == {"tests/test_other.py::test_other[1]"}


def test_chosen_tests_run_every_line_in_little_time():
    lines = {name: np.packbits(bits) for name, bits in {"": [1, 0, 0, 0], "a": [1, 1, 0, 0], "b": [0, 1, 1, 0]}.items()}
    lines |= {"c": np.packbits([0, 0, 1, 1]), "d": np.packbits([1, 1, 1, 1])}
    assert covering_tests(lines, {"a": 1.0, "b": 1.0, "c": 1.0, "d": 9.0}) == {"b", "c"}
    assert covering_tests(lines, {"a": 1.0, "b": 1.0, "c": 1.0, "d": 0.1}) == {"d"}
