"""LLVM IR compiled for this machine, once for each text."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm


def _machine() -> Any:
    """What to compile for; one for every module, since what is compiled owns it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=2, jit=True
    )


@lru_cache(maxsize=64)
def compiled(text: str, name: str, *kinds: str) -> Any:
    """The function of that name in a text, which takes arguments of these kinds ("int", "float", "array")."""
    machine = _machine()
    module = llvm.parse_assembly(text)
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    tuning.slp_vectorization = tuning.loop_vectorization = False
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    of = {"int": ctypes.c_int64, "float": ctypes.c_double, "array": ctypes.c_void_p}
    function = ctypes.CFUNCTYPE(None, *(of[kind] for kind in kinds))(engine.get_function_address(name))
    function.engine = engine  # what was compiled lives as long as the function
    return function
