"""How the tests are run."""

import atexit
import gc
import os
import py_compile
import re
import signal
import sys
from collections import Counter
from contextlib import suppress
from importlib import import_module
from importlib.util import cache_from_source
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.draws import EXHAUSTIVE_OPTION, EXHAUSTIVE_VARIABLE, is_exhaustive, load_profile

for _limit in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_limit, "1")  # matrices are small, and on a busy machine threads wait for one another
if "PLANAR_CACHE" not in os.environ:
    # code is compiled once for all workers and processes of a run, and nothing is left with the user
    _code = TemporaryDirectory()
    atexit.register(_code.cleanup)
    os.environ["PLANAR_CACHE"] = _code.name
# workers and the processes that tests start read the modules that one of them has compiled, beside the sources
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

load_profile()

ROOT = Path(__file__).parents[1]


def pytest_addoption(parser):
    """The option for all cases of tests of which a plain run takes some."""
    parser.addoption(EXHAUSTIVE_OPTION, action="store_true", help="run every case, not only one of each kind")
    parser.addoption("--repeated", action="store_true", help="run the cases of tests/repeated_cases.json as well")


def pytest_collection_modifyitems(config, items):
    """Leave out the cases that repeat what others show, but those that are asked for by name."""
    asked = [argument for argument in config.args if "::" in argument]
    if is_exhaustive() or config.getoption("--repeated") or asked:
        return
    from tests.repeated_cases import without_repeated  # loads numpy, for which the limits above are set first

    kept = without_repeated([item.nodeid for item in items])
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in kept])
    items[:] = [item for item in items if item.nodeid in kept]


def pytest_configure(config):
    """Modules of tests choose their cases when they are imported, in every worker."""
    if config.getoption(EXHAUSTIVE_OPTION):
        os.environ[EXHAUSTIVE_VARIABLE] = "1"


MISSING_PROGRAM = re.compile(r"could not import '([\w.]+)'|needs ([\w.]+)")
"""How a test says which program or folder it is skipped for: by `pytest.importorskip`, or in its own words."""


def pytest_terminal_summary(terminalreporter):
    """Count the tests that are skipped for want of a program, by its name."""
    reasons = (str(report.longrepr[2]) for report in terminalreporter.stats.get("skipped", ()))
    missing = Counter(match[1] or match[2] for reason in reasons if (match := MISSING_PROGRAM.search(reason)))
    names = ", ".join(f"{name} {count}" for name, count in sorted(missing.items())) or "none"
    terminalreporter.write_line(f"tests skipped for want of a program: {sum(missing.values())} ({names})")


@pytest.fixture
def interruptions():
    """Ctrl-C interrupts, as in a program that a user starts: where tests run in the background it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def import_test_modules(number: int, count: int) -> None:
    """Import all modules of tests in one of so many workers that do so at once.

    Each compiles its share of the modules of planar, and begins at another module of tests, so that it reads most of
    what the others have compiled. In a fresh checkout the collection takes a third less than where each compiles all.
    """
    for path in sorted((ROOT / "planar").rglob("*.py"))[number::count]:
        if not Path(cache_from_source(str(path))).exists():
            py_compile.compile(str(path))
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in sorted(ROOT.glob("tests/*/test_*.py"))
    ]
    first = len(modules) * number // count
    for name in modules[first:] + modules[:first]:
        with suppress(Exception, pytest.skip.Exception):  # which the collection reports
            import_module(name)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session):
    """Tests are collected without looking for garbage, and what was made then is not looked through again."""
    gc.disable()
    worker = getattr(session.config, "workerinput", None)
    if worker and session.config.args == session.config.getini("testpaths"):
        import_test_modules(int(worker["workerid"].removeprefix("gw")), worker["workercount"])
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(10_000, 20, 20)
        gc.enable()
