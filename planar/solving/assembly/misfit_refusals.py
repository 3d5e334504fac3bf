"""The sentences in which a position of least misfit is refused."""

from __future__ import annotations

from planar.foundation.errors import NoAnswer, Outcome
from planar.model.wording import amount
from planar.solving.prepared_mechanism import PreparedMechanism


def not_least_misfit(pair: str, at: str) -> NoAnswer:
    """A position in which misfits balance, but from which they push the links away."""
    return NoAnswer(
        Outcome.CHANGE_POINT,
        f"{at} the misfits, as that of pair {pair!r}, balance but are not the least: the links give way to one side or "
        "the other, as beside a change point; move the input, or give lengths that agree",
    )


def misfit_beyond(setup: PreparedMechanism, pair: str, misfit: float, at: str) -> NoAnswer:
    """A position of least misfit with more of it than the file lets pass."""
    within = setup.mechanism.closes_within or 0.0
    units = setup.mechanism.units
    return NoAnswer(
        Outcome.CANNOT_BE_ASSEMBLED,
        f"{at} the least misfit leaves pair {pair!r} open by {amount(misfit, 'length', units)}, beyond the "
        f"{amount(within, 'length', units)} of `closes_within`; change a length, or let it be more",
    )
