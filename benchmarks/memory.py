"""Memory that is freed stays with the process, so that big results are timed without the system's giving of pages.

Fresh pages cost up to a hundred nanoseconds a position on a busy machine, whoever solves it, and hide the solving.
"""

from __future__ import annotations

import ctypes

TRIM, MAPPED, ARENAS = -1, -4, -8
"""M_TRIM_THRESHOLD, M_MMAP_MAX and M_ARENA_MAX of the GNU C library's mallopt; threads share one arena."""


def hold() -> bool:
    """Whether the C library could be told; only the GNU one can."""
    try:
        tell = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return bool(tell(TRIM, 2**31 - 1) and tell(MAPPED, 0) and tell(ARENAS, 1))
