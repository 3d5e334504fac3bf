"""Machine code kept on disk by its fingerprint, so that other processes need not compile it again."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import cache, lru_cache
from hashlib import sha256
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numpy as np
from numpy.typing import DTypeLike

from planar.foundation.arrays import Array
from planar.foundation.private_cache import PrivateCache

MACHINE_CODE = PrivateCache("code", ".code", b"planar machine code\n", 256 * 2**20)


WIDEST_VECTOR_BYTES = 64
"""Bytes of the widest vectors of a machine."""


def allocate_aligned(steps: int, rows: int, designs: int, dtype: DTypeLike = np.float64) -> Array:
    """An array (steps, rows, designs), not filled, every row of which begins at a whole vector."""
    lanes = WIDEST_VECTOR_BYTES // np.dtype(dtype).itemsize
    width = -(-designs // lanes) * lanes
    made = np.empty(steps * rows * width + lanes, dtype)
    first = -(made.ctypes.data // made.itemsize) % lanes
    return made[first : first + steps * rows * width].reshape(steps, rows, width)[:, :, :designs]


def is_aligned(array: Array) -> bool:
    """Whether every row of an array begins so."""
    return not any(place % WIDEST_VECTOR_BYTES for place in (array.ctypes.data, *array.strides[:2]))


PASS_LEVEL, CODEGEN_LEVEL, FAST_CODEGEN_LEVEL = 1, 2, 0
"""How much the passes over the text, and the making of code, may take: more costs time and gives none back."""
LONG_TEXT_LINES = 6_000
"""Lines of a text whose code is made in the brief way: up to there the other takes less than a second, but its time
grows faster than the text, and what is gained is at most the half of a run."""
C_TYPES: Mapping[str, type[ctypes.c_int64 | ctypes.c_double | ctypes.c_void_p]] = {
    "int": ctypes.c_int64,
    "float": ctypes.c_double,
    "array": ctypes.c_void_p,
}


@lru_cache(maxsize=64)
def compile_function(text: str, name: str, *kinds: str) -> Any:
    """The function of that name in a text, which takes arguments of these kinds ("int", "float", "array")."""
    key = fingerprint(text)
    code = MACHINE_CODE.read(key)  # from the disk, or new
    if code is None:
        code = _compile_object(text)
        MACHINE_CODE.write(key, code)
    engine = _load_object(code)
    function: Any = ctypes.CFUNCTYPE(None, *(C_TYPES[kind] for kind in kinds))(engine.get_function_address(name))
    function.engine = engine  # what was compiled lives as long as the function
    return function


def fingerprint(text: str) -> str:
    """Of a text and all that its code depends on: the processor, the compiler, and how it is told to compile."""
    cpu, features = _processor()
    llvm_is = ".".join(map(str, llvm.llvm_version_info))
    said = (
        llvmlite.__version__,
        llvm_is,
        llvm.get_process_triple(),
        cpu,
        features,
        f"{PASS_LEVEL} {_codegen_level(text)}",
        text,
    )
    return sha256("\0".join(said).encode()).hexdigest()


@cache
def _processor() -> tuple[str, str]:
    """This processor's name and features, as LLVM has them."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _codegen_level(text: str) -> int:
    """How much the making of a text's code may take."""
    return CODEGEN_LEVEL if text.count("\n") <= LONG_TEXT_LINES else FAST_CODEGEN_LEVEL


def _target_machine(code: int) -> Any:
    """What to compile for; one for every engine, which owns it."""
    cpu, features = _processor()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=code, jit=True)


def _compile_object(text: str) -> bytes:
    """The text compiled, as an object file's content."""
    machine, module = _target_machine(_codegen_level(text)), llvm.parse_assembly(text)
    tuning = llvm.create_pipeline_tuning_options(speed_level=PASS_LEVEL)
    tuning.slp_vectorization = tuning.loop_vectorization = False
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def _load_object(code: bytes) -> Any:
    """Machine code ready to run; LLVM does not look whether it is any."""
    object_file = llvm.ObjectFileRef.from_data(code)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine(CODEGEN_LEVEL))
    engine.add_object_file(object_file)
    engine.finalize_object()
    return engine
