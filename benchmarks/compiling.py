"""How long machine code takes to be there: printed, compiled, and read from the disk by another process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from benchmarks import chain
from benchmarks.processes import ROOT
from benchmarks.swept import Stephenson, SweptFourBar, Watt

RUNS = 2
"""How often the two processes are run."""


@dataclass(frozen=True)
class Compiling:
    """Seconds, with velocities and accelerations: printing a structure as LLVM IR and compiling that, in a process that
    has its equations; and in another one, reading the code that the first has kept."""

    structure: str
    printing: float
    compiling: float
    reading: float


STRUCTURES: dict[str, Callable[[], tuple[dict[str, Any], str]]] = {
    "four-bar": lambda: (SweptFourBar().document(), SweptFourBar.point),
    "six-bar of two dyads": lambda: (Watt().document(), Watt.point),
    "six-bar without a dyad": lambda: (Stephenson().document(), Stephenson.point),
    "row of 42 links": lambda: (chain.document(42), "C20"),
}


def compilings() -> tuple[Compiling, ...]:
    """Every structure, in processes of its own."""
    return tuple(_measure_structure(structure) for structure in STRUCTURES)


def _measure_structure(structure: str) -> Compiling:
    found = []
    for _ in range(RUNS):
        with TemporaryDirectory() as folder:
            first, second = (_process(structure, folder) for _ in range(2))
        if "compiling" in second:
            raise RuntimeError(f"the code of a {structure} was not found again")
        found.append((first["printing"], first["compiling"], second["reading"]))
    return Compiling(structure, *map(min, zip(*found, strict=True)))


def _process(structure: str, folder: str) -> dict[str, float]:
    command = [sys.executable, "-m", "benchmarks.compiling", structure]
    place = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    environment = os.environ | {"PLANAR_CACHE": folder, "PYTHONPATH": place}
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    return json.loads(ended.stdout)


def spent(structure: str) -> dict[str, float]:
    """Seconds of each step in this process, which has the structure's equations."""
    import planar
    from planar.batch.march.designs_writer import MARCH_ARGUMENTS, MARCH_FUNCTION
    from planar.batch.march.kernel import kernel_equations
    from planar.batch.march.runs import LANES, KernelRequest, designs_kernel
    from planar.codegen import llvm_compile
    from planar.equations.functions import equation_functions
    from planar.equations.mechanism_numbers import equation_structure as of
    from planar.model.mechanism import named_points

    document, point = STRUCTURES[structure]()
    mechanism = planar.from_dict(document)
    links = next(tuple(link for link, _ in each.members) for each in named_points(mechanism) if each.name == point)[:1]
    known = equation_functions(mechanism)
    llvm_compile._processor()
    told: dict[str, float] = {}
    making = llvm_compile._compile_object

    def made(text: str) -> bytes:
        start = perf_counter()
        found = making(text)
        told["compiling"] = perf_counter() - start
        return found

    llvm_compile._compile_object = made
    start = perf_counter()
    text = designs_kernel(KernelRequest(kernel_equations(known, of(mechanism)), links, True, LANES)).ir
    told["printing"] = perf_counter() - start
    start = perf_counter()
    llvm_compile.compile_function(text, MARCH_FUNCTION, *MARCH_ARGUMENTS)
    told["reading"] = perf_counter() - start - told.get("compiling", 0.0)
    return told


if __name__ == "__main__":
    print(json.dumps(spent(sys.argv[1])))
