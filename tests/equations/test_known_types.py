"""Elements and block types that are kept with the package: those of all models, equal to what is derived now."""

import casadi
import pytest

import planar
from planar.equations import block_type_functions, elements
from planar.equations.block_type_functions import BlockTypeFormulas, derive_block_type
from planar.equations.elements import Element
from planar.equations.functions import EquationFunctions
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import build_equations
from tests.builders import lift_document
from tests.draws import first_cases
from tests.known_types import known_lines
from tests.linkages import random_linkage


def test_the_file_is_what_is_derived_of_all_models():
    """`python -m tests.known_types` makes it."""
    assert known_lines() == elements.KNOWN_TYPES_FILE.read_text(encoding="utf-8")


def test_texts_give_back_what_they_were_made_of(monkeypatch):
    monkeypatch.setattr(elements, "known_text", lambda _: None)
    equations = build_equations(equation_structure(planar.from_dict(lift_document(1))))
    for placed in equations.elimination.elements:
        element = placed.element
        again = Element.from_text(element.fingerprint, element.as_text())
        assert again.as_text() == element.as_text()
        assert (again.factors, again.nonlinear, again.arguments) == (
            element.factors,
            element.nonlinear,
            element.arguments,
        )
    for placed in EquationFunctions(equations).placed_blocks:
        formulas = derive_block_type(placed.key)
        assert BlockTypeFormulas.from_text(formulas.as_text()) == formulas


def test_structures_of_known_types_are_solved_without_deriving_any(monkeypatch):
    def derive(key):
        raise AssertionError(key)

    monkeypatch.setattr(block_type_functions, "derive_block_type", derive)
    block_type_functions.block_type_functions.cache_clear()
    assert planar.solve(planar.from_dict(lift_document(3))).mobility == 1
    assert len(planar.cycle(planar.load("jansen-leg"), steps=12)) == 13


@pytest.mark.parametrize("seed", first_cases((392, 1340, 973, 901, 679, 337), 3))
def test_no_casadi_function_is_made_of_structures_of_known_types(seed, monkeypatch):
    """Random linkages that no model is like, but whose elements and block types are known."""

    def refuse(*_):
        raise AssertionError("a casadi function is made")

    monkeypatch.setattr(casadi, "Function", refuse)
    mechanism = planar.from_dict(random_linkage(seed, 2 + seed % 6, 0.0, 0.2).value)
    state, name = planar.solve(mechanism), mechanism.inputs[0].pair
    planar.inspect(mechanism)
    at = mechanism.inputs[0].position
    planar.cycle(mechanism, 12, *(() if name[0] == "T" else (at, at + 0.2)), pair=name)  # slides may have no limit
    planar.centres(state)
    for result in (state, planar.forces(state)):
        assert planar.sensitivity(result, name).slopes
