"""Ask a robot, operate it and wait for it in the same words in every form of the harness."""

import itertools
import json
import os
import signal
import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Final

import psutil

from drivers.clock import NS_PER_S, Clock
from vla_deploy.cli.session import RobotSession
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import Topic, topics
from vla_deploy.ipc.payloads.motion import GoalMotion, OperatorActName
from vla_deploy.supervisor.processes.lifecycle import is_settled
from vla_deploy.supervisor.runs.runtime import environment_of

VLA_DEPLOY: Final = (sys.executable, "-m", "vla_deploy.cli")
ARM_S: Final = 30.0
_WAY: Final[Mapping[str, OperatorActName]] = {
    "stopped": "reset",
    "fault": "reset",
    "disarmed": "arm",
}
"""The act that leads from a state towards being armed; elsewhere control is under way."""
_AGAIN_S: Final = 0.5
_FIRST_MOTION: Final = 1_000_000
"""Its id is far from the executor's."""
_ANSWER_S: Final = 600.0
"""By the wall clock, and so for a busy computer: a command line that hangs ends with the test."""
_FRESH_S: Final = 3.0
_INTERRUPTED_S: Final = 20.0


class RobotFailed(Exception):
    """Say that the robot does not come up, does not arm, does not answer, or has ended."""


class RobotUnderTest(ABC):
    """Read what control publishes, and lead it to where it is armed; spans are of `clock`."""

    clock: Clock
    poll_s: ClassVar[float] = 0.02
    status_age_limit_s: ClassVar[float | None] = 1.0
    """Control counts as silent where its newest status is older."""

    @property
    @abstractmethod
    def link(self) -> RobotLink:
        """Return the way to the robot's topics."""

    @abstractmethod
    def close(self) -> None:
        """End the robot in order; ending twice is allowed."""

    def document(self, topic: Topic[Any] | str, age_limit_s: float | None = None) -> dict[str, Any]:
        """Return the newest document of a cell, empty when there is none that young."""
        return self.link.document(topic, age_limit_s) or {}

    def control_status(self) -> dict[str, Any]:
        """Return what control says of itself, empty where it is silent."""
        return self.document(topics.CONTROL_STATUS, self.status_age_limit_s)

    def state(self) -> str:
        """Return control's state, "silent" where it publishes none."""
        return str(self.control_status().get("state", "silent"))

    def arm(self, timeout_s: float = ARM_S) -> None:
        """Lead control to where it is armed, from wherever it is.

        Raises:
            RobotFailed: control stays elsewhere.
        """
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while (state := self.state()) != "armed":
            if self.clock.now_ns() > end_ns:
                status = json.dumps(self.document(topics.CONTROL_STATUS))
                raise RobotFailed(f"control is not armed after {timeout_s:g} s: {status}")
            if state in _WAY:
                self.link.operate(_WAY[state])
            self.await_change(state)

    def await_change(self, state: str) -> None:
        """Return once control is not in this state any more, or after half a second."""
        self.wait_until(lambda: self.state() != state, _AGAIN_S)

    @cached_property
    def _motions(self) -> Iterator[int]:
        return itertools.count(_FIRST_MOTION)

    def go(
        self,
        targets: Mapping[str, float],
        speed_ratio: float = 1.0,
        effort_ratio: Mapping[str, float] | None = None,
    ) -> None:
        """Send joints somewhere, past the executor: it must be idle."""
        goal: GoalMotion = {
            "kind": "goal",
            "motion_id": next(self._motions),
            "targets": dict(targets),
            "speed_ratio": speed_ratio,
        }
        if effort_ratio is not None:
            goal["effort_ratio"] = dict(effort_ratio)
        self.link.writer(topics.MOTION_COMMAND).publish(goal)

    def wait_until(self, condition: Callable[[], object], timeout_s: float = 60.0) -> bool:
        """Return whether `condition()` came true in time."""
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while not condition():
            if self.clock.now_ns() > end_ns:
                return False
            self.pause(self.poll_s)
        return True

    def pause(self, duration_s: float) -> None:
        """Wait for a time of the robot's clock."""
        self.clock.sleep_until(self.clock.now_ns() + round(duration_s * NS_PER_S))

    def since_s(self, began_ns: int) -> float:
        """Return how long ago a moment of `clock` was."""
        return (self.clock.now_ns() - began_ns) / NS_PER_S


