"""Runs whose positions are wrong."""

import numpy as np


def spoil_runs(solver, monkeypatch, spoil):
    """Runs of a solver block after block, of which `spoil` changes the unknowns (samples, unknowns) but the given ones,
    given the inputs (samples, inputs), before they are judged."""
    functions, real = solver.acceptance, solver.acceptance.run

    def spoiled(start, given, scales, at=0):
        found = real(start, given, scales, at)[0].copy()
        others = np.arange(len(found)) != at
        changed = found[others]
        spoil(changed, given.u[others])
        found[others] = changed
        return found, functions.judge(found, given, scales)

    monkeypatch.setattr(functions, "run", spoiled)
