"""That a command, a snippet or an example runs does not hang on how much it searches, which other tests look at."""

from importlib import import_module

import pytest

from tests.draws import SEARCH
from tests.small_searches import SMALL_SEARCH

LESS = {
    "planar.analysis.force_maps.force_map": {"USUAL_COUNTS": (13, 5, 3)},
    "planar.synthesis.synthesise": SMALL_SEARCH,
}
"""Numbers of modules, and what they are here."""


@pytest.fixture(scope="module", autouse=True)
def small_searches():
    """Maps over a few positions, catalogues of a few designs; as they are where one searches."""
    with pytest.MonkeyPatch.context() as patch:
        for module, numbers in () if SEARCH else LESS.items():
            for name, value in numbers.items():
                patch.setattr(import_module(module), name, value)
        yield
