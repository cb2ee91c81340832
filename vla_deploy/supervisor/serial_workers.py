"""Let what servos answer get past ordinary processes inside the kernel.

A serial port's bytes reach their reader by an unbound worker of the kernel (tty_flip_buffer_push
queues flush_to_ldisc), which waits for a processor as any ordinary process does, whatever the
reader's own priority is. `vla-deploy bench serial` measures it.
"""

import logging
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock

PRIORITY: Final = 1  # above every ordinary process, below everything else of real time
UNBOUND_WORKER: Final = "kworker/u"  # Documentation/core-api/workqueue.rst: kworker/u<pool>:<id>
_PERIOD_NS: Final = NS_PER_S
_PROC: Final = Path("/proc")
_log = logging.getLogger(__name__)


class SerialWorkers:
    """Keep the kernel's unbound workers above ordinary processes; closing lets them sink again.

    The kernel makes and ends them as it needs them, so it is looked again every second.
    """

    def __init__(self, clock: Clock, proc: Path = _PROC) -> None:
        self._clock = clock
        self._proc = proc
        self._due_ns: int | None = None
        self._known: frozenset[int] = frozenset()
        self._raised: set[int] = set()
        self._refused = False

    def step(self, *, wanted: bool) -> None:
        """Raise those that are new, at most once a second; not `wanted` lets all sink again."""
        if not wanted:
            self.close()
            return
        now_ns = self._clock.now_ns()
        if self._refused or (self._due_ns is not None and now_ns < self._due_ns):
            return
        self._due_ns = now_ns + _PERIOD_NS
        pids = frozenset(int(path.name) for path in self._proc.iterdir() if path.name.isdecimal())
        for pid in unbound_workers(sorted(pids - self._known), self._proc):
            self._raise(pid)
        self._known = pids

    def close(self) -> None:
        """Give every worker that was raised its ordinary priority back."""
        for pid in self._raised & set(unbound_workers(sorted(self._raised), self._proc)):
            _schedule(pid, os.SCHED_OTHER, 0)
        self._raised.clear()
        self._known, self._due_ns = frozenset(), None

    def _raise(self, pid: int) -> None:
        try:
            ordinary = os.sched_getscheduler(pid) == os.SCHED_OTHER
            if ordinary and _schedule(pid, os.SCHED_FIFO, PRIORITY):
                self._raised.add(pid)
        except ProcessLookupError:
            return
        except PermissionError:
            self._refused = True
            _log.info(
                "what servos answer waits behind ordinary processes under load: the kernel's "
                "workers may not be raised (grant CAP_SYS_NICE)"
            )


def unbound_workers(pids: list[int], proc: Path = _PROC) -> Iterator[int]:
    """Give those of some processes that are workers of the kernel bound to no processor."""
    for pid in pids:
        try:
            name = (proc / str(pid) / "comm").read_text()
        except OSError:
            continue  # it has ended, or is hidden
        if name.startswith(UNBOUND_WORKER):
            yield pid


def _schedule(pid: int, policy: int, priority: int) -> bool:
    """Return whether there still is such a process.

    Raises:
        PermissionError: this process may not do that.
    """
    try:
        os.sched_setscheduler(pid, policy, os.sched_param(priority))
    except ProcessLookupError:
        return False
    return True
