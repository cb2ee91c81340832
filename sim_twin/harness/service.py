"""Run the robot as a service on a machine that outlives it: a twin in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any, Final

import psutil

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.twin_clock import TwinClock
from drivers.twin_page import TwinPace
from sim_twin.errors import TwinError, TwinUnreachable
from sim_twin.harness.robot import VLA_DEPLOY, RobotFailed, RunningRobot, end_process
from sim_twin.harness.service_runner import RunnerState, ServiceRules, ServiceRunner
from sim_twin.process import READY_FILE
from sim_twin.referee import RemoteReferee
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import IpcError, Topic, topics
from vla_deploy.runtime.logs import RUN_ID_VARIABLE
from vla_deploy.supervisor.runs.runtime import PROCESS_VARIABLE, environment_of, running
from vla_deploy.supervisor.systemd import RESTART_S, watchdog_s

_MACHINE_READY_S: Final = 90.0
_MACHINE_END_S: Final = 10.0
_READY_S: Final = 120.0
_ARM_S: Final = 40.0
_FRESH_S: Final = 3.0
_POLL_NS: Final = NS_PER_S // 20
_TABLE_S: Final = 1.0  # twice as long as the table grows old


class Machine(RemoteReferee):
    """Own the process of one twin; the robot finds its devices in `devices_dir`."""

    def __init__(self, run_dir: Path, *, robot: str, seed: int) -> None:
        """Start the twin and return when it serves every device.

        Raises:
            TwinError: it ended, or is not ready in time.
        """
        self.run_dir, self.robot = run_dir, robot
        command = ["-m", "sim_twin", "--robot", robot, "--seed", str(seed), "--pace", TwinPace.REAL]
        command += ["--run-dir", str(run_dir), "--parent-pid", str(os.getpid())]
        self._process = subprocess.Popen([sys.executable, *command], start_new_session=True)
        try:
            self._wait_until_ready()
        except BaseException:
            self.close()
            raise
        self.clock = TwinClock(self.devices_dir)
        """The twin's time, by which the robot lives, too."""

    @property
    def devices_dir(self) -> Path:
        """Return where the devices are."""
        return self.run_dir / "dev"

    def close(self) -> None:
        """End the twin; ending twice is allowed."""
        if self._process.poll() is None:
            self._process.terminate()
        end_process(self._process, _MACHINE_END_S)

    def _wait_until_ready(self) -> None:
        clock = MonotonicClock()  # there is no twin yet whose time could be used
        deadline_ns = clock.now_ns() + round(_MACHINE_READY_S * NS_PER_S)
        while not self._is_ready():
            if self._process.poll() is not None:
                raise TwinError(f"the twin ended with exit code {self._process.returncode}")
            if clock.now_ns() > deadline_ns:
                raise TwinError(
                    f"the twin under {self.run_dir} is not ready after {_MACHINE_READY_S:g} s"
                )
            clock.sleep_until(clock.now_ns() + _POLL_NS)

    def _is_ready(self) -> bool:
        path = self.devices_dir / READY_FILE
        if not path.is_file():
            return False
        try:
            self.truth()
        except TwinUnreachable:
            return False
        return bool(json.loads(path.read_text(encoding="utf-8")))


