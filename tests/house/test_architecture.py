"""The floors of the house: no import goes up or round, libraries stay in their rooms, pair types in their files."""

import ast
import gc
import re
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

import planar
from planar.model.pairs import pair_types

ROOT = Path(planar.__file__).parent
FLOORS = (
    {"foundation"},
    {"codegen"},
    {"model"},
    {"formats"},
    {"equations", "results", "document"},
    {"solving"},
    {"dynamics", "assemblies"},
    {"derivatives"},
    {"batch"},
    {"structures"},
    {"analysis", "bench"},
    {"synthesis"},
    {"manufacture"},
    {"drawing", "reports"},
    {"pages", "plot", "guide", "torch", "jax"},
    {"cli"},
    {"__main__"},
)
"""The rooms, ground floor first. `planar/__init__.py` names what is in them all, and loads none of it by itself."""
LIBRARIES = {
    "numpy": {
        "analysis",
        "assemblies",
        "batch",
        "bench",
        "codegen",
        "derivatives",
        "drawing",
        "dynamics",
        "equations",
        "foundation",
        "manufacture",
        "model",
        "pages",
        "reports",
        "results",
        "solving",
        "structures",
        "synthesis",
    },
    "casadi": {"assemblies", "batch", "derivatives", "dynamics", "equations", "pages", "synthesis"},
    "networkx": {"model", "structures"},
    "clarabel": {"dynamics"},
    "threadpoolctl": {"foundation"},
    "flint": {"assemblies"},
    "llvmlite": {"codegen"},
    "scipy": {"analysis", "dynamics", "equations", "model"},
    "pint": {"foundation"},
    "rich": {"cli", "reports"},
    "contourpy": {"drawing"},
    "matplotlib": {"drawing", "plot"},
    "ezdxf": {"drawing", "manufacture"},
    "fontTools": {"drawing"},
    "PIL": {"drawing"},
    "imageio_ffmpeg": {"drawing"},
    "click": {"cli"},
    "pyarrow": {"batch", "reports"},
    "zarr": {"batch", "structures"},
    "torch": {"torch"},
    "jax": {"jax"},
    "xarray": {"reports"},
    "xlsxwriter": {"reports"},
}
MOST_LINES, LONGEST_FUNCTION, MOST_PARAMETERS = 800, 60, 8
MOST_MODULES_TO_SOLVE, MOST_OTHERS_TO_SOLVE = 125, 40
"""Modules of planar, and others beside the libraries that are needed, which `planar solve` loads."""
BESIDE_OTHER_JOINTS = {ROOT / "formats" / "drawn" / f"drawn_{what}.py" for what in ("document", "mechanism")}
FILES = sorted(ROOT.rglob("*.py"))
NAMES = {".".join(path.relative_to(ROOT.parent).with_suffix("").parts): path for path in FILES}


@pytest.fixture(scope="module", autouse=True)
def without_garbage_collection():
    """Syntax trees are no garbage, and to look through them takes four times as long as to read the files."""
    gc.disable()
    yield
    gc.enable()


def room(path: Path) -> str:
    """The folder under `planar` that a file is in, or its own name."""
    return path.relative_to(ROOT).with_suffix("").parts[0]


@cache
def parse(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text())


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """What a file imports, names, calls, says as text and defines; it is walked through once."""
    kinds = (ast.Import, ast.ImportFrom, ast.Constant, ast.Name, ast.Call, ast.FunctionDef, ast.AsyncFunctionDef)
    return tuple(node for node in ast.walk(parse(path)) if isinstance(node, kinds))


@cache
def imports(path: Path) -> set[str]:
    """Every module that a file imports, lazily, or by a text with its name: files of planar, or other packages."""
    modules = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            modules |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            modules |= {node.value} & NAMES.keys()
    return {module_of(name) for name in modules}


def module_of(name: str) -> str:
    """The file that an imported name is from, as a module, if it is one of planar's."""
    for known in (name, f"{name}.__init__", (head := name.rpartition(".")[0]), f"{head}.__init__"):
        if known in NAMES:
            return known
    return name


@cache
def arrows() -> tuple[tuple[str, str], ...]:
    """Who imports whom within planar, as modules; the list of public names in `planar/__init__.py` left out."""
    top = f"{planar.__name__}.__init__"
    whole = [(name, module) for name, path in NAMES.items() if name != top for module in imports(path)]
    return tuple((name, module) for name, module in whole if module in NAMES and module not in (name, top))


def circles(pairs: Iterable[tuple[str, str]]) -> list[list[str]]:
    graph = nx.DiGraph((one, other) for one, other in pairs if one != other)
    return [sorted(part) for part in nx.strongly_connected_components(graph) if len(part) > 1]


def test_no_import_goes_up_or_along():
    floor = {name: level for level, rooms in enumerate(FLOORS) for name in rooms}
    up = [
        f"{one} imports {other}"
        for one, other in arrows()
        if room(NAMES[one]) != room(NAMES[other]) and floor[room(NAMES[other])] >= floor[room(NAMES[one])]
    ]
    assert up == []
    assert set(floor) == {room(path) for path in FILES} - {"__init__"}


def test_files_import_one_another_in_no_circle():
    assert circles(arrows()) == []


