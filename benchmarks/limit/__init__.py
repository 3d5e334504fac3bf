"""The limit: hand-written C, compiled where a C compiler is found.

The flags keep IEEE arithmetic; they only say that nobody asks for `errno` or for the flags of exceptions, without which
no loop with a root becomes vectors.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

Array = np.ndarray


class Tape(NamedTuple):
    """Linkages of dyads as data, joint after joint; see `tape` in limit.c.

    first (linkages + 1,): where the joints of each begin; kind (joints,), of (joints, 2): joints of the same linkage by
    number, size (joints, 3).
    """

    first: Array
    kind: Array
    of: Array
    size: Array


Rates = tuple[float, float] | None

SOURCE = Path(__file__).with_name("limit.c")
COMMON = ("-O3", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
FLAGS = (("-march=native", "-mprefer-vector-width=512"), ("-march=native",), ("-mcpu=native",), ())
"""What makes vectors as wide as they come, then what other compilers and processors take."""


MOST = 4096
"""Of the steps of one design; see limit.c."""
LANES = 16
"""Newton's iteration gives its designs in blocks of so many; see limit.c."""


class Limit:
    """The functions of limit.c on arrays. Dimensions (dimensions, designs), angles (steps,), rad and SI.

    Both methods give a call without arguments, with all prepared that does not change from call to call.
    """

    def __init__(self, library: ctypes.CDLL):
        self._library = library

    def sweep(
        self, name: str, d: Array, angles: Array, rates: Rates = None, start: Array | None = None, kept: bool = False
    ) -> Callable[[], Array]:
        """Rows (steps, 2 or 6, designs) of the point: x, y, then their rates where `rates` (velocity, acceleration).

        `start` are the unit vectors from which Newton's iteration sets out; its result is in blocks of designs,
        (blocks, steps, 2 or 6, LANES). Each call gives a new array, unless one is `kept` and given again.
        """
        many, steps, rows = d.shape[1], len(angles), 2 if rates is None else 6
        turned = np.column_stack([np.cos(angles), np.sin(angles)])
        shape = (steps, rows, many) if start is None else (many // LANES, steps, rows, LANES)
        if start is not None and many % LANES:
            shape = (many, steps, rows, 1)
            if many >= LANES:
                raise ValueError(f"designs by {LANES} are wanted, or fewer")
        function = self._function(name)
        before = (many, steps, _pointer(d), _pointer(turned), *(rates or (0.0, 0.0)), int(rates is not None))
        after = () if start is None else (_pointer(start),)
        same = np.empty(shape)

        def call() -> Array:
            out = same if kept else np.empty(shape)
            function(*before, _pointer(out), *after)
            return out

        # what is pointed to must outlive the pointers
        call.holds = (d, turned, start)  # type: ignore[attr-defined]
        return call

    def turn(self, name: str, d: Array, angles: Array, rates: Rates = None) -> Callable[[], Array]:
        """Rows (2 or 6, steps) of the point of one design, dimensions (dimensions,), in an array that is kept.

        The angles are evenly apart, at most MOST of them, and their cosines and sines are reckoned in every call.
        """
        out = np.empty((2 if rates is None else 6, len(angles)))
        even = _even(angles)
        return self._kept(
            name, (len(angles), _pointer(d), *even, *(rates or (0.0, 0.0)), int(rates is not None)), out, d
        )

    def row(self, cells: Array, angles: Array) -> Callable[[], Array]:
        """Rows (2, steps) of the last rocker's pin in a row of four-bars, cells (four-bars, 4) of a, b, c and g."""
        given = (len(cells), len(angles), _pointer(cells), *_even(angles))
        return self._kept("row", given, np.empty((2, len(angles))), cells)

    def tape(self, tape: Tape, turned: Array, rates: Rates = None) -> Callable[[], Array]:
        """Rows (joints, 2 or 6, steps) of all joints of all linkages, the crank turned on by angles (steps,)."""
        if len(turned) > MOST:
            raise ValueError(f"at most {MOST} angles are wanted")
        cs = np.column_stack([np.cos(turned), np.sin(turned)])
        function, long, pointer, number = self._library["tape"], ctypes.c_long, ctypes.c_void_p, ctypes.c_double
        function.restype, function.argtypes = (
            None,
            [long, long, *5 * [pointer], number, number, ctypes.c_int, pointer],
        )
        held = tuple(np.ascontiguousarray(part, dtype=np.int_) for part in (tape.first, tape.kind, tape.of))
        shape = (len(tape.kind), 2 if rates is None else 6, len(turned))
        counts = len(tape.first) - 1, len(turned)
        pointers = (*(each.ctypes.data for each in held), _pointer(tape.size), _pointer(cs))

        def call() -> Array:
            out = np.empty(shape)
            function(*counts, *pointers, *(rates or (0.0, 0.0)), rates is not None, _pointer(out))
            return out

        call.holds = (held, tape, cs)  # type: ignore[attr-defined]
        return call

    def _kept(self, name: str, given: tuple[float, ...], out: Array, holds: Array) -> Callable[[], Array]:
        function = self._function(name)
        given = (*given, _pointer(out))

        def call() -> Array:
            function(*given)
            return out

        call.holds = holds  # type: ignore[attr-defined]
        return call

    def _function(self, name: str) -> Callable[..., None]:
        function = self._library[name]
        function.restype = None
        long, pointer, number = ctypes.c_long, ctypes.c_void_p, ctypes.c_double
        rates = [number, number, ctypes.c_int, pointer]
        if name == "row":
            function.argtypes = [long, long, pointer, number, number, pointer]
        elif name.endswith("_turn"):
            function.argtypes = [long, pointer, number, number, *rates]
        else:
            function.argtypes = [long, long, pointer, pointer, *rates, *([pointer] if name == "stephenson" else [])]
        return function


def _even(angles: Array) -> tuple[float, float]:
    """The first of angles evenly apart, and how far apart they are."""
    if not 2 <= len(angles) <= MOST:
        raise ValueError(f"2 to {MOST} angles are wanted")
    return float(angles[0]), float((angles[-1] - angles[0]) / (len(angles) - 1))


def _pointer(array: Array) -> int:
    if not (array.flags.c_contiguous and array.dtype == float):
        raise ValueError("an array of doubles without gaps is wanted")
    return array.ctypes.data


@cache
def compiled() -> Limit | None:
    """The library, compiled in a folder that is gone again at once; None where there is no compiler."""
    compiler = _compiler()
    if compiler is None:
        return None
    with TemporaryDirectory() as folder:
        target = Path(folder) / "limit.so"
        for flags in FLAGS:
            command = [compiler, *COMMON, *flags, str(SOURCE), "-o", str(target), "-lm"]
            if subprocess.run(command, capture_output=True, check=False).returncode == 0:
                return Limit(ctypes.CDLL(str(target)))
    return None


def compiler_version() -> str:
    """The first line that the compiler says of itself."""
    compiler = _compiler()
    if compiler is None:
        return "no C compiler"
    told = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    return told.splitlines()[0] if told else compiler


def _compiler() -> str | None:
    return next(filter(None, map(shutil.which, (os.environ.get("CC", "cc"), "gcc", "clang"))), None)
