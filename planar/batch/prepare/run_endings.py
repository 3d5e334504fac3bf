"""How a compiled run says that it ended."""

from planar.batch.general_path import OUTCOMES
from planar.foundation.errors import Outcome

ALL_SOLVED, UNSURE, CANNOT_BE_ASSEMBLED, DEAD_POINT, STOP = 0.0, 1.0, 2.0, 3.0, 4.0
"""At its end, nobody knows, at its start, at a dead point, or where a pair meets its stop."""
CLEARLY_OPEN = 1.0 + 1e-4
"""Of a block's coalescence: from there on it cannot be joined, whatever rounding does; a pair is beyond its stop."""
STATUS_OF_ENDING = {
    CANNOT_BE_ASSEMBLED: OUTCOMES.index(Outcome.CANNOT_BE_ASSEMBLED),
    DEAD_POINT: OUTCOMES.index(Outcome.DEAD_POINT),
    STOP: OUTCOMES.index(Outcome.STOP),
}
"""What stands in a status after a run has ended so."""
