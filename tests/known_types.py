"""Makes the file of known elements and block types: of all models, and of the samples of every pair type."""

from planar.equations import elements
from planar.equations.block_motion import derive_block_motion
from planar.equations.block_type_functions import MAX_FORMULA_UNKNOWNS, derive_block_type, motion_fingerprint
from planar.equations.block_types import block_equations, place_blocks, place_input_coordinates
from planar.equations.elements import KNOWN_TYPES_FILE, derive_element
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import build_equations
from tests.known import MODELS


def known_texts() -> dict[str, str]:
    """The texts of all elements and block types of the models, derived anew, by their fingerprints."""
    texts: dict[str, str] = {}
    element_of_key = elements.element_of_key

    def recording(key):
        element = derive_element(key)
        texts[element.fingerprint] = element.as_text()
        return element_of_key(key)

    elements.element_of_key = recording
    try:
        for mechanism in MODELS.values():
            equations = build_equations(equation_structure(mechanism))
            for placed in (*place_blocks(equations), *place_input_coordinates(equations)):
                if placed is not None and motion_fingerprint(placed.key) not in texts:
                    key, block = placed.key, block_equations(placed.key)
                    if key.unknown_count:
                        texts[key.fingerprint] = derive_block_type(key).as_text()
                    if block.is_square and key.unknown_count <= MAX_FORMULA_UNKNOWNS:
                        texts[motion_fingerprint(key)] = derive_block_motion(block).as_text()
    finally:
        elements.element_of_key = element_of_key
    return texts


def known_lines() -> str:
    """The whole file."""
    return "".join(f"{key}\t{text}\n" for key, text in sorted(known_texts().items()))


if __name__ == "__main__":
    KNOWN_TYPES_FILE.write_text(known_lines(), encoding="utf-8")
