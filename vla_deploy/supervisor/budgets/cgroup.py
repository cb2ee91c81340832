"""Set limits in control groups, version 2, and believe only what reads back."""

import contextlib
import gzip
import os
from pathlib import Path
from typing import Final

from platforms.probes import Cgroup, read_cgroup
from platforms.probes.cgroup import MOUNT, UNIFIED
from platforms.tree import Tree

CONTROLLERS: Final = ("memory", "cpu", "pids")
SUPERVISOR: Final = "supervisor"
PERIOD_US: Final = 100_000
_KERNEL_CONFIG: Final = "/proc/config.gz"


class CgroupRefused(Exception):
    """Say why a limit is not in force."""


class CgroupTree:
    """Own the subtree below the control group that the service manager delegated.

    The kernel allows no processes in a group that hands controllers on, so the supervisor first
    moves into a group of its own. `refusals` has for each controller why it cannot be used.
    """

    def __init__(
        self,
        root: Path = Path("/"),
        *,
        realtime: bool = False,
        controllers: tuple[str, ...] = CONTROLLERS,
    ) -> None:
        found = read_cgroup(Tree(root))
        self._controllers = controllers
        self._folder = root / found.folder.lstrip("/")
        self._made: list[Path] = []
        self._moved = False
        self.refusals = {name: why for name in controllers if (why := _objection(found, name))}
        if realtime and "cpu" in self.usable and _groups_realtime(root):
            self.refusals["cpu"] = "this kernel refuses SCHED_FIFO in groups (RT_GROUP_SCHED)"
        for controller in self.usable:
            self._enable(controller)

    @property
    def usable(self) -> tuple[str, ...]:
        """Return the controllers whose use was confirmed."""
        return tuple(name for name in self._controllers if name not in self.refusals)

    def place(self, group: str, pid: int) -> None:
        """Move a process, and what it starts later, into its group.

        Raises:
            CgroupRefused: the kernel did not move it.
        """
        _put(self._group(group) / "cgroup.procs", str(pid))

    def limit(self, group: str, file: str, value: str) -> None:
        """Set one limit and read it back.

        Raises:
            CgroupRefused: there is no such file, or something else reads back.
        """
        path = self._group(group) / file
        if not path.exists():
            raise CgroupRefused(f"there is no {path.name}: this kernel cannot do that in groups")
        _put(path, value)
        if (got := _read(path)) != value:
            raise CgroupRefused(f"{path} says {got!r} after {value!r} was written")

    def close(self) -> None:
        """Remove the groups that were made here; the supervisor's own goes with the unit."""
        for group in self._made:
            with contextlib.suppress(OSError):  # still in use: it goes with the unit
                group.rmdir()

    def _group(self, name: str) -> Path:
        group = self._folder / name
        try:
            if not group.is_dir():
                group.mkdir()
                self._made.append(group)
        except OSError as error:
            raise CgroupRefused(f"{group}: {error.strerror}") from error
        return group

    def _enable(self, controller: str) -> None:
        try:
            self._enable_once(controller)
        except CgroupRefused as refusal:
            self.refusals[controller] = str(refusal)

    def _enable_once(self, controller: str) -> None:
        path = self._folder / "cgroup.subtree_control"
        if controller in _read(path).split():
            return
        try:
            _put(path, f"+{controller}")
        except CgroupRefused:
            if self._moved:
                raise
            self._leave_group()
            _put(path, f"+{controller}")
        if controller not in _read(path).split():
            raise CgroupRefused(f"{path} does not list {controller} after it was written")

    def _leave_group(self) -> None:
        """Leave the group that is to hand controllers on: it must hold no processes."""
        self._moved = True
        own = self._group(SUPERVISOR)
        _put(own / "cgroup.procs", str(os.getpid()))


def _objection(found: Cgroup, controller: str) -> str:
    if controller not in found.controllers:
        return found.reason or f"{found.folder} does not offer the controller {controller}"
    if found.folder in (MOUNT, UNIFIED):
        return "the supervisor runs in the root group: start it as a service with Delegate=yes"
    return ""


def memory_bytes(megabytes: float) -> str:
    """Return a limit in whole pages, as it reads back."""
    page = os.sysconf("SC_PAGE_SIZE")
    return str(int(megabytes * 1_000_000) // page * page)


def cpu_max(cores: float) -> str:
    """Return a limit of CPU time per period."""
    return f"{round(cores * PERIOD_US)} {PERIOD_US}"


def _read(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError as error:
        raise CgroupRefused(f"{path}: {error.strerror}") from error


def _put(path: Path, value: str) -> None:
    try:
        with path.open("r+") as file:
            file.write(value)
    except OSError as error:
        raise CgroupRefused(f"{path}: {error.strerror}") from error


def _groups_realtime(root: Path) -> bool:
    return b"CONFIG_RT_GROUP_SCHED=y" in _kernel_config(root)


def _kernel_config(root: Path) -> bytes:
    try:
        return gzip.decompress((root / _KERNEL_CONFIG.lstrip("/")).read_bytes())
    except (OSError, EOFError):
        return b""  # unknown on most desktops; control itself warns when it is refused SCHED_FIFO
