"""LLVM IR compiled for this machine, once for each text; what is compiled is kept on disk for other processes."""

from __future__ import annotations

import ctypes
from functools import cache, lru_cache
from hashlib import sha256
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from planar.codegen import code_cache

SPEED, CODE, BRIEF = 1, 2, 0
"""How much the passes over the text, and the making of code, may take: more costs time and gives none back."""
LONG = 6_000
"""Lines of a text whose code is made in the brief way: up to there the other takes less than a second, but its time
grows faster than the text, and what is gained is at most the half of a run."""
TYPES = {"int": ctypes.c_int64, "float": ctypes.c_double, "array": ctypes.c_void_p}


@lru_cache(maxsize=64)
def compiled(text: str, name: str, *kinds: str) -> Any:
    """The function of that name in a text, which takes arguments of these kinds ("int", "float", "array")."""
    engine = _engine(text)
    function = ctypes.CFUNCTYPE(None, *(TYPES[kind] for kind in kinds))(engine.get_function_address(name))
    function.engine = engine  # what was compiled lives as long as the function
    return function


def _engine(text: str) -> Any:
    """The text's machine code, from the disk or new."""
    key = fingerprint(text)
    code = code_cache.read(key)
    if code is None:
        code = _made(text)
        code_cache.write(key, code)
    return _loaded(code)


def fingerprint(text: str) -> str:
    """Of a text and all that its code depends on: the processor, the compiler, and how it is told to compile."""
    cpu, features = _processor()
    llvm_is = ".".join(map(str, llvm.llvm_version_info))
    said = (llvmlite.__version__, llvm_is, llvm.get_process_triple(), cpu, features, f"{SPEED} {_code(text)}", text)
    return sha256("\0".join(said).encode()).hexdigest()


@cache
def _processor() -> tuple[str, str]:
    """This processor's name and features, as LLVM has them."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _code(text: str) -> int:
    """How much the making of a text's code may take."""
    return CODE if text.count("\n") <= LONG else BRIEF


def _machine(code: int) -> Any:
    """What to compile for; one for every engine, which owns it."""
    cpu, features = _processor()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=code, jit=True)


def _made(text: str) -> bytes:
    """The text compiled, as an object file's content."""
    machine, module = _machine(_code(text)), llvm.parse_assembly(text)
    tuning = llvm.create_pipeline_tuning_options(speed_level=SPEED)
    tuning.slp_vectorization = tuning.loop_vectorization = False
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def _loaded(code: bytes) -> Any:
    """Machine code ready to run; LLVM does not look whether it is any."""
    held = llvm.ObjectFileRef.from_data(code)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine(CODE))
    engine.add_object_file(held)
    engine.finalize_object()
    return engine
