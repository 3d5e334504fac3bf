"""Numbers of a file: their names, and mechanisms with some changed."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import planar
from planar import BadInput
from planar.document.dimensions import file_dimensions, find_dimension, link_lengths
from planar.document.files import from_dict, to_dict
from planar.document.schema import schema
from planar.model.pairs import pair_types
from planar.model.pairs.turning import TurningPair
from tests.draws import covering
from tests.known import MODELS, kinds_of_model


def numbers_in(value):
    """Every number that stands in a JSON value."""
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from numbers_in(each)
    elif isinstance(value, float | int) and not isinstance(value, bool):
        yield value


@pytest.mark.parametrize("name", covering(MODELS, kinds_of_model))
def test_every_number_of_a_model_has_one_name_and_can_be_given_again(name):
    mechanism = MODELS[name]
    known = file_dimensions(mechanism)
    value = to_dict(mechanism)
    placed = {each.path for each in known.values()}
    assert len(placed) == len(known)
    lists = ("links", "pairs", "inputs", "loads", "springs", "masses", "gravity", "sketch")
    assert len(list(numbers_in({key: value.get(key) for key in lists}))) <= len(known)
    for path in placed:
        try:
            at = value
            for key in path:
                at = at[key]
        except (KeyError, IndexError):
            continue  # left out, so it is the default
        assert isinstance(at, float | int | str)
    assert mechanism.with_values(planar.dimensions(mechanism)) == mechanism


@pytest.mark.parametrize("kind", pair_types().values(), ids=list(pair_types()))
def test_every_number_of_every_pair_type_has_a_name(kind):
    """Each field of a pair that holds numbers is the place of some name."""
    for pair, *_ in kind.samples():
        held = {
            field
            for field, value in vars(pair).items()
            for each in (value if isinstance(value, tuple) else [value])
            if isinstance(each, float)
        }
        links = [planar.Link(name, tuple(planar.Point(p, planar.At(0.0, 0.0)) for p in "ABCPQS")) for name in "abc"]
        alone = planar.Mechanism("m", "c", tuple(links), (pair,))
        named = {each.address[2] for each in file_dimensions(alone).values() if each.path[0] == "pairs"}
        assert held <= named


def test_a_pair_type_of_its_own_has_its_numbers_named():
    @dataclass(frozen=True)
    class Screw(TurningPair):
        pitch: float = 0.0

        keyword: ClassVar[str] = "screw"
        entry_schemas: ClassVar = TurningPair.entry_schemas

        @classmethod
        def write(cls, group, quantity):
            entry = super().write(group, quantity)
            return entry | ({"pitch": quantity(group[0].pitch, "length")} if group[0].pitch else {})

    links = (
        planar.Link("a", (planar.Point("P", planar.At(0.0, 0.0)),)),
        planar.Link("b", (planar.Point("P", planar.At(0.0, 0.0)),)),
    )
    made = planar.Mechanism("m", "a", links, (Screw("P", ("a", "b"), ("P", "P"), "P"),))
    assert planar.dimensions(made)["P.pitch"] == 0.0


@pytest.mark.parametrize(
    ("model", "names"),
    [
        ("four-bar", ["BC.length", "AD.D.x", "BC.E.distance", "BC.E.angle", "BC.F.B", "A.pin_radius", "A.position"]),
        ("four-bar", ["A.velocity", "A.acceleration", "gravity.x", "gravity.y", "sketch.C.x"]),
        ("two-stroke-engine", ["stroke.line.angle", "stroke.turn", "loads.0.force.x", "loads.0.varies.factors.3"]),
        ("two-stroke-engine", ["loads.0.varies.at.3", "masses.rod.mass", "masses.rod.inertia", "masses.crank.at.x"]),
        ("geared-five-bar", ["wheels.teeth.0", "wheels.mesh.OA", "wheels.pressure_angle", "AC.P.angle"]),
        ("physical-pendulum", ["masses.pendulum.0.mass", "masses.pendulum.1.mass"]),
    ],
)
def test_names_of_models(model, names):
    assert set(names) <= set(planar.dimensions(model))


def test_values_are_si_or_have_a_unit():
    longer = planar.load("four-bar").with_values({"BC.length": "70 mm", "A.position": 1, "AD.D.x": np.float32(0.125)})
    found = planar.dimensions(longer)
    assert (found["BC.length"], found["A.position"], found["AD.D.x"]) == (0.07, 1.0, 0.125)
    assert longer.published == ()


def test_a_pin_of_many_links_has_one_radius():
    mechanism = next(m for m in MODELS.values() if len({p.name for p in m.pairs if ":" in p.name}) > 1)
    pin = next(pair for pair in mechanism.pairs if ":" in pair.name)
    thick = replace(
        mechanism,
        pairs=tuple(replace(p, radius=0.01) if p.entry_name() == pin.entry_name() else p for p in mechanism.pairs),
    )
    thin = thick.with_values({f"{pin.entry_name()}.pin_radius": 0.002})
    assert {p.radius for p in thin.pairs if p.entry_name() == pin.entry_name()} == {0.002}


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"BC.lenght": 1.0}, "BC.lenght: the mechanism has no number of that name; did you mean 'BC.length'"),
        ({"AD.D[0]": 1.0}, "AD.D[0]: the mechanism has no number of that name; did you mean 'AD.D.x'?"),
        ({"sketch.C[1]": 1.0}, "sketch.C[1]: the mechanism has no number of that name; did you mean 'sketch.C.y'?"),
        (
            {"links.AD.points.D[1]": 1},
            "links.AD.points.D[1]: the mechanism has no number of that name; did you mean 'AD.D.y'",
        ),
        ({"BC.length": -1.0}, "BC.length: a length above zero"),
        ({"BC.length": "3 deg"}, "BC.length: '3 deg' is an angle"),
        ({"BC.length": "3"}, "BC.length: '3' has no unit"),
        ({"BC.length": None}, "BC.length: a number is wanted here"),
        ({"BC.length": float("nan")}, "BC.length: a finite number is wanted"),
        ({"BC.length": 5.0}, "BC.length: the triangle B-C-F does not close"),
        ({"A.position": 1e13}, "A.position: beyond 1e+12 rad rounding leaves less than three digits"),
        ([("BC.length", 1.0)], "values: give the numbers by name"),
        ({3: 1.0}, "3: the mechanism has no number of that name"),
    ],
)
def test_what_a_file_would_be_refused_for_is_refused(values, told):
    with pytest.raises(BadInput) as problem:
        planar.load("four-bar").with_values(values)
    assert str(problem.value).startswith(told)


def test_an_input_stands_as_far_as_in_a_file():
    mechanism, far = planar.load("four-bar"), 1.0 + 2e5 * np.pi
    by_name = mechanism.with_values({"A.position": far})
    value = to_dict(mechanism)
    value["inputs"][0]["position"] = f"{far!r} rad"
    assert by_name.inputs[0].position == planar.from_dict(value).inputs[0].position
    here, there = (
        planar.solve(each).point("C").velocity for each in (mechanism.with_values({"A.position": 1.0}), by_name)
    )
    assert there == pytest.approx(here, rel=1e-8)


def test_teeth_are_whole():
    with pytest.raises(BadInput, match=r"wheels\.teeth\.0: a whole number"):
        planar.load("geared-five-bar").with_values({"wheels.teeth.0": 20.5})


def test_a_link_and_a_pair_of_one_name():
    value = to_dict(planar.load("slider-crank"))
    value["links"]["stroke"] = {"points": {"line": [0.1, 0.2], "B": [0, 0]}}
    value["pairs"] = [each for each in value["pairs"] if "turning" in each]
    value["pairs"] += [{"turning": "B2", "links": ["rod", "stroke"], "points": ["B", "B"]}]
    value["pairs"] = [each for each in value["pairs"] if each["turning"] != "B"]
    value["pairs"] += [
        {
            "sliding": "stroke",
            "links": ["frame", "stroke"],
            "line": {"through": [0, 0], "angle": 0},
            "point": "B",
        }
    ]
    del value["links"]["piston"]
    value["sketch"] = {}
    mechanism = from_dict(value)
    names = planar.dimensions(mechanism)
    assert {"links.stroke.line.x", "pairs.stroke.line.x"} <= set(names)
    assert "stroke.line.x" not in names
    assert "links.stroke.line.x" in {each.name for each in link_lengths(mechanism, ["stroke"])}
    with pytest.raises(BadInput, match=r"write links\.stroke\.line\.x or pairs\.stroke\.line\.x"):
        find_dimension(file_dimensions(mechanism), "stroke.line.x")
    assert mechanism.with_values({"pairs.stroke.line.x": 0.25}) != mechanism


def test_a_sweep_varies_any_number_and_offers_the_name_that_is_meant():
    found = planar.sweep("four-bar", {"BC.E.angle": [0.1, 0.2]}, 4, ["E"], start=1.0, stop=1.2)
    one = planar.cycle(planar.load("four-bar").with_values({"BC.E.angle": 0.2}), 4, 1.0, 1.2)
    np.testing.assert_allclose(found.position["E"][1], one.point("E").position, atol=1e-12)
    with pytest.raises(BadInput, match=r"BC\.E\.angel: .*'BC\.E\.angle'"):
        planar.sweep("four-bar", {"BC.E.angel": [0.1, 0.2]}, steps=4)


def test_a_law_starts_where_its_input_does():
    for mechanism in MODELS.values():
        for given in mechanism.inputs:
            if given.law is not None:
                moved = mechanism.with_values({f"{given.pair}.position": given.position + 0.1})
                assert moved.inputs[mechanism.inputs.index(given)].position == given.position + 0.1


def test_the_schema_knows_every_list_of_the_names():
    assert {"links", "pairs", "inputs", "loads", "springs", "masses", "gravity", "sketch"} <= set(
        schema()["properties"]
    )
