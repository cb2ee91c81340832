"""Let large blocks of memory go back to the system when they are freed.

glibc takes the first large blocks from the system one by one, and learns from each that is freed to
take such from the heap. There images lie between small things that stay, leave holes, and the
process creeps up for hours. Whoever sets the bound fixes it (mallopt(3), M_MMAP_THRESHOLD).
"""

import ctypes
from typing import Final

LARGE_BYTES: Final = 128 * 1024
"""glibc's own value to begin with: a depth image is larger, a packet is not."""
_M_TRIM_THRESHOLD: Final = -1
_M_MMAP_THRESHOLD: Final = -3


def give_large_blocks_back() -> bool:
    """Fix the bounds for this process; return whether its C library has them."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return all(mallopt(bound, LARGE_BYTES) for bound in (_M_MMAP_THRESHOLD, _M_TRIM_THRESHOLD))