class RobotService(RunningRobot):
    """Hold the service of one robot whose devices are in `devices_dir`."""

    poll_s = 0.05
    status_age_limit_s = 0.5

    def __init__(self, base: Path, devices_dir: Path, clock: Clock, robot: str = "butler") -> None:
        """Start the service; it restarts and is watched for ever."""
        base.mkdir(parents=True, exist_ok=True)
        self.base = base
        self.clock = clock
        self._session: RobotSession | None = None
        self._devices_dir = devices_dir
        self._robot = robot
        self._runner = self._started()

    def make_ready(self) -> None:
        """Start the service if it has ended, wait for every process, then reset and arm.

        Raises:
            RobotFailed: it does not come up, or control does not arm.
        """
        if self.has_ended():
            self._runner.stop()  # what it holds of an ended service goes too
            self._runner = self._started()
        if not self.wait_until(self.is_ready, _READY_S):
            table = json.dumps(self.document(topics.PROCESS_TABLE, _FRESH_S))
            raise RobotFailed(
                f"not every process is ready after {_READY_S:g} s: {self._runner.report}, {table}"
            )
        self.arm(_ARM_S)

    def has_ended(self) -> bool:
        """Return whether the service has ended as a person wanted, and is not started again."""
        return self._runner.state is RunnerState.INACTIVE

    def skill(self) -> str:
        """Return which skill the executor is at, empty where it is at none."""
        return str(self.document(topics.EXECUTOR_STATUS, _FRESH_S).get("skill") or "")

    def why(self) -> str:
        """Return the cause of control's state, and what it says of it."""
        status = self.control_status()
        return f"{status.get('cause')}: {status.get('detail')}"

    def orphans(self) -> list[str]:
        """Return every process of a run that is no more, or of this one and of no row of it.

        What comes or goes while the table is published is looked at twice.
        """
        suspects = self._strays()
        if not suspects:
            return []
        self.pause(_TABLE_S)
        again = self._strays()
        return [suspect for suspect in suspects if suspect in again]

    def close(self) -> None:
        """End the service in order."""
        self._runner.stop()
        self._detach()

    @property
    def session(self) -> RobotSession:
        """Return a session with the run that goes on now.

        Raises:
            RobotFailed: none does.
        """
        owner = running(self.base)
        if owner is None:
            self._detach()
            raise RobotFailed(f"no robot runs in {self.base}")
        run_dir = Path(owner.run_dir)
        if self._session is None or self._session.run_dir != run_dir:
            self._detach()
            self._session = RobotSession(run_dir, self.clock)
        return self._session

    def document(self, topic: Topic[Any] | str, age_limit_s: float | None = None) -> dict[str, Any]:
        """Return the newest document of a cell, empty when there is none that young."""
        try:
            return super().document(topic, age_limit_s)
        except (RobotFailed, IpcError, OSError):
            return {}  # the run is about to come or to go

    def _strays(self) -> list[str]:
        owner = running(self.base)
        table = self.document(topics.PROCESS_TABLE, _FRESH_S)
        rows = {row["pid"] for row in table["processes"] if row["pid"]} if table else None
        return strays(self._runner.members(), "" if owner is None else owner.run_id, rows)

    def _started(self) -> ServiceRunner:
        words = ["--runtime-base", str(self.base), "run", "--robot", self._robot]
        words += ["--devices-dir", str(self._devices_dir)]
        rules = ServiceRules(watchdog_s=watchdog_s(), restart_s=RESTART_S)
        runner = ServiceRunner([*VLA_DEPLOY, *words], os.environ, rules, self.clock)
        runner.start()
        return runner

    def _detach(self) -> None:
        if self._session is not None:
            self._session.close()
        self._session = None


def strays(
    members: Iterable[psutil.Process], run_id: str, rows: Collection[int] | None
) -> list[str]:
    """Return each process of a robot that is of another run, or of no row of this one.

    `rows` are the pids of the process table; without them this run cannot be judged. A row answers
    for its process, for what descends from that, and for its session: not for what an earlier
    process of the same row has left.
    """
    found = (_stray(process, run_id, rows) for process in members)
    return [stray for stray in found if stray]


def _stray(process: psutil.Process, run_id: str, rows: Collection[int] | None) -> str:
    environment = environment_of(process)
    its_run = environment.get(RUN_ID_VARIABLE)
    if its_run is None:  # none of a run, or it has ended meanwhile
        return ""
    if its_run != run_id:
        return f"{process.pid} of run {its_run}"
    try:
        if rows is None or _answers_for(process) & set(rows):
            return ""
    except (psutil.AccessDenied, psutil.NoSuchProcess, ProcessLookupError):
        return ""  # it has ended meanwhile
    return f"{process.pid} of this run and no row, left by {environment.get(PROCESS_VARIABLE)}"


def _answers_for(process: psutil.Process) -> set[int]:
    """Return the pids one of which has to be a row's."""
    ancestors = {ancestor.pid for ancestor in process.parents()}
    return {process.pid, os.getsid(process.pid), *ancestors}
