"""The examples in the docstrings of the public face."""

import doctest
import inspect
from importlib import import_module

import pytest

import planar

FUNCTIONS = [name for name in planar.__all__ if inspect.isroutine(getattr(planar, name))]
CLASSES = [name for name in planar.__all__ if inspect.isclass(getattr(planar, name))]


def run_examples(name: str) -> int:
    value = getattr(planar, name)
    found = doctest.DocTestFinder().find(value, name, module=import_module(value.__module__))
    runner = doctest.DocTestRunner(verbose=False)
    assert sum(runner.run(each).failed for each in found) == 0
    return sum(len(each.examples) for each in found)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_an_example_says_what_comes_of_it(name):
    assert run_examples(name)


def test_the_examples_of_classes_and_their_methods_run():
    for name in CLASSES:
        run_examples(name)
