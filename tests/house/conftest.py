"""That a command, a snippet or an example runs does not hang on how much it searches, which other tests look at."""

from importlib import import_module

import pytest

from tests.draws import SEARCH
from tests.small_searches import SHORT_FITS, SMALL_SEARCHES

FAMILY_DESIGNS = 4
"""Designs that are listed of a family."""
COARSE_MAPS: dict[str, dict[str, object]] = {
    "planar.analysis.force_maps.force_map": {"USUAL_COUNTS": (7, 3, 3)},
    "planar.analysis.force_maps.worst_cases": {"REFINEMENTS": 2, "SEARCHED_LINES": 2, "MORE_BORDERS": 4},
}
"""Those of force maps."""
LESS: dict[str, dict[str, object]] = {
    **COARSE_MAPS,
    "planar.synthesis.exact.exact_synthesis": {"FAMILY_DESIGNS": FAMILY_DESIGNS},
    **SMALL_SEARCHES,
    **SHORT_FITS,
}
"""Numbers of modules, and what they are here."""
COARSE: dict[str, dict[str, object]] = {
    **COARSE_MAPS,
    "planar.drawing.output.animation": {"PIXELS_PER_MM": 1.0, "DPI": 25.0, "MIN_PATH_STEPS": 36},
    "planar.drawing.output.matplotlib_figure": {"RESOLUTION": 40},
    "planar.drawing.output.grid_sheets": {"RESOLUTION": 40},
    "planar.drawing.output.solution_pages": {"RESOLUTION": 40},
    "planar.drawing.diagrams.positions": {"MIN_PATH_STEPS": 72},
    "planar.drawing.diagrams.cognate_drawing": {"MIN_PATH_STEPS": 72},
    "planar.drawing.designs.design_picture": {"MIN_PATH_STEPS": 72},
}
"""The same of maps, and of pictures that nobody looks at."""


def set_numbers(patch: pytest.MonkeyPatch, modules: dict[str, dict[str, object]]) -> None:
    """Give modules other numbers, but for a search."""
    for module, numbers in () if SEARCH else modules.items():
        for name, value in numbers.items():
            patch.setattr(import_module(module), name, value)


@pytest.fixture(scope="module", autouse=True)
def small_searches():
    """Maps over a few positions, catalogues of a few designs; as they are where one searches."""
    with pytest.MonkeyPatch.context() as patch:
        set_numbers(patch, LESS)
        yield


@pytest.fixture
def coarse_pictures(monkeypatch):
    """Pictures of few dots and paths of few positions."""
    set_numbers(monkeypatch, COARSE)
