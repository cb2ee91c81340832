"""Apply what a profile says about one process to the kernel: priority, CPUs, nice, memory lock."""

import ctypes
import errno
import os
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from platforms import Profile

REALTIME_PROCESS: Final = "control"
_LOCK_ALL: Final = 1 | 2  # MCL_CURRENT | MCL_FUTURE
_CAP_IPC_LOCK: Final = 14
_CAP_SYS_NICE: Final = 23
_BEHIND: Final = 1  # of threads beside a real-time one: they may hold the interpreter it waits for
_THREADS: Final = Path("/proc/self/task")


class HostSettings:
    """Hold how the kernel runs this process; threads that it has and will have share it.

    Only threads of the main thread's nice follow when that changes: others have put themselves
    aside.
    """

    def __init__(self, process: str) -> None:
        self._process = process
        self._every_cpu = os.sched_getaffinity(0)
        self._locked = False
        self._threads: int | None = None

    def obstacles(self, profile: Profile) -> tuple[str, ...]:
        """Return what the kernel would refuse of a profile; nothing is changed."""
        return tuple(text for check in _OBSTACLES for text in check(self, profile))

    def apply(self, profile: Profile) -> tuple[str, ...]:
        """Apply as much of a profile as the kernel permits, and return what it refused.

        The first is the one that this process was started with.
        """
        if self._threads is None:
            self._threads = profile.processes[self._process].threads
        refused = list(self.obstacles(profile))
        for act in (self._set_affinity, self._set_nice, self._set_priority, self._set_lock):
            try:
                act(profile)
            except OSError as error:
                if error.errno not in (errno.EPERM, errno.EINVAL, errno.ENOMEM, errno.EACCES):
                    raise
                if not refused:
                    refused.append(f"{act.__name__.removeprefix('_')}: {error.strerror}")
        return tuple(refused)

    def _set_affinity(self, profile: Profile) -> None:
        wanted = set(profile.processes[self._process].affinity) or self._every_cpu
        for thread in _threads():
            os.sched_setaffinity(thread, wanted)

    def _set_nice(self, profile: Profile) -> None:
        nice = profile.processes[self._process].nice
        before = os.getpriority(os.PRIO_PROCESS, os.getpid())
        if nice == before:
            return
        for thread in _threads():
            if os.getpriority(os.PRIO_PROCESS, thread) == before:
                os.setpriority(os.PRIO_PROCESS, thread, nice)

    def _set_priority(self, profile: Profile) -> None:
        priority = self._priority(profile)
        policy = os.SCHED_FIFO if priority else os.SCHED_OTHER
        if (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority) != (policy, priority):
            try:
                for thread in _threads():
                    behind = priority if thread == os.getpid() else min(priority, _BEHIND)
                    os.sched_setscheduler(thread, policy, os.sched_param(behind))
            except PermissionError:
                if profile.realtime_required:
                    raise

    def _set_lock(self, profile: Profile) -> None:
        wanted = self._wants_lock(profile) and _may_lock()
        if wanted == self._locked:
            return
        libc = ctypes.CDLL(None, use_errno=True)
        if (libc.mlockall(_LOCK_ALL) if wanted else libc.munlockall()) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        self._locked = wanted

    def _priority(self, profile: Profile) -> int:
        return profile.realtime_priority if self._process == REALTIME_PROCESS else 0

    def _wants_lock(self, profile: Profile) -> bool:
        return profile.memory_lock and self._process == REALTIME_PROCESS

    def _cpu_obstacle(self, profile: Profile) -> Iterator[str]:
        beyond = set(profile.processes[self._process].affinity) - self._every_cpu
        if beyond:
            yield f"no CPU {sorted(beyond)} (this computer grants {sorted(self._every_cpu)})"

    def _nice_obstacle(self, profile: Profile) -> Iterator[str]:
        nice, now = profile.processes[self._process].nice, os.getpriority(os.PRIO_PROCESS, 0)
        least = 20 - resource.getrlimit(resource.RLIMIT_NICE)[0]
        if nice < min(now, least) and not _may(_CAP_SYS_NICE):
            yield f"no nice {nice} after {now} (grant CAP_SYS_NICE or LimitNICE)"

    def _priority_obstacle(self, profile: Profile) -> Iterator[str]:
        priority = self._priority(profile)
        if not profile.realtime_required:
            return
        if priority > resource.getrlimit(resource.RLIMIT_RTPRIO)[0] and not _may(_CAP_SYS_NICE):
            yield (
                f"no SCHED_FIFO priority {priority} (grant CAP_SYS_NICE or LimitRTPRIO); ticks may "
                "be late under load"
            )

    def _lock_obstacle(self, profile: Profile) -> Iterator[str]:
        if self._wants_lock(profile) and not _may_lock():
            yield "no memory lock (grant CAP_IPC_LOCK or LimitMEMLOCK=infinity); ticks may be late"

    def _thread_obstacle(self, profile: Profile) -> Iterator[str]:
        wanted = profile.processes[self._process].threads
        if self._threads is not None and wanted != self._threads:
            yield (
                f"threads = {wanted}: numeric libraries read that once, at the start of the "
                f"process; they have {self._threads}"
            )


def _threads() -> list[int]:
    return [int(path.name) for path in _THREADS.iterdir()]


def _may_lock() -> bool:
    """Return whether all memory, also future, may be locked: half a right would crash."""
    return resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY or _may(
        _CAP_IPC_LOCK
    )


def _may(capability: int) -> bool:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("CapEff:"):
            return bool(int(line.split()[1], 16) >> capability & 1)
    return False


_OBSTACLES: Final[tuple[Callable[[HostSettings, Profile], Iterator[str]], ...]] = (
    HostSettings._cpu_obstacle,
    HostSettings._nice_obstacle,
    HostSettings._priority_obstacle,
    HostSettings._lock_obstacle,
    HostSettings._thread_obstacle,
)
