"""Run one service by the rules of `systemd/vla-deploy.service`, where no systemd can be started.

It speaks the service manager's side of the notify protocol at a real socket: READY, STATUS,
WATCHDOG, EXTEND_TIMEOUT_USEC and STOPPING, from the main process only. It is no systemd: what
belongs to the service is found by a mark in its environment instead of by a control group.
"""

import logging
import secrets
import signal
import socket
import struct
import subprocess
import tempfile
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import psutil

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from sim_twin.harness.robot import end_process, marked

MARK: Final = "SERVICE_RUNNER_MARK"
_CREDENTIALS: Final = struct.Struct("3i")
_MAX_BYTES: Final = 4096
_POLL_S: Final = 0.02
_NS_PER_US: Final = 1000
_log = logging.getLogger(__name__)


class RunnerState(StrEnum):
    """Name the states of a service."""

    INACTIVE = "inactive"
    STARTING = "starting"
    READY = "ready"
    STOPPING = "stopping"
    RESTARTING = "restarting"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceRules:
    """Hold the times and limits of a unit; the names say which of its settings they are."""

    watchdog_s: float
    restart_s: float
    start_timeout_s: float = 60.0
    stop_timeout_s: float = 30.0
    abort_timeout_s: float = 3.0
    settle_s: float = 3.0  # ExecStopPost: children come to rest before they are killed
    start_limit_burst: int = 5
    start_limit_interval_s: float = 300.0
    prevent_restart: frozenset[int] = frozenset({2})


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceReport:
    """Say how the service is: its words, its main process and what has happened to it."""

    state: RunnerState = RunnerState.INACTIVE
    main_pid: int = 0
    status: str = ""
    restarts: int = 0
    watchdog_kills: int = 0
    exit_code: int | None = None


