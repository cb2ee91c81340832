"""Settle who gets the cores: a core each, real-time priority, or none to spare for anybody."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_BUSY: Final = "while True: pass"
REALTIME_PRIORITY: Final = 40
"""Below the emulated servos': hardware waits for nobody."""


def hardware_cores() -> set[int]:
    """Return where the emulated hardware runs: the last core, or the only one."""
    return {max(os.sched_getaffinity(0))}


@contextmanager
def own_core() -> Iterator[None]:
    """Keep this process on the first core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


@contextmanager
def realtime() -> Iterator[bool]:
    """Be scheduled as control is; tell whether that is permitted. Children are not.

    Not for a client that spins: it would starve the kernel's own carriers of a terminal's bytes.
    """
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(REALTIME_PRIORITY))
    except PermissionError:
        yield False
        return
    try:
        yield True
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@contextmanager
def busy_cores() -> Iterator[None]:
    """Keep every core busy with a process that never pauses."""
    spinners = [subprocess.Popen([sys.executable, "-c", _BUSY]) for _ in os.sched_getaffinity(0)]
    try:
        yield
    finally:
        for spinner in spinners:
            spinner.kill()
            spinner.wait()
