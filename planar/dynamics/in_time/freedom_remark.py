"""What is said of a simulation in which nothing moves freely."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planar.model.mechanism import Mechanism
from planar.model.wording import quote_names
from planar.solving.position import solved_mechanism


def freedom_remarks(mechanism: Mechanism, driven: Sequence[str]) -> Iterator[str]:
    """That nothing moves freely, by what it is held or driven, and what to leave out."""
    if not driven:
        problem = solved_mechanism(mechanism).motion_refusal()
        yield problem.reason if problem is not None else "nothing can move: the pairs hold every link"
        return
    by_law = [given.pair for given in mechanism.inputs if given.law is not None]
    options = [f"--drive {name}" for name in driven if name not in by_law]
    ways = [f"leave out {' or '.join(options)}"] if options else []
    ways += [f"take the law of {quote_names(by_law)} out of the file"] if by_law else []
    yield (
        f"nothing moves freely: the driven inputs at {quote_names(driven)} determine the whole motion, and "
        f"loads, weights and springs only what these supply; to let it go {', or '.join(ways)}"
    )
