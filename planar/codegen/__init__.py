"""What is written of instruction lists: Python, LLVM IR and its machine code."""
