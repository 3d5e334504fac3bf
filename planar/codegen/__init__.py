"""Casadi functions as instruction lists, and what is written of them: LLVM IR and its machine code, JavaScript."""
