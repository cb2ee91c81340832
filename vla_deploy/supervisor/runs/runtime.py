"""Own the directory of one run: its lock, its shared memory, and what dead runs left behind."""

import contextlib
import fcntl
import json
import logging
import os
import re
import shutil
import stat
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

import psutil

from vla_deploy.runtime.logs import RUN_ID_VARIABLE
from vla_deploy.runtime.state_dir import (
    ROOT_CONFIG,
    ROOT_STATE,
    config_dir_of,
    state_dir_of,
    user_base,
)
from vla_deploy.supervisor.errors import AlreadyRunning, RuntimeUnavailable
from vla_deploy.supervisor.processes.usage import read_stat
from vla_deploy.supervisor.runs.log_files import BoundedFolder

SHARED_MEMORY = Path("/dev/shm")
KEEP_LOGS_OF_RUNS = 20
_OWNER_FILE = "owner.json"
_RUN_ID: Final = re.compile(r"\d{8}-\d{6}-\d+")
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Owner:
    """Identify the supervisor of a run; the start time distinguishes it from a later
    process of its pid, and is counted since boot: no jump of the wall clock changes it.
    """

    pid: int
    start_ticks: int
    run_id: str
    run_dir: str

    def is_alive(self) -> bool:
        """Return whether that very process still runs; a zombie does not."""
        found = read_stat(self.pid)
        return found is not None and not found.ended and found.start_ticks == self.start_ticks


def default_base() -> Path:
    """Return the default runtime directory."""
    if os.getuid() == 0:
        return Path("/run/vla-deploy")
    return user_base()


def running(base: Path) -> Owner | None:
    """Return the supervisor that now holds `base`, or None.

    Raises:
        RuntimeUnavailable: `base` belongs to someone else.
    """
    owner = _read_owner(base / "lock")
    return owner if owner is not None and owner.is_alive() else None


def free_base(base: Path) -> None:
    """Make the runtime directory if it is missing, for files that a run is derived from.

    Raises:
        AlreadyRunning: a supervisor holds it.
        RuntimeUnavailable: it cannot be made or belongs to someone else.
    """
    _make_private(base)
    owner = running(base)
    if owner is not None:
        raise _already_running(base, owner)


class Runtime:
    """Hold `<base>/<run_id>/` for one run, remove it at the end.

    Raises:
        AlreadyRunning: another supervisor holds `base`.
        RuntimeUnavailable: `base` cannot be made or belongs to someone else.
    """

    def __init__(self, base: Path, shared_memory: Path = SHARED_MEMORY) -> None:
        self._base = base
        self._shared_memory = shared_memory
        _make_private(base)
        self.state_dir = state_dir_of(base)
        for folder in (self.state_dir, config_dir_of(base)):
            _require_trusted(folder)
        with contextlib.suppress(OSError):  # whoever writes there says what is wrong with it
            self.state_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._lock_fd = _lock(base)
        self._old_logs = old_logs(self.state_dir)
        self.orphans = _sweep_runs(base, self._old_logs)
        _sweep_shared_memory(shared_memory)
        self.run_id = f"{datetime.now():%Y%m%d-%H%M%S}-{os.getpid()}"
        self.run_dir = base / self.run_id
        self._owner = Owner(
            pid=os.getpid(),
            start_ticks=own_start_ticks(),
            run_id=self.run_id,
            run_dir=str(self.run_dir),
        )
        self.run_dir.mkdir(mode=0o700)
        self.ipc_dir = self._make_ipc_dir()
        _write_owner(base / "lock", self._owner)
        _point_to(base / "current", self.run_id)

    def close(self) -> None:
        """Keep the logs, remove everything else of this run and release the lock."""
        _keep_logs(self.run_dir, self._old_logs)
        (self._base / "current").unlink(missing_ok=True)
        shutil.rmtree(self.ipc_dir, ignore_errors=True)
        shutil.rmtree(self.run_dir, ignore_errors=True)
        os.ftruncate(self._lock_fd, 0)
        os.close(self._lock_fd)

    def _make_ipc_dir(self) -> Path:
        link = self.run_dir / "ipc"
        if not self._shared_memory.is_dir():
            link.mkdir(mode=0o700)
            return link
        directory = self._shared_memory / f"{_prefix()}{self.run_id}"
        unfinished = directory.with_name(f".{directory.name}")
        unfinished.mkdir(mode=0o700)
        _write_owner(unfinished / _OWNER_FILE, self._owner)
        unfinished.rename(directory)  # a sweep never sees it without its owner
        link.symlink_to(directory)
        return directory


def own_start_ticks() -> int:
    """Return when this process was started, in clock ticks since boot."""
    found = read_stat(os.getpid())
    assert found is not None, "this process runs"
    return found.start_ticks


def _prefix() -> str:
    return f"vla-deploy-{os.getuid()}-"


def _make_private(base: Path) -> None:
    try:
        base.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = base.stat()
    except OSError as error:
        raise _unavailable(base, error) from error
    if found.st_uid != os.getuid():
        raise RuntimeUnavailable(
            f"runtime directory {base}: belongs to user {found.st_uid}, expected {os.getuid()}; "
            "choose another with --runtime-base"
        )
    if found.st_mode & stat.S_IWOTH:
        raise RuntimeUnavailable(
            f"runtime directory {base}: everybody may write to it, expected its owner only: "
            f"`chmod o-w {base}`, or choose another with --runtime-base"
        )


