"""Raise the kernel's workers that carry servo answers above ordinary processes.

A serial port's bytes reach their reader by an unbound worker of the kernel (tty_flip_buffer_push
queues flush_to_ldisc), which waits for a processor as any ordinary process does, whatever the
reader's own priority is. `vla-deploy bench serial` measures it.
"""

import logging
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock

PRIORITY: Final = 1  # above every ordinary process, below everything else of real time
UNBOUND_WORKER: Final = "kworker/u"  # Documentation/core-api/workqueue.rst: kworker/u<pool>:<id>
_NOT_YET_NAMED: Final = "kthreadd"  # whose child it is, for a moment
_PERIOD_NS: Final = NS_PER_S
_PROC: Final = Path("/proc")
_log = logging.getLogger(__name__)


class SerialWorkers:
    """Keep the kernel's unbound workers above ordinary processes until `close`.

    The kernel makes and ends them as it needs them: they are looked for again whenever it reports a
    new pid, and at least once a second.
    """

    def __init__(self, clock: Clock, proc: Path = _PROC) -> None:
        self._clock = clock
        self._proc = proc
        self._due_ns = 0
        self._newest = ""
        self._known: frozenset[int] = frozenset()
        self._raised: set[int] = set()
        self._refused = False

    def step(self, *, wanted: bool) -> None:
        """Raise new workers; if not `wanted`, restore all of them."""
        if not wanted:
            self.close()
        elif not self._refused and self._is_due():
            self._look()

    def _is_due(self) -> bool:
        newest, now_ns = self._newest_pid(), self._clock.now_ns()
        if newest == self._newest and now_ns < self._due_ns:
            return False
        self._newest, self._due_ns = newest, now_ns + _PERIOD_NS
        return True

    def _newest_pid(self) -> str:
        """Return the last field of proc_loadavg(5): the newest pid, of a thread also."""
        return (self._proc / "loadavg").read_text().rpartition(" ")[2]

    def _look(self) -> None:
        pids = frozenset(int(path.name) for path in self._proc.iterdir() if path.name.isdecimal())
        names = dict(_names(sorted(pids - self._known), self._proc))
        for pid, name in names.items():
            if name.startswith(UNBOUND_WORKER):
                self._raise(pid)
        self._known = pids - {pid for pid, name in names.items() if name == _NOT_YET_NAMED}

    def close(self) -> None:
        """Restore the ordinary priority of every worker that was raised."""
        for pid, name in _names(sorted(self._raised), self._proc):
            if name.startswith(UNBOUND_WORKER):
                _schedule(pid, os.SCHED_OTHER, 0)
        self._raised.clear()
        self._known, self._due_ns = frozenset(), 0

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


def _names(pids: Iterable[int], proc: Path) -> Iterator[tuple[int, str]]:
    for pid in pids:
        try:
            yield pid, (proc / str(pid) / "comm").read_text().strip()
        except OSError:
            continue  # it has ended, or is hidden


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
