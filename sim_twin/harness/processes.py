"""Run the real processes on a twin as a user does, and talk to them by the command line."""

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

import psutil

from drivers.audio.base import Samples
from drivers.clock import MonotonicClock
from drivers.twin_clock import clock_of
from sim_twin.harness.remote_faults import RemoteFaults
from sim_twin.harness.robot import VLA_DEPLOY, RobotFailed, RunningRobot, marked
from sim_twin.physics.truth import fastest_joint
from sim_twin.referee import RemoteReferee
from sim_twin.sound.talk import said, talk
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import topics
from vla_deploy.runtime.logs import RUN_ID_VARIABLE
from vla_deploy.supervisor.runs.runtime import end_leftovers

_READY: Final = "ready;"
"""How the line begins by which a run says that all processes are ready."""
_END_S: Final = 120.0
"""By the wall clock, and so for a busy computer: a process that hangs ends with the test."""
_FRESH_S: Final = 1.0
_TAKERS: Final = (topics.PLANNER_STATUS, topics.EXECUTOR_STATUS)
_LAST_WORDS: Final = 8


class ProcessStack(RunningRobot, RemoteReferee):
    """Hold one `vla-deploy run --twin` in a runtime directory of its own.

    All spans are of the twin's time, which waits for the robot's processes: a busy machine takes
    longer, and nothing else changes.
    """

    program: ClassVar[tuple[str, ...]] = VLA_DEPLOY
    act: ClassVar[tuple[str, ...]] = ("run", "--twin")
    errors: ClassVar[int | None] = None
    """Where standard error goes; None is that of the test."""

    def __init__(
        self,
        base: Path,
        *options: str,
        log: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start the processes; `options` are further words for the run.

        What it prints goes into `log`, beside `base` unless given.
        """
        self.base = base
        self.run_dir = base
        self.clock = MonotonicClock()  # until the run is ready: the clock of the run
        self._log = log or base.with_name(f"{base.name}.log")
        self._session: RobotSession | None = None
        self._begun: list[subprocess.Popen[str]] = []
        with self._log.open("wb") as output:
            self.process = subprocess.Popen(
                [*self.program, "--runtime-base", str(base), *self.act, *options],
                stdout=output,
                stderr=self.errors,
                env={**os.environ, **(environment or {})},
                start_new_session=True,
            )

    def wait_until_ready(self) -> None:
        """Return once all processes run; control arms next, unless something stops it.

        Raises:
            RobotFailed: the run ended.
        """
        while not any(line.startswith(_READY) for line in self._said()):
            if self.process.poll() is not None:
                raise RobotFailed(f"the run ended before it was ready: {self.last_words()}")
            self.pause(self.poll_s)
        self.run_dir = (self.base / "current").resolve()
        self.clock = clock_of(self.run_dir)

    def wait_until_armed(self) -> None:
        """Return once the robot takes commands.

        Raises:
            RobotFailed: the run ended, control does not arm, or nobody plans or carries out.
        """
        self.wait_until_ready()
        if not self.wait_until(lambda: self.state() == "armed"):
            raise RobotFailed(f"control does not arm: {self.status()['control']}")
        for topic in _TAKERS:
            if not self.wait_until(partial(self.document, topic, _FRESH_S)):
                raise RobotFailed(f"{topic.name} is silent: {self.status()['process_table']}")

    @property
    def session(self) -> RobotSession:
        """Return the way to the run's shared memory."""
        if self._session is None:
            self._session = RobotSession(self.run_dir, self.clock)
        return self._session

    # --- as a user ----------------------------------------------------------------------------

    def begin(self, *words: str, output: int = subprocess.PIPE) -> "subprocess.Popen[str]":
        """Start `vla-deploy WORDS` and do not wait for it; it ends with the run at the latest."""
        self._begun.append(super().begin(*words, output=output))
        return self._begun[-1]

    def say(self, text: str) -> dict[str, Any]:
        """Give a command, wait for its end and return its last event.

        Raises:
            RobotFailed: there is no outcome, as when nobody answers.
        """
        done = self.ask("say", "--json", text)
        if not done.stdout:
            raise RobotFailed(done.stderr.strip())
        outcome: dict[str, Any] = json.loads(done.stdout)
        return outcome

    def operate(self, act: str) -> None:
        """Do an operator's act: estop, reset, arm, disarm or stop.

        Raises:
            RobotFailed: it was refused.
        """
        done = self.ask(act)
        if done.returncode:
            raise RobotFailed(done.stderr.strip())

    def status(self) -> dict[str, Any]:
        """Return what `vla-deploy status --json` tells."""
        document: dict[str, Any] = json.loads(self.ask("status", "--json").stdout)
        return document

    def speak(self, text: str, voice: str = "en-gb", snr_db: float | None = None) -> dict[str, Any]:
        """Play a text as said by a person in the room; return its begin and end, host's time.

        Raises:
            TwinError: the twin does not answer, or the robot has no microphone.
            VoiceError: the words do not become sound.
        """
        return talk(self.run_dir, text, voice, snr_db=snr_db)

    def fastest_rad_s(self) -> float:
        """Return the speed of the fastest joint, by physics."""
        return fastest_joint(self.truth())[1]

    def said(self) -> Samples:
        """Return what the robot's speaker has played since the last call, (n, channels)."""
        return said(self.run_dir)

    @property
    def faults(self) -> RemoteFaults:
        """Return the way to make the twin's devices fail."""
        return RemoteFaults(self.run_dir)

    # --- its end ------------------------------------------------------------------------------

    def last_words(self) -> str:
        """Return the end of what the run has printed."""
        return " | ".join(self._said()[-_LAST_WORDS:])

    def members(self) -> list[psutil.Process]:
        """Return every process that carries the run's id, the supervisor's descendants or not."""
        return marked(RUN_ID_VARIABLE, self.run_dir.name)

    def close(self) -> None:
        """End the run in order; ending twice is allowed.

        Raises:
            RobotFailed: it did not end in time, and was killed.
        """
        self._let_go()
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(_END_S)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            raise RobotFailed(
                f"the run did not end within {_END_S:g} s and was killed: {self.last_words()}"
            ) from None

    def cut(self) -> None:
        """End the run as a power cut does: its end in order takes longer than many a test."""
        if self.run_dir == self.base:  # it has not come up: only the supervisor knows its parts
            self.close()
            return
        self._let_go()
        self.process.kill()
        self.process.wait()
        members = self.members()
        end_leftovers(self.run_dir.name)
        psutil.wait_procs(members, timeout=_END_S)
        shutil.rmtree((self.run_dir / "ipc").resolve(), ignore_errors=True)

    def _said(self) -> list[str]:
        return self._log.read_text(encoding="utf-8", errors="replace").splitlines()

    def _let_go(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None
        for begun in self._begun:
            begun.kill()  # nothing, where it has ended
            begun.communicate()  # closes its pipes, too
        self._begun.clear()


@contextmanager
def armed_processes(base: Path, *options: str) -> Iterator[ProcessStack]:
    """Give the real processes, armed, and cut them off at the end.

    Raises:
        RobotFailed: they do not come up and arm.
    """
    stack = ProcessStack(base, *options)
    try:
        stack.wait_until_armed()
        yield stack
    finally:
        stack.cut()
