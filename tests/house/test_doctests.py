"""The examples in the docstrings of the public face."""

import doctest
import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import planar
from planar.guide.reference import class_entries
from tests.remembered import remembered

FUNCTIONS = [name for name in planar.__all__ if inspect.isroutine(getattr(planar, name))]
ENTRIES = class_entries()
CLASSES = [name for name in planar.__all__ if inspect.isclass(getattr(planar, name))]


@pytest.fixture(scope="module", autouse=True)
def computed_once():
    """What several examples compute is computed once."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("force_map", "simulate", "synthesise"):
            patch.setattr(planar, name, remembered(getattr(planar, name)))
        yield


def test_functions_have_examples_among_those_of_their_modules():
    """Those of modules are run by the tests of the public face."""
    for name in FUNCTIONS:
        function = inspect.unwrap(getattr(planar, name))
        module = import_module(function.__module__)
        assert ">>> " in Path(inspect.getsourcefile(module)).read_text(encoding="utf-8"), name
        examples = doctest.DocTestFinder(exclude_empty=True).find(module)
        assert [case for case in examples if case.examples and case.docstring == function.__doc__], name


def test_every_public_class_has_an_example_in_the_reference():
    assert sorted(ENTRIES) == sorted(CLASSES)


@pytest.mark.parametrize("name", CLASSES)
def test_the_example_of_a_class_makes_one_and_its_attributes_are_told(name):
    """Attributes are fields and properties; each is told in the docstring of the class, by its own, or there."""
    kind, entry = getattr(planar, name), ENTRIES[name]
    assert entry.example.count(">>>") > 1
    example = doctest.DocTestParser().get_doctest(entry.example, {}, name, None, None)
    assert doctest.DocTestRunner(verbose=False).run(example, clear_globs=False).failed == 0
    properties = {key: value.fget.__doc__ for key, value in inspect.getmembers(kind) if isinstance(value, property)}
    fields = [*getattr(kind, "_fields", ()), *getattr(kind, "__dataclass_fields__", {})]
    internal = kind.__module__.startswith(("planar.model.pairs", "planar.model.input_laws"))  # told by their keys
    untold = [
        key
        for key in {*fields, *properties} - set(entry.attributes)
        if not key.startswith("_") and not re.search(rf"\b{key}\b", kind.__doc__ or "") and not properties.get(key)
    ]
    assert internal or untold == []
    assert set(entry.attributes) <= {*fields, *properties}
