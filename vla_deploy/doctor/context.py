"""Give the checks what they read: a root, this process' rights, commands to run, the time."""

import os
import resource
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.base import ByteTransport
from drivers.clock import Clock, MonotonicClock
from drivers.serial_port import SerialPort
from platforms import Profile
from platforms.board import Board, identify
from platforms.tree import Tree, ValueMissing
from vla_deploy.inference.store import ModelStore
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.state_dir import system_models_dir

COMMAND_TIMEOUT_S: Final = 10.0
UNLIMITED: Final = -1
_TRIAL_PRIORITY: Final = 1
_CAP_IPC_LOCK: Final = 14
_CAP_SYS_NICE: Final = 23

Asker = Callable[[Sequence[str]], str]
"""Run a command and return what it prints; raise `ValueMissing` where it cannot be run."""


SerialOpener = Callable[[Path, int, Clock], ByteTransport]
"""Open a serial port at a speed; raise `DriverError` where it is missing or busy."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rights:
    """Hold what this process may do; `fifo_refusal` is empty where SCHED_FIFO was granted."""

    uid: int
    fifo_refusal: str
    realtime_priority_limit: int
    memory_lock_bytes: int
    may_lock_all: bool
    may_raise_others: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorContext:
    """Hold everything that the checks look at; `is_live` is False for a recorded tree.

    `profile_fault` is why the profile is not the chosen one, empty where it is.
    """

    tree: Tree
    is_live: bool
    board: Board
    profile: Profile | None
    robot: RobotDescription | None
    rights: Rights
    ask: Asker
    clock: Clock
    models: ModelStore
    profile_fault: str = ""
    open_serial: SerialOpener = SerialPort


def live_context(
    profile: Profile | None,
    robot: RobotDescription | None,
    models: Path,
    profile_fault: str = "",
) -> DoctorContext:
    """Return this very computer; `models` is the folder of models that the user added."""
    return DoctorContext(
        tree=Tree(),
        is_live=True,
        board=identify(),
        profile=profile,
        robot=robot,
        rights=read_rights(),
        ask=ask_command,
        clock=MonotonicClock(),
        models=ModelStore(models, system=system_models_dir()),
        profile_fault=profile_fault,
    )


def recorded_context(
    root: Path, profile: Profile | None, robot: RobotDescription | None
) -> DoctorContext:
    """Return a recorded tree; no command runs and nothing is measured: that is another computer."""
    return DoctorContext(
        tree=Tree(root),
        is_live=False,
        board=identify(root),
        profile=profile,
        robot=robot,
        rights=read_rights(),
        ask=_ask_nobody,
        clock=MonotonicClock(),
        models=ModelStore(root / "var/lib/vla-deploy/models"),
    )


def read_rights() -> Rights:
    """Return what this process may do; SCHED_FIFO is tried for a moment."""
    memory_lock, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    _, priority = resource.getrlimit(resource.RLIMIT_RTPRIO)
    return Rights(
        uid=os.geteuid(),
        fifo_refusal=_try_fifo(),
        realtime_priority_limit=priority,
        memory_lock_bytes=UNLIMITED if memory_lock == resource.RLIM_INFINITY else memory_lock,
        may_lock_all=bool(_capabilities() >> _CAP_IPC_LOCK & 1),
        may_raise_others=bool(_capabilities() >> _CAP_SYS_NICE & 1),
    )


def ask_command(command: Sequence[str]) -> str:
    """Return what a command prints.

    Raises:
        ValueMissing: it is not installed, fails, or does not end in time.
    """
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=COMMAND_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired, UnicodeDecodeError) as error:
        raise ValueMissing(f"`{' '.join(command)}` gives nothing: {error}") from error
    if done.returncode:
        words = (done.stderr.strip() or done.stdout.strip()).splitlines() or [f"{done.returncode}"]
        raise ValueMissing(f"`{Path(command[0]).name}` says: {words[-1]}")
    return done.stdout


def _ask_nobody(command: Sequence[str]) -> str:
    raise ValueMissing(f"`{command[0]}` is not asked about a recorded tree")


def _try_fifo() -> str:
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_TRIAL_PRIORITY))
    except OSError as error:
        return error.strerror or str(error)
    os.sched_setscheduler(0, policy, parameters)
    return ""


def _capabilities() -> int:
    try:
        status = Tree().text("/proc/self/status")
    except ValueMissing:
        return 0
    row = next((line for line in status.splitlines() if line.startswith("CapEff:")), "CapEff: 0")
    return int(row.split()[1], 16)


_EXTLINUX: Final = "/boot/extlinux/extlinux.conf"


def boot_option(tree: Tree, option: str) -> str:
    """Return the command to type: Jetsons boot by extlinux, most others by GRUB."""
    if tree.exists(_EXTLINUX):
        return f"sudoedit {_EXTLINUX}   # add {option} to APPEND; reboot"
    return f"sudoedit /etc/default/grub   # add {option}; sudo update-grub; reboot"