class RunningRobot(RobotUnderTest):
    """Be the user, the operator and the adversary of a robot whose processes run in `base`."""

    base: Path

    @property
    @abstractmethod
    def session(self) -> RobotSession:
        """Return the way to the run's shared memory."""

    @property
    def link(self) -> RobotLink:
        """Return the way to the robot's topics."""
        return self.session

    # --- as a user ----------------------------------------------------------------------------

    def ask(self, *words: str) -> "subprocess.CompletedProcess[str]":
        """Run `vla-deploy WORDS` to its end."""
        return subprocess.run(
            self._command(*words), capture_output=True, text=True, timeout=_ANSWER_S, check=False
        )

    def begin(self, *words: str, output: int = subprocess.PIPE) -> "subprocess.Popen[str]":
        """Start `vla-deploy WORDS` and do not wait for it."""
        return subprocess.Popen(self._command(*words), stdout=output, stderr=output, text=True)

    def interrupt(self, job: "subprocess.Popen[str]") -> None:
        """End a command as Ctrl-C does."""
        if job.poll() is None:
            job.send_signal(signal.SIGINT)
        end_process(job, _INTERRUPTED_S)

    def _command(self, *words: str) -> list[str]:
        return [*VLA_DEPLOY, "--runtime-base", str(self.base), *words]

    # --- as an adversary ----------------------------------------------------------------------

    def is_ready(self) -> bool:
        """Return whether every process that should run is ready."""
        table = self.document(topics.PROCESS_TABLE, _FRESH_S)
        return bool(table) and is_settled(table)

    def row(self, name: str) -> dict[str, Any]:
        """Return a process' row of the supervisor's table.

        Raises:
            KeyError: there is no such process.
        """
        rows = {row["name"]: row for row in self.document(topics.PROCESS_TABLE)["processes"]}
        row: dict[str, Any] = rows[name]
        return row

    def pids(self) -> dict[str, int]:
        """Return the id of every process that runs, the supervisor's too."""
        table = self.document(topics.PROCESS_TABLE, _FRESH_S)
        rows = {row["name"]: row["pid"] for row in table.get("processes", ()) if row["pid"]}
        return {**rows, "supervisor": table["supervisor_pid"]} if table else {}

    def is_back(self, name: str, pid: int, timeout_s: float = 60.0) -> bool:
        """Return whether another process took the place of `pid` in time, and is ready.

        Raises:
            KeyError: there is no such process.
        """

        def is_ready() -> bool:
            row = self.row(name)
            return row["pid"] not in (pid, None) and row["state"] == "ready"

        return self.wait_until(is_ready, timeout_s)

    def send_signal(self, name: str, number: signal.Signals) -> int:
        """Send a signal to one process, and return its id.

        Raises:
            RobotFailed: it does not run.
        """
        pid = self.pids().get(name)
        if not pid:  # kill(2) would take 0 for everyone in our own process group
            raise RobotFailed(f"{name} does not run, so it cannot get {number.name}")
        os.kill(pid, number)
        return pid

    def kill(self, name: str) -> None:
        """End a process as `kill -9` does.

        Raises:
            RobotFailed: it does not run.
        """
        self.send_signal(name, signal.SIGKILL)

    def freeze(self, name: str) -> None:
        """Freeze a process: it neither runs nor ends, as on a machine that hangs.

        Raises:
            RobotFailed: it does not run.
        """
        self.send_signal(name, signal.SIGSTOP)

    def thaw(self, name: str) -> None:
        """Resume a frozen process.

        Raises:
            RobotFailed: it does not run.
        """
        self.send_signal(name, signal.SIGCONT)


def marked(variable: str, value: str) -> list[psutil.Process]:
    """Return every process in whose environment a variable has a value."""
    return [
        process
        for process in psutil.process_iter()
        if environment_of(process).get(variable) == value
    ]


def end_process(process: "subprocess.Popen[Any]", timeout_s: float) -> None:
    """Wait for the end of a process; after the time limit, kill it."""
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
