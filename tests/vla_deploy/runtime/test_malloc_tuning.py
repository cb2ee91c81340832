"""See where the C library puts images: the rule is a process's own, so each case is one."""

import subprocess
import sys
from typing import Final

import pytest

_PROBE: Final = """
import ctypes, sys
import numpy as np
from vla_deploy.runtime.malloc_tuning import give_large_blocks_back

class Told(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks",
        "fordblks", "keepcost")]

libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Told
if sys.argv[1] == "bounded":
    assert give_large_blocks_back()
larger = np.empty(4_000_000, np.uint8)
del larger  # glibc learns from it
before = libc.mallinfo2().hblkhd
image = np.empty(600_000, np.uint8)
print(libc.mallinfo2().hblkhd - before >= image.nbytes)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's allocator")
@pytest.mark.parametrize(("rule", "is_apart"), [("bounded", True), ("as it comes", False)])
def test_images_are_kept_apart_from_the_heap(rule: str, *, is_apart: bool) -> None:
    told = subprocess.run(
        [sys.executable, "-c", _PROBE, rule], capture_output=True, text=True, check=True
    )
    assert told.stdout.strip() == str(is_apart)
