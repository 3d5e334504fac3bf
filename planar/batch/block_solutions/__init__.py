"""All assemblies of larger blocks, of many designs at once: every complex solution followed from design to design."""