def _require_trusted(folder: Path) -> None:
    """Refuse a folder in which another user could put settings, accounts or models for this run.

    Root runs by hand what a service's user runs usually, in that user's folders.

    Raises:
        RuntimeUnavailable: it belongs to another user, or everybody may write to it.
    """
    try:
        found = folder.stat()
    except OSError:
        return  # missing: nobody has put anything there
    owners = {0, os.getuid()}
    is_services = os.getuid() == 0 and folder in (ROOT_STATE, ROOT_CONFIG)
    if found.st_uid not in owners and not is_services:
        raise RuntimeUnavailable(
            f"{folder}: belongs to user {found.st_uid}, expected {os.getuid()}; remove it, or "
            "choose another runtime directory with --runtime-base"
        )
    if found.st_mode & stat.S_IWOTH:
        raise RuntimeUnavailable(
            f"{folder}: everybody may write to it, expected its owner only: `chmod o-w {folder}`"
        )


def _unavailable(base: Path, error: OSError) -> RuntimeUnavailable:
    return RuntimeUnavailable(
        f"runtime directory {base}: {error.strerror}; choose another with --runtime-base"
    )


def _lock(base: Path) -> int:
    path = base / "lock"
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise _unavailable(base, error) from error
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(fd)
        raise _already_running(base, _read_owner(path)) from None
    return fd


def _already_running(base: Path, owner: Owner | None) -> AlreadyRunning:
    who = f"pid {owner.pid}, run {owner.run_id}" if owner else "it is just starting or stopping"
    return AlreadyRunning(
        f"a supervisor already runs in {base} ({who}); end it with `vla-deploy shutdown`, "
        "or choose another directory with --runtime-base"
    )


def old_logs(state_dir: Path) -> BoundedFolder:
    """Return the folder with the logs of runs that have ended."""
    return BoundedFolder(state_dir / "runs", KEEP_LOGS_OF_RUNS)


def _keep_logs(run_dir: Path, folder: BoundedFolder) -> None:
    logs = run_dir / "logs"
    if not logs.is_dir():
        return
    try:
        shutil.move(logs, folder.claim(run_dir.name))
    except OSError as error:
        _log.warning("the logs of run %s are lost: %s", run_dir.name, error)


def _sweep_runs(base: Path, logs: BoundedFolder) -> list[int]:
    stale = [path for path in base.iterdir() if _is_run(path)]
    orphans = end_orphans({path.name for path in stale}) if stale else []
    for path in stale:
        _keep_logs(path, logs)
        shutil.rmtree(path, ignore_errors=True)
    return orphans


def _is_run(path: Path) -> bool:
    """Return whether a folder is a run's, not another one in a directory chosen by mistake."""
    is_named_so = _RUN_ID.fullmatch(path.name) is not None
    return is_named_so and path.is_dir() and not path.is_symlink()


def _sweep_shared_memory(shared_memory: Path) -> None:
    for directory in shared_memory.glob(f"{_prefix()}*"):
        owner = _read_owner(directory / _OWNER_FILE)
        if owner is None or not owner.is_alive():
            shutil.rmtree(directory, ignore_errors=True)


def _read_owner(path: Path) -> Owner | None:
    try:
        return Owner(**json.loads(path.read_text()))
    except (FileNotFoundError, NotADirectoryError, json.JSONDecodeError, TypeError):
        return None
    except PermissionError as error:
        raise _unavailable(path.parent, error) from error


def _write_owner(path: Path, owner: Owner) -> None:
    path.write_text(json.dumps(asdict(owner)))


def _point_to(link: Path, target: str) -> None:
    fresh = link.with_name(f".{link.name}-{os.getpid()}")
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(target)
    fresh.replace(link)


PROCESS_VARIABLE = "VLA_DEPLOY_PROCESS"
_TERM_WAIT_S = 1.0
_KILL_WAIT_S = 2.0


def run_id_of(process: psutil.Process) -> str | None:
    """Return the run that a living process belongs to, None where it belongs to none of ours."""
    return environment_of(process).get(RUN_ID_VARIABLE)


def end_orphans(run_ids: Collection[str]) -> list[int]:
    """End every process of these runs, SIGTERM first; return their pids."""
    orphans = [process for process in psutil.process_iter() if run_id_of(process) in run_ids]
    for process in orphans:
        _signal(process, kill=False)
    _, stubborn = psutil.wait_procs(orphans, timeout=_TERM_WAIT_S)
    for process in stubborn:
        _signal(process, kill=True)
    psutil.wait_procs(stubborn, timeout=_KILL_WAIT_S)
    return [process.pid for process in orphans]


def end_leftovers(run_id: str, process_name: str | None = None) -> list[int]:
    """Kill what a run's ended processes have started, wherever it has moved; return the pids.

    With a name, only what that process of the table has started.
    """
    leftovers = []
    for process in psutil.process_iter():
        environment = environment_of(process)
        named = process_name in (None, environment.get(PROCESS_VARIABLE))
        if environment.get(RUN_ID_VARIABLE) == run_id and named:
            _signal(process, kill=True)
            leftovers.append(process.pid)
    return leftovers


def environment_of(process: psutil.Process) -> Mapping[str, str]:
    """Return a process' environment, empty where it is another user's or has ended."""
    try:
        return process.environ()
    except (psutil.AccessDenied, psutil.NoSuchProcess, OSError):
        return {}


def _signal(process: psutil.Process, *, kill: bool) -> None:
    try:
        process.kill() if kill else process.terminate()
    except psutil.NoSuchProcess:
        return
