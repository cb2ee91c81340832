"""Give a process of the robot a child that uses as much memory and CPU as a file says.

`hog.py WISH COMMAND...` starts one such child for each core and becomes the process itself. What a
process has started counts as its own, so to the budgets it is the process that grows and spins.
"""

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_CHILD = "--child"
_NAP_S = 0.05
_SPIN_NS = 20_000_000
_PAGE_BYTES = 4096
_MB = 1_000_000


def main() -> None:
    """Start the children and become the wanted program, or be a child."""
    if sys.argv[1] == _CHILD:
        _weigh(number=int(sys.argv[2]), wish=Path(sys.argv[3]), parent_pid=int(sys.argv[4]))
        return
    wish, program = sys.argv[1], sys.argv[2:]
    for number in range(os.cpu_count() or 1):
        words = [__file__, _CHILD, str(number), wish, str(os.getpid())]
        subprocess.Popen([sys.executable, *words])
    os.execv(sys.executable, [sys.executable, *program])


def _weigh(number: int, wish: Path, parent_pid: int) -> None:
    """Follow the wish until the parent ends: child 0 holds the memory, the first ones spin."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    kept = bytearray()
    while os.getppid() == parent_pid:
        wanted = json.loads(wish.read_text(encoding="utf-8"))
        pages = wanted["memory_mb"] * _MB // _PAGE_BYTES if number == 0 else 0
        if len(kept) != pages * _PAGE_BYTES:
            kept = bytearray(os.urandom(_PAGE_BYTES)) * pages
        if number < wanted["busy_cores"]:
            _spin()
        else:
            time.sleep(_NAP_S)


def _spin() -> None:
    until_ns = time.monotonic_ns() + _SPIN_NS
    while time.monotonic_ns() < until_ns:
        pass


if __name__ == "__main__":
    main()
