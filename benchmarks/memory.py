"""Memory that is freed stays with the process, so that big results are timed without the system's giving of pages.

Fresh pages cost up to a hundred nanoseconds a position on a busy machine, whoever solves it, and hide the solving.
"""

from __future__ import annotations

import ctypes

TRIM, MAPPED = -1, -4
"""M_TRIM_THRESHOLD and M_MMAP_MAX of the GNU C library's mallopt."""


def hold() -> bool:
    """Whether the C library could be told; only the GNU one can."""
    try:
        tell = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return bool(tell(TRIM, 2**31 - 1) and tell(MAPPED, 0))