class ServiceRunner:
    """Keep one command running: restart it when it fails, stays silent or never gets ready."""

    def __init__(
        self,
        command: Sequence[str],
        env: Mapping[str, str],
        rules: ServiceRules,
        clock: Clock | None = None,
    ) -> None:
        """Judge start, watchdog and stop by `clock`; systemd does by the wall clock, the default.

        A service that lives on the twin's time is judged by it: a busy computer is no hang.
        """
        self.rules = rules
        self.report = ServiceReport()
        self._command = list(command)
        self._clock: Clock = clock or MonotonicClock()
        self._mark = secrets.token_hex(8)
        self._folder = tempfile.TemporaryDirectory(prefix="service-")
        self._socket = _listen(f"{self._folder.name}/notify")
        self._environment = {
            **env,
            MARK: self._mark,
            "NOTIFY_SOCKET": f"{self._folder.name}/notify",
            "WATCHDOG_USEC": str(round(self.rules.watchdog_s * 1e6)),
        }
        self._starts: deque[int] = deque(maxlen=self.rules.start_limit_burst)
        self._stop = threading.Event()
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._serve, name="service-runner", daemon=True)
        self._deadline_ns = 0

    @property
    def state(self) -> RunnerState:
        """Return the state of the service."""
        return self.report.state

    def start(self) -> None:
        """Start the service and return at once."""
        self._set(state=RunnerState.STARTING)
        self._thread.start()

    def wait_for(self, state: RunnerState, timeout_s: float) -> bool:
        """Wait for a state; return whether it came."""
        with self._changed:
            return self._changed.wait_for(lambda: self.state is state, timeout_s)

    def stop(self) -> None:
        """Stop the service as `systemctl stop` does, and end whatever is left of it."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()
        self._socket.close()
        self._folder.cleanup()

    def members(self) -> list[psutil.Process]:
        """Return every process of the service that runs, wherever it was reparented to."""
        return marked(MARK, self._mark)

    def _serve(self) -> None:
        while not self._stop.is_set() and self._may_start():
            exit_code = self._live()
            self._set(main_pid=0, exit_code=exit_code)
            if self._stop.is_set() or exit_code == 0:
                break
            if exit_code in self.rules.prevent_restart:
                self._set(state=RunnerState.FAILED)
                return
            self._set(state=RunnerState.RESTARTING)
            self._stop.wait(self.rules.restart_s)
            if not self._stop.is_set():
                self._set(restarts=self.report.restarts + 1)
        if self.state is not RunnerState.FAILED:
            self._set(state=RunnerState.INACTIVE)

    def _may_start(self) -> bool:
        """Give up, as StartLimitBurst says, after too many starts in an interval."""
        now_ns = self._clock.now_ns()
        full = len(self._starts) == self.rules.start_limit_burst
        if full and now_ns - self._starts[0] < self.rules.start_limit_interval_s * NS_PER_S:
            self._set(state=RunnerState.FAILED)
            return False
        self._starts.append(now_ns)
        return True

    def _live(self) -> int:
        """Run the main process from start to end; return its exit code, negative for a signal."""
        self._set(state=RunnerState.STARTING, status="")
        self._allow(self.rules.start_timeout_s)
        process = self._spawn()
        self._set(main_pid=process.pid)
        try:
            while process.poll() is None and not self._stop.is_set():
                self._listen_once(process.pid)
                if self._clock.now_ns() > self._deadline_ns:
                    self._abort(process)
            if self._stop.is_set():
                self._terminate(process)
        finally:
            self._end_members()
        return process.wait()

    def _spawn(self) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            self._command,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def _listen_once(self, main_pid: int) -> None:
        try:
            data, ancillary, _, _ = self._socket.recvmsg(
                _MAX_BYTES, socket.CMSG_SPACE(_CREDENTIALS.size)
            )
        except TimeoutError:
            return
        sender = _CREDENTIALS.unpack(ancillary[0][2][: _CREDENTIALS.size])[0]
        if sender != main_pid:
            _log.warning("process %d is not the main process; its message is ignored", sender)
            return
        for line in data.decode().splitlines():
            name, _, value = line.partition("=")
            self._take(name, value)

    def _take(self, name: str, value: str) -> None:
        if name == "STATUS":
            self._set(status=value)
        elif name == "STOPPING":
            self._set(state=RunnerState.STOPPING)
            self._allow(self.rules.stop_timeout_s)
        elif name == "READY":
            self._set(state=RunnerState.READY)
            self._allow(self.rules.watchdog_s)
        elif name == "WATCHDOG" and self.state is RunnerState.READY:
            self._allow(self.rules.watchdog_s)
        elif name == "EXTEND_TIMEOUT_USEC" and self.state is not RunnerState.READY:
            extended_ns = self._clock.now_ns() + int(value) * _NS_PER_US
            self._deadline_ns = max(self._deadline_ns, extended_ns)

    def _abort(self, process: "subprocess.Popen[bytes]") -> None:
        """Do what systemd does to a service that is late: SIGABRT, then SIGKILL."""
        if self.state is RunnerState.READY:
            self._set(watchdog_kills=self.report.watchdog_kills + 1)
        process.send_signal(signal.SIGABRT)
        process.send_signal(signal.SIGCONT)
        end_process(process, self.rules.abort_timeout_s)

    def _terminate(self, process: "subprocess.Popen[bytes]") -> None:
        self._set(state=RunnerState.STOPPING)
        process.terminate()
        process.send_signal(signal.SIGCONT)
        end_process(process, self.rules.stop_timeout_s)

    def _end_members(self) -> None:
        """Wait for children to come to rest, then kill what is left (KillMode=mixed)."""
        left = self.members()
        _, left = psutil.wait_procs(left, timeout=self.rules.settle_s)
        for process in left:
            process.kill()
        psutil.wait_procs(left, timeout=self.rules.abort_timeout_s)

    def _allow(self, duration_s: float) -> None:
        self._deadline_ns = self._clock.now_ns() + round(duration_s * NS_PER_S)

    def _set(self, **changes: object) -> None:
        with self._changed:
            self.report = replace(self.report, **changes)  # type: ignore[arg-type]
            self._changed.notify_all()


def _listen(path: str) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    listener.bind(path)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
    listener.settimeout(_POLL_S)
    return listener
