"""The march in machine code: designs in the lanes of vectors, their functions printed as LLVM IR."""
