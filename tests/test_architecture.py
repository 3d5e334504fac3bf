"""The floors of the house: no import goes up, libraries stay in their rooms, no pair type is named outside its file."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

import planar
from planar.pairs import pair_types

ROOT = Path(planar.__file__).parent
FLOORS = [
    {"errors", "algebra", "roots", "shown"},
    {"plane", "units"},
    {"laws"},
    {"shapes"},
    {"applied", "pairs"},
    {"mechanism"},
    {"dimensions", "document", "elimination", "graph", "groups", "pins", "words"},
    {"called", "equations", "files", "results"},
    {"closed"},
    {"program", "motion"},
    {"judged", "minors", "native", "rounding"},
    {"solving", "spent"},
    {"dynamics"},
    {"analysis", "assemblies", "sweeping"},
    {"branches", "grouped", "speed"},
    {"views", "drawing"},
    {"pages", "plot"},
    {"cli", "__init__"},
    {"__main__"},
]
LIBRARIES = {
    "numpy": {
        "algebra",
        "called",
        "closed",
        "judged",
        "rounding",
        "laws",
        "minors",
        "equations",
        "program",
        "motion",
        "results",
        "native",
        "solving",
        "dynamics",
        "analysis",
        "assemblies",
        "branches",
        "sweeping",
        "grouped",
        "pins",
        "speed",
        "views",
        "drawing",
        "words",
        "pages",
    },
    "casadi": {
        "closed",
        "dynamics",
        "pages",
        "elimination",
        "groups",
        "equations",
        "judged",
        "minors",
        "rounding",
        "assemblies",
        "program",
        "native",
        "grouped",
    },
    "networkx": {"graph"},
    "flint": {"assemblies"},
    "llvmlite": {"native"},
    "scipy": {"dynamics", "laws"},
    "pint": {"units"},
    "rich": {"views", "cli"},
    "matplotlib": {"drawing", "plot"},
    "fontTools": {"drawing"},
    "PIL": {"drawing"},
    "imageio_ffmpeg": {"drawing"},
    "click": {"cli"},
    "pyarrow": {"views", "sweeping"},
    "zarr": {"sweeping"},
    "xarray": {"views"},
}
FILES = sorted(ROOT.rglob("*.py"))


def room(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[0]


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def imports(path: Path) -> list[tuple[str, ...]]:
    """Every module that a file imports, lazily or not."""
    found = []
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            found += [tuple(alias.name.split(".")) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            base = tuple((node.module or "").split("."))
            whole = [(*base, alias.name) for alias in node.names]
            found += [name if (ROOT.parent.joinpath(*name).with_suffix(".py")).exists() else base for name in whole]
    return found


def level(name: str) -> int:
    return next(index for index, rooms in enumerate(FLOORS) if name in rooms)


def test_no_import_goes_up_or_along():
    for path in FILES:
        here = room(path)
        for module in imports(path):
            if module[0] == "planar" and len(module) > 1 and module[1] != here:
                assert level(module[1]) < level(here), f"{path}: {here} imports {'.'.join(module)}"


def test_there_are_no_circles_inside_a_room():
    graph = nx.DiGraph()
    for path in FILES:
        name = (planar.__name__, *path.relative_to(ROOT).with_suffix("").parts)
        graph.add_edges_from((name, module) for module in imports(path) if module[0] == "planar" and module != name)
    assert [sorted(part) for part in nx.strongly_connected_components(graph) if len(part) > 1] == []


def test_libraries_stay_in_their_rooms():
    for path in FILES:
        for module in imports(path):
            if module[0] != "planar" and module[0] not in sys.stdlib_module_names:
                assert room(path) in LIBRARIES[module[0]], f"{path}: {room(path)} imports {module[0]}"


def test_no_pair_type_is_named_outside_the_pairs():
    names = {kind.__name__ for kind in pair_types().values()}
    for path in FILES:
        if room(path) == "pairs":
            continue
        tree = parsed(path)
        said = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        texts = {
            node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
        assert not said & names, path
        assert not texts & set(pair_types()), path


def test_only_the_files_room_opens_mechanism_files():
    opening = {"open", "read_text", "read_bytes", "write_text", "write_bytes"}
    for path in FILES:
        called = {
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            for node in ast.walk(parsed(path))
            if isinstance(node, ast.Call)
        }
        if called & opening:
            assert room(path) == "files", path


def test_files_are_small_and_say_their_job_first():
    for path in FILES:
        tree = parsed(path)
        text = ast.get_docstring(tree)
        assert text, path
        assert len(text.splitlines()[0]) < 130, path
        assert len(path.read_text().splitlines()) <= 420, path


def loaded_by(code: str) -> set[str]:
    run = [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"]
    return set(subprocess.run(run, check=True, capture_output=True, text=True).stdout.split())


def test_solving_loads_neither_scipy_nor_networkx_nor_what_only_pictures_need():
    loaded = loaded_by("import planar; planar.solve(planar.load('000-P1'))")
    assert not loaded & {"scipy", "networkx", "rich", "click", "pint", "matplotlib"}
    assert "casadi" in loaded


def test_drawing_loads_only_what_it_draws_with():
    loaded = loaded_by("import planar; planar.plot.acceleration(planar.solve(planar.load('000-P1')))")
    assert "matplotlib.figure" in loaded
    assert not loaded & {"scipy", "networkx", "rich", "click", "matplotlib.pyplot", "matplotlib.backends.backend_pdf"}
    assert not loaded & {"planar.branches.circuits", "planar.assemblies.modes", "planar.dynamics.forces"}


def test_importing_planar_loads_no_library_at_all():
    assert not loaded_by("import planar") & set(LIBRARIES)


def test_public_names_are_all_there():
    assert set(planar.__all__) == set(dir(planar))
    for name in planar.__all__:
        assert getattr(planar, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = planar.nothing
