"""Run the robot as a service does, and be its operator, its user and its adversary."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from sim_twin.campaigns.strays import MARK, strays
from sim_twin.harness.service_runner import RunnerState, ServiceRunner
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import IpcError
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.supervisor.processes.lifecycle import is_settled
from vla_deploy.supervisor.runs.runtime import running
from vla_deploy.supervisor.systemd import RESTART_S, watchdog_s

_COMMAND: Final = (sys.executable, "-m", "vla_deploy.cli.main")
_READY_S: Final = 120.0
_ACT_S: Final = 20.0
_AGAIN_S: Final = 1.0
_POLL_NS: Final = NS_PER_S // 20
_FRESH_S: Final = 3.0
_FRESH_STATUS_S: Final = 0.5
_TABLE_NS: Final = NS_PER_S  # twice as long as the table grows old


class ServiceNotReady(Exception):
    """Say that the robot does not come up, or cannot be armed."""


class RobotService:
    """Hold the service of one robot whose devices are in `devices_dir`."""

    def __init__(self, base: Path, devices_dir: Path, clock: Clock) -> None:
        """Start the service; it restarts and is watched for ever."""
        base.mkdir(parents=True, exist_ok=True)
        self._base = base
        self._clock = clock
        self._session: RobotSession | None = None
        words = ("--runtime-base", str(base), "run", "--devices-dir", str(devices_dir))
        self._command = [*_COMMAND, *words]
        self._runner = self._started()

    def make_ready(self) -> None:
        """Start the service if it has ended, wait for every process, then reset and arm.

        Raises:
            ServiceNotReady: it does not come up, or control does not arm.
        """
        if self.has_ended():
            self._runner.stop()  # what it holds of an ended service goes too
            self._runner = self._started()
        self._await(self.is_ready, _READY_S, "not every process is ready")
        self._do("reset", ("disarmed", "armed"))
        self._do("arm", ("armed",))

    def has_ended(self) -> bool:
        """Return whether the service has ended as a person wanted: nobody starts it again."""
        return self._runner.state is RunnerState.INACTIVE

    def is_ready(self) -> bool:
        """Return whether every process that should run is ready."""
        table = self._document("process_table", _FRESH_S)
        return table is not None and is_settled(table)

    def control_state(self) -> str:
        """Return control's state, "silent" where it tells none."""
        status = self._document("control_status", _FRESH_STATUS_S)
        return "silent" if status is None else str(status["state"])

    def skill(self) -> str:
        """Return which skill the executor is at, empty where it is at none."""
        status = self._document("executor_status", _FRESH_S)
        return "" if status is None else str(status.get("skill") or "")

    def why(self) -> str:
        """Return the cause of control's state, and what it says of it."""
        status = self._document("control_status", _FRESH_STATUS_S) or {}
        return f"{status.get('cause')}: {status.get('detail')}"

    def pid_of(self, process: str) -> int:
        """Return a process' id, 0 while it has none."""
        table = self._document("process_table", _FRESH_S)
        if table is None:
            return 0
        if process == "supervisor":
            return int(table["supervisor_pid"])
        pids = {row["name"]: row["pid"] or 0 for row in table["processes"]}
        return int(pids[process])

    def signal(self, process: str, number: signal.Signals) -> int:
        """Send a signal to one process, and return who got it.

        Raises:
            ServiceNotReady: it does not run.
        """
        pid = self.pid_of(process)
        if not pid:  # kill(2) would take 0 for everyone in our own process group
            raise ServiceNotReady(f"{process} does not run, so it cannot get {number.name}")
        os.kill(pid, number)
        return pid

    def begin(self, *words: str) -> "subprocess.Popen[bytes]":
        """Start `vla-deploy WORDS` and do not wait for it."""
        command = [*_COMMAND, "--runtime-base", str(self._base), *words]
        quiet = subprocess.DEVNULL
        return subprocess.Popen(command, stdout=quiet, stderr=quiet)

    def end(self, job: "subprocess.Popen[bytes]") -> None:
        """End a command as Ctrl-C does."""
        if job.poll() is None:
            job.send_signal(signal.SIGINT)
        try:
            job.wait(_ACT_S)
        except subprocess.TimeoutExpired:
            job.kill()
            job.wait()

    def orphans(self) -> list[str]:
        """Return every process of a run that is no more, or of this one and of no row of it.

        Who comes or goes while the table is being told is looked at twice.
        """
        suspects = self._strays()
        if not suspects:
            return []
        self._clock.sleep_until(self._clock.now_ns() + _TABLE_NS)
        again = self._strays()
        return [suspect for suspect in suspects if suspect in again]

    def close(self) -> None:
        """End the service in order."""
        self._runner.stop()
        self._detach()

    def _strays(self) -> list[str]:
        owner = running(self._base)
        table = self._document("process_table", _FRESH_S)
        rows = None if table is None else {row["pid"] for row in table["processes"] if row["pid"]}
        return strays(str(self._base), "" if owner is None else owner.run_id, rows)

    def _started(self) -> ServiceRunner:
        environment = {**os.environ, MARK: str(self._base)}
        runner = ServiceRunner(
            self._command, environment, watchdog_s=watchdog_s(), restart_s=RESTART_S
        )
        runner.start()
        return runner

    def _do(self, act: OperatorActName, wanted: tuple[str, ...]) -> None:
        """Do an act again and again, as a person would, until control is where it should be."""
        deadline_ns = self._clock.now_ns() + round(_ACT_S * NS_PER_S)
        while self.control_state() not in wanted:
            if self._clock.now_ns() > deadline_ns:
                status = self._document("control_status", _FRESH_S)
                raise ServiceNotReady(
                    f"{act}: control is not {' or '.join(wanted)}: {json.dumps(status)}"
                )
            self._attached().operate(act)
            soon_ns = self._clock.now_ns() + round(_AGAIN_S * NS_PER_S)
            while self.control_state() not in wanted and self._clock.now_ns() < soon_ns:
                self._clock.sleep_until(self._clock.now_ns() + _POLL_NS)

    def _await(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        deadline_ns = self._clock.now_ns() + round(timeout_s * NS_PER_S)
        while not condition():
            if self._clock.now_ns() > deadline_ns:
                table = self._document("process_table", _FRESH_S)
                report = self._runner.report
                raise ServiceNotReady(
                    f"{what} after {timeout_s:g} s: {report}, {json.dumps(table)}"
                )
            self._clock.sleep_until(self._clock.now_ns() + _POLL_NS)

    def _document(self, topic: str, age_limit_s: float) -> dict[str, Any] | None:
        try:
            return self._attached().document(topic, age_limit_s)
        except (ServiceNotReady, IpcError, OSError):
            return None  # the run is about to come or to go

    def _attached(self) -> RobotSession:
        """Return a session with the run that goes on now."""
        owner = running(self._base)
        if owner is None:
            self._detach()
            raise ServiceNotReady(f"no robot runs in {self._base}")
        run_dir = Path(owner.run_dir)
        if self._session is None or self._session.run_dir != run_dir:
            self._detach()
            self._session = RobotSession(run_dir, self._clock)
        return self._session

    def _detach(self) -> None:
        if self._session is not None:
            self._session.close()
        self._session = None
