"""The examples in the docstrings of the public face."""

import doctest
from importlib import import_module

import pytest

import planar

NAMES = ("load", "solve", "cycle", "centres", "forces", "modes")


@pytest.mark.parametrize("name", NAMES)
def test_an_example_says_what_comes_of_it(name):
    function = getattr(planar, name)
    (found,) = doctest.DocTestFinder(recurse=False).find(function, name, module=import_module(function.__module__))
    assert found.examples
    assert doctest.DocTestRunner(verbose=False).run(found).failed == 0