@pytest.mark.parametrize("name", sorted({room(path) for path in FILES if path.parent != ROOT}))
def test_inside_a_room_no_arrow_goes_up(name):
    """A folder inside a room is one thing there, like a file beside it: they, too, stand one above the other."""

    def part(module: str) -> str:
        return NAMES[module].relative_to(ROOT / name).with_suffix("").parts[0]

    within = [(one, other) for one, other in arrows() if room(NAMES[one]) == room(NAMES[other]) == name]
    assert circles((part(one), part(other)) for one, other in within) == []


def test_libraries_stay_in_their_rooms():
    for path in FILES:
        for module in imports(path):
            library = module.split(".")[0]
            if library != "planar" and library not in sys.stdlib_module_names:
                assert room(path) in LIBRARIES[library], f"{room(path)} imports {library}"


def test_no_pair_type_is_named_outside_the_pairs():
    """But for the two files where they meet the joints of other programs, and for those programs' own words."""
    names, keywords = {kind.__name__ for kind in pair_types().values()}, set(pair_types())
    for path in FILES:
        if path.parent == ROOT / "model" / "pairs" or path in BESIDE_OTHER_JOINTS:
            continue
        said = {node.id for node in nodes(path) if isinstance(node, ast.Name)}
        texts = {node.value for node in nodes(path) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        assert not said & names
        assert not texts & keywords or room(path) == "formats"


def test_only_two_files_open_files():
    """One reads what is given, the other writes what is to be kept."""
    opening = {"open", "read_text", "read_bytes", "write_text", "write_bytes"}
    for path in FILES:
        called = {
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            for node in nodes(path)
            if isinstance(node, ast.Call)
        }
        if called & opening:
            assert path in (ROOT / "document" / "files.py", ROOT / "foundation" / "safe_files.py")


def test_files_are_small_and_say_their_job_first():
    for path in FILES:
        tree = parse(path)
        text = ast.get_docstring(tree)
        assert text
        assert len(text.splitlines()[0]) < 130
        assert len(path.read_text().splitlines()) <= MOST_LINES, path


def test_functions_are_short_and_take_few_arguments():
    """What is longer, or takes more, says why in a comment beside its first line: `# long: ...` or `# many: ...`."""
    for path in FILES:
        lines = path.read_text().splitlines()
        for node in nodes(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                said = " ".join(lines[node.lineno - 2 : node.body[0].lineno])
                given = node.args
                many = len([*given.posonlyargs, *given.args, *given.kwonlyargs]) - (
                    bool(given.args) and given.args[0].arg in ("self", "cls")
                )
                assert node.end_lineno - node.lineno < LONGEST_FUNCTION or "# long: " in said, f"{path}:{node.lineno}"
                assert many <= MOST_PARAMETERS or "# many: " in said, f"{path}:{node.lineno}"


def test_no_test_file_imports_another():
    """What several test files need stands beside the rooms: builders, closed forms, documents, figures ..."""
    own = Path(__file__).parent.parent
    tests = {".".join(path.relative_to(own.parent).with_suffix("").parts): path for path in own.rglob("test_*.py")}
    found = [
        f"{name} imports {module}"
        for name, path in tests.items()
        for line in re.findall(r"^[ \t]*from tests[^(\n]*(?:\([^)]*\))?", path.read_text(), re.MULTILINE)
        for node in ast.parse(line.lstrip()).body
        if isinstance(node, ast.ImportFrom)
        for module in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
        if module in tests
    ]
    assert found == []


def loaded_by(code: str) -> set[str]:
    run = [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"]
    return set(subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()[-1].split())


def test_solving_loads_neither_scipy_nor_networkx_nor_what_only_pictures_need():
    loaded = loaded_by("import planar; planar.solve(planar.load('000-P1'))")
    assert not loaded & {"casadi", "scipy", "networkx", "rich", "click", "pint", "matplotlib", "numpy.random"}


def test_the_command_that_solves_loads_few_modules(tmp_path, monkeypatch):
    """Each takes some half a millisecond; what a rare position or a structure that is solved often needs is loaded
    there."""
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path))
    code = "from planar.cli import main; main(['solve', '000-P1'], standalone_mode=False)"
    loaded = loaded_by(code)
    assert not loaded & {"casadi", "scipy", "networkx", "llvmlite", "pint", "matplotlib", "numpy.random", "difflib"}
    rare = {"solving.continuation.path", "solving.diagnosis.refusals", "model.input_laws"}
    assert not loaded & {f"planar.{name}" for name in (*rare, "cli.commands.modes")}
    own, beside = ({name for name in loaded if name.startswith("planar.") == is_own} for is_own in (True, False))
    floor = loaded_by("import numpy, casadi, click, rich.console, rich.table")
    assert len(own) <= MOST_MODULES_TO_SOLVE
    assert len(beside - floor) <= MOST_OTHERS_TO_SOLVE


def test_drawing_loads_only_what_it_draws_with():
    loaded = loaded_by("import planar; planar.plot.acceleration(planar.solve(planar.load('000-P1')))")
    assert "matplotlib.figure" in loaded
    assert not loaded & {"scipy", "networkx", "rich", "click", "matplotlib.pyplot", "matplotlib.backends.backend_pdf"}
    assert not loaded & {"planar.assemblies.circuits.circuits", "planar.assemblies.modes", "planar.dynamics.forces"}


def test_importing_planar_loads_no_library_at_all():
    assert not loaded_by("import planar") & set(LIBRARIES)


def test_public_names_are_all_there():
    assert set(planar.__all__) == set(dir(planar))
    for name in planar.__all__:
        assert getattr(planar, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = planar.nothing
