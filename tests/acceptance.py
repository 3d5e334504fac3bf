"""Runs whose positions are wrong."""


def spoil_runs(solver, monkeypatch, spoil):
    """Runs of a solver block after block, of which `spoil` changes the unknowns (samples, unknowns) after the first,
    given the inputs (samples, inputs), before they are judged."""
    functions, real = solver.acceptance, solver.acceptance.run

    def spoiled(start, given, scales):
        found = real(start, given, scales)[0].copy()
        spoil(found[1:], given.u[1:])
        return found, functions.judge(found, given, scales)

    monkeypatch.setattr(functions, "run", spoiled)
