"""Machine code kept on disk by its fingerprint, so that other processes need not compile it again."""

from planar.foundation.private_cache import PrivateCache

MACHINE_CODE = PrivateCache("code", ".code", b"planar machine code\n", 256 * 2**20)
