"""The public face as a user's file has it: what its functions return at run time, and what mypy takes it for."""

import ast
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import assert_type

from matplotlib.figure import Figure

import planar
from planar import plot


def test_results_have_the_types_that_a_type_checker_sees() -> None:
    mechanism = assert_type(planar.load("four-bar"), planar.Mechanism)
    state = assert_type(planar.solve(mechanism, {"A": 1.0}), planar.State)
    motion = assert_type(planar.cycle(Path("models/four-bar.json"), steps=12), planar.Motion)
    swept = assert_type(planar.sweep("four-bar", {"BC.length": [0.066, 0.0661]}, steps=4), planar.Sweep)
    each = assert_type(planar.sweep_each([mechanism], steps=4), planar.Each)
    found: list[tuple[object, type]] = [
        (mechanism, planar.Mechanism),
        (state, planar.State),
        (motion, planar.Motion),
        (swept, planar.Sweep),
        (each, planar.Each),
        (assert_type(each[0], planar.Swept), planar.Swept),
        (assert_type(each[:1], tuple[planar.Swept, ...]), tuple),
        (assert_type(mechanism.with_values({"BC.length": 0.0661}), planar.Mechanism), planar.Mechanism),
        (assert_type(planar.dimensions(mechanism), dict[str, float]), dict),
        (assert_type(planar.prepared(mechanism, steps=4)(), planar.PreparedRun), planar.PreparedRun),
        (assert_type(state.point("B"), planar.PointState), planar.PointState),
        (assert_type(state.link("BC"), planar.LinkState), planar.LinkState),
        (assert_type(motion.point("B"), planar.PointMotion), planar.PointMotion),
        (assert_type(planar.centres(state), planar.Centres), planar.Centres),
        (assert_type(planar.modes("four-bar", certify=False), planar.Modes), planar.Modes),
        (assert_type(planar.mobility(mechanism), planar.Mobility), planar.Mobility),
        (assert_type(plot.scheme(state), Figure), Figure),
        (assert_type(plot.positions("four-bar", 4), Figure), Figure),
        (assert_type(plot.loci(motion), Figure), Figure),
    ]
    for value, wanted in found:
        assert isinstance(value, wanted), (value, wanted)


def test_a_type_checker_sees_every_public_name_where_it_is_loaded_from() -> None:
    tree = ast.parse((files("planar") / "__init__.py").read_text(encoding="utf-8"))
    block = next(each for each in tree.body if isinstance(each, ast.If))
    seen = {}
    for each in block.body:
        assert isinstance(each, ast.ImportFrom)
        module = import_module(str(each.module))
        for name in each.names:
            seen[name.name] = getattr(module, name.name)
    assert sorted(seen) == sorted(planar.__all__)
    assert [name for name, value in seen.items() if getattr(planar, name) is not value] == []


def test_the_package_says_that_it_has_types() -> None:
    assert (files("planar") / "py.typed").is_file()
