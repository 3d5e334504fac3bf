"""The units that a file declares: what its bare numbers mean, what is refused, and that it is written as it was."""

from __future__ import annotations

from typing import Any

import jsonschema
import pytest

import planar
from planar.document.dimensions import file_dimensions
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_quantity
from tests.known import MODELS

POUND_FORCE = 4.4482216152605


def document(units: dict[str, str], **more: Any) -> dict[str, Any]:
    """A slider-crank in inches, with a spring and a damper, weights and loads, all in bare numbers."""
    return {
        "planar": 1,
        "units": {"length": "in", "angle": "deg"} | units,
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "Q": [20, 0]}},
            "crank": {"ends": ["O", "A"], "length": 2},
            "rod": {"ends": ["A", "B"], "length": 8},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "A"},
            {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O"}},
        ],
        "inputs": [{"pair": "O", "position": 60}],
        "sketch": {"B": [9, 0]},
    } | more


EVERYTHING = {
    "velocity": "in/s",
    "acceleration": "in/s^2",
    "angular_velocity": "rpm",
    "angular_acceleration": "rad/s^2",
    "force": "lbf",
    "torque": "lbf*in",
    "mass": "lb",
    "moment_of_inertia": "lb*in^2",
    "stiffness": "lbf/in",
    "damping": "lbf*s/in",
    "torsional_stiffness": "lbf*in/rad",
    "torsional_damping": "lbf*in*s/rad",
    "stress": "ksi",
    "power": "hp",
    "energy": "ft*lbf",
}
BARE: dict[str, Any] = {
    "inputs": [{"pair": "O", "position": 60, "velocity": 1200, "acceleration": 3}],
    "loads": [{"point": "B", "force": [-100, 0]}, {"link": "rod", "torque": 12}],
    "springs": [
        {"points": ["B", "Q"], "stiffness": 5, "free_length": 12, "damping": 0.5},
        {"links": ["frame", "rod"], "stiffness": 7, "damping": 0.25},
    ],
    "masses": [{"link": "rod", "mass": 2, "at": [4, 0], "inertia": 9}],
    "gravity": [0, -386],
}


def test_bare_numbers_are_in_the_declared_units() -> None:
    found = planar.from_dict(document(EVERYTHING, **BARE))
    said = planar.dimensions(found)
    for name, quantity in {
        "O.velocity": "1200 rpm",
        "O.acceleration": "3 rad/s^2",
        "loads.0.force.x": "-100 lbf",
        "loads.1.torque": "12 lbf in",
        "springs.0.stiffness": "5 lbf/in",
        "springs.0.damping": "0.5 lbf s/in",
        "springs.1.stiffness": "7 lbf in/rad",
        "springs.1.damping": "0.25 lbf in s/rad",
        "masses.rod.mass": "2 lb",
        "masses.rod.inertia": "9 lb in^2",
        "gravity.y": "-386 in/s^2",
    }.items():
        kind = file_dimensions(found)[name].kind
        assert said[name] == pytest.approx(parse_quantity(quantity, kind), rel=1e-15), name


def test_what_a_file_declares_is_written_as_it_was_and_reads_back_to_the_last_bit() -> None:
    mechanism = planar.from_dict(document(EVERYTHING, **BARE))
    value = planar.to_dict(mechanism)
    assert value["units"] == {"length": "in", "angle": "deg"} | EVERYTHING
    assert value["loads"][0]["force"] == [-100, 0]
    assert value["gravity"] == [0, -386]
    assert planar.from_dict(value) == mechanism
    jsonschema.validate(value, planar.schema())
    for name in ("pump-jack", "engine-in-inches"):
        assert planar.from_dict(planar.to_dict(MODELS[name])) == MODELS[name]


def test_without_more_than_inches_bare_numbers_are_si_as_ever() -> None:
    mechanism = planar.from_dict(document({}, loads=[{"point": "B", "force": [-100, 0]}], gravity=[0, -9.81]))
    assert mechanism.loads[0].force == (-100.0, 0.0)
    assert mechanism.gravity == (0.0, -9.81)
    assert planar.inspect(mechanism).actions[0].amount == f"{100 / POUND_FORCE:.6g} lbf at 180 deg"


@pytest.mark.parametrize(
    ("units", "more", "place", "sentence"),
    [
        ({"force": "lb"}, {}, "$.units.force", "'lb' is not a unit of force, such as 'N'; it measures mass"),
        ({"velocity": "lbf"}, {}, "$.units.velocity", "'lbf' is not a unit of velocity, such as 'm/s'"),
        ({"torque": "bananas"}, {}, "$.units.torque", "'bananas' is not a unit of torque, such as 'N m'"),
        ({"energy": "hp"}, {}, "$.units.energy", "'hp' is not a unit of energy, such as 'J'; it measures power"),
        ({"masses": "lb"}, {}, "$.units.masses", "unknown key 'masses'; did you mean 'mass'?"),
        (
            {"force": "lbf"},
            {"springs": [{"points": ["B", "Q"], "stiffness": 5}]},
            "$.springs[0].stiffness",
            "a bare stiffness 5 is unclear, as 'units' declares others but none of stiffness; write its unit, "
            "as '5 lbf/in', or declare it",
        ),
        (
            {"mass": "lb"},
            {"gravity": [0, -386]},
            "$.gravity[1]",
            "a bare acceleration -386 is unclear, as 'units' declares others but none of acceleration; write its unit, "
            "as '-386 in/s^2', or declare it",
        ),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(
    units: dict[str, str], more: dict[str, Any], place: str, sentence: str
) -> None:
    with pytest.raises(BadInput) as caught:
        planar.from_dict(document(units, **more))
    assert caught.value.place == place
    assert sentence in caught.value.sentence


def test_a_metric_file_may_declare_units_and_bare_numbers_of_the_rest_stay_si() -> None:
    units = {"length": "mm", "force": "kN", "velocity": "mm/s"}
    loads = [{"point": "B", "force": [-2, 0]}, {"link": "rod", "torque": "5000 N m"}]
    masses = [{"link": "rod", "mass": 3, "at": "B"}]
    found = planar.from_dict(document(units, loads=loads, masses=masses))
    assert found.loads[0].force == (-2000.0, 0.0)
    assert [each.amount for each in planar.inspect(found).actions] == ["2 kN at 180 deg", "5 kN·m", "3 kg"]
