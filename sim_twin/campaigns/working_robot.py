"""Run the robot's real processes with their twin, and be its user, its operator and its meter."""

import itertools
import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from sim_twin.campaigns.talk import CommandTalk
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.referee import ask, told_hazards
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.supervisor.processes.lifecycle import is_settled
from vla_deploy.supervisor.runs.runtime import running

_START_S: Final = 120.0
_END_S: Final = 40.0
_SWITCH_S: Final = 90.0
_POLL_S: Final = 0.05
_FRESH_S: Final = 3.0
_FRESH_STATUS_S: Final = 1.0
_FIRST_MOTION: Final = 1_000_000
_LAST_WORDS: Final = 8


class RobotFailed(Exception):
    """Say that the robot did not come up, or went away."""


class WorkingRobot:
    """Own one run of the robot in `base`."""

    def __init__(
        self,
        base: Path,
        clock: Clock,
        *options: str,
        log: Path,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start it; `options` are further words for `sim_twin.campaigns.hosted`.

        Raises:
            RobotFailed: it does not come up and arm.
        """
        self.base = base
        self.clock = clock
        self._log = log
        words = ("-m", "sim_twin.campaigns.hosted", "--base", str(base), *options)
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                [sys.executable, *words],
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, **(environment or {})},
                start_new_session=True,
            )
        self._session: RobotSession | None = None
        self._motions = itertools.count(_FIRST_MOTION)
        try:
            self._come_up()
        except BaseException:
            self.close()
            raise

    # --- look ---------------------------------------------------------------------------------

    @property
    def run_dir(self) -> Path:
        """Return the directory of the run."""
        return self._attached.run_dir

    def document(self, topic: str, age_limit_s: float = _FRESH_S) -> dict[str, Any]:
        """Return the newest document of a cell, empty when there is none that young."""
        return self._attached.document(topic, age_limit_s) or {}

    def state(self) -> str:
        """Return control's state, "silent" where it tells none."""
        return self.state_and_why()[0]

    def state_and_why(self) -> tuple[str, str]:
        """Return control's state, "silent" where it tells none, and what it says of it."""
        status = self.document("control_status", _FRESH_STATUS_S)
        return str(status.get("state", "silent")), str(status.get("detail", ""))

    def ticks(self) -> TickWatch:
        """Return what control has counted since it started."""
        status = self.document("control_status")
        return TickWatch(ticks=int(status.get("tick", 0)), late=int(status.get("late_ticks", 0)))

    def setpoint(self) -> list[float]:
        """Return what control sent to the joints last."""
        sample = self._attached.fresh("joint_state")
        return [] if sample is None else [float(one) for one in sample.data["setpoint"]]

    def pids(self) -> dict[str, int]:
        """Return every process that runs, the supervisor too."""
        table = self.document("process_table")
        rows = {row["name"]: row["pid"] for row in table.get("processes", ()) if row["pid"]}
        return {**rows, "supervisor": table["supervisor_pid"]} if table else {}

    def memory_mib(self) -> dict[str, float]:
        """Return the memory of its own that each process holds; what is shared fills up once."""
        return {name: _anonymous_mib(pid) for name, pid in self.pids().items()}

    def is_ready(self) -> bool:
        """Return whether every process that should run is ready, and control armed."""
        table = self.document("process_table")
        return bool(table) and is_settled(table) and self.state() == "armed"

    def begin_watch(self) -> None:
        """Let the referee forget the hazards seen so far."""
        ask(self.run_dir, "hazards", begin="yes")

    def hazards(self) -> tuple[str, ...]:
        """Return what was unsafe in physics since the watch began."""
        return told_hazards(self.run_dir)

    # --- act ----------------------------------------------------------------------------------

    def go(self, **targets: float) -> None:
        """Send joints somewhere, past the executor: it must be idle."""
        motion_id = next(self._motions)
        self._goals.publish(
            {"kind": "goal", "motion_id": motion_id, "targets": targets, "speed_ratio": 1.0}
        )

    def use_profile(self, path: Path, meanwhile: Callable[[], object]) -> dict[str, Any]:
        """Ask for a profile, as `vla-deploy profile use` does, and return how that ended."""
        request_id = uuid.uuid4().hex
        self._requests.publish({"request_id": request_id, "profile": str(path)})

        def last() -> dict[str, Any]:
            meanwhile()
            told: dict[str, Any] = self.document("profile_status").get("last", {})
            return told if told.get("request_id") == request_id else {}

        if not self.wait_until(lambda: bool(last()), _SWITCH_S):
            return {"outcome": "no answer", "reason": f"none within {_SWITCH_S:g} s"}
        return last()

    def talk(self) -> CommandTalk:
        """Return a way to give commands."""
        space = self._space
        events = space.ring_reader(topics.TASK_EVENT, from_start=False)
        return CommandTalk(space.ring_writer(topics.UTTERANCE), events, self.clock)

    def wait_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Return whether something came true in time.

        Raises:
            RobotFailed: the run ended meanwhile.
        """
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while not condition():
            if self._process.poll() is not None:
                raise RobotFailed(f"the run ended: {self._last_words()}")
            if self.clock.now_ns() > end_ns:
                return False
            self.pause(_POLL_S)
        return True

    def pause(self, duration_s: float) -> None:
        """Let time pass."""
        self.clock.sleep_until(self.clock.now_ns() + round(duration_s * NS_PER_S))

    def close(self) -> None:
        """End the run in order."""
        if self._session is not None:
            self._session.close()
            self._space.close()
            self._session = None
        if self._process.poll() is None:
            self._process.terminate()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    # --- within -------------------------------------------------------------------------------

    @property
    def _attached(self) -> RobotSession:
        if self._session is None:
            raise RobotFailed("the run is over")
        return self._session

    def _come_up(self) -> None:
        if not self.wait_until(self._attach, _START_S):
            raise RobotFailed(f"no run after {_START_S:g} s: {self._last_words()}")
        if not self.wait_until(self.is_ready, _START_S):
            raise RobotFailed(
                f"control is {self.state()} after {_START_S:g} s: {self._last_words()}"
            )

    def _attach(self) -> bool:
        owner = running(self.base)
        if owner is None or not (Path(owner.run_dir) / "ipc").exists():
            return False
        self._session = RobotSession(Path(owner.run_dir), self.clock)
        self._space = SharedSpace(Path(owner.run_dir) / "ipc", self.clock)
        self._goals = self._space.ring_writer(topics.MOTION_COMMAND)
        self._requests = self._space.ring_writer(topics.PROFILE_REQUEST)
        return True

    def _last_words(self) -> str:
        lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines()
        return " | ".join(lines[-_LAST_WORDS:])


def _anonymous_mib(pid: int) -> float:
    """Return a process' private memory.

    Raises:
        RobotFailed: the process is gone.
    """
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, ProcessLookupError) as error:
        raise RobotFailed(f"process {pid} ended while it was measured") from error
    fields = dict(line.split(":", 1) for line in lines)
    return int(fields["RssAnon"].split()[0]) / 1024
