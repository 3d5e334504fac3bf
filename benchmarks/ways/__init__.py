"""The ways to solve a linkage over one turn of its crank that are timed side by side."""

from benchmarks.linkages import Linkage
from benchmarks.ways import by_planar, closed_form, fsolve
from benchmarks.ways.trial import Trial

__all__ = ["Trial", "trials"]


def trials(linkage: Linkage) -> tuple[Trial, ...]:
    """Every way to solve a linkage, the closed form first."""
    return (*closed_form.trials(linkage), *by_planar.trials(linkage), *fsolve.trials(linkage))
