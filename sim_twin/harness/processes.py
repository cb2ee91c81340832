"""Run the real processes on a twin as a user does, and talk to them by the command line."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import psutil

from drivers.audio.base import Samples
from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.twin_clock import clock_of
from sim_twin.faults.remote import RemoteFaults
from sim_twin.physics.truth import fastest_joint
from sim_twin.referee import ask
from sim_twin.sound.talk import said, talk
from vla_deploy.cli.session import RobotSession
from vla_deploy.supervisor.runs.runtime import end_leftovers, run_id_of

_COMMAND: Final = (sys.executable, "-m", "vla_deploy.cli")
_POLL_NS: Final = NS_PER_S // 50
_ANSWER_S: Final = 600.0
_END_S: Final = 120.0
"""By the wall clock, and so for a busy computer: a process that hangs ends with the test."""
_FRESH_S: Final = 1.0
_TAKERS: Final = ("planner_status", "executor_status")


class StackFailed(Exception):
    """Say that the processes did not come up, or that a command line was refused."""


class ProcessStack:
    """Hold one `vla-deploy run --twin` in a runtime directory of its own.

    All spans are of the twin's time, which waits for the robot's processes: a busy machine takes
    longer, and nothing else changes.
    """

    def __init__(self, base: Path, *options: str) -> None:
        """Start the processes; `options` are further words for `vla-deploy run`."""
        self.base = base
        self.run_dir = base
        self.clock: Clock = MonotonicClock()
        """The clock of the run, once it is ready."""
        self._session: RobotSession | None = None
        self._begun: list[subprocess.Popen[str]] = []
        self.process = subprocess.Popen(
            self._words("run", "--twin", *options),
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait_until_ready(self) -> None:
        """Return once all processes run; control arms next, unless something stops it.

        Raises:
            StackFailed: the run ended.
        """
        assert self.process.stdout is not None
        if not any(line.startswith("ready;") for line in iter(self.process.stdout.readline, "")):
            raise StackFailed("the run ended before it was ready; its last words are on stderr")
        self.run_dir = (self.base / "current").resolve()
        self.clock = clock_of(self.run_dir)

    def wait_until_armed(self) -> None:
        """Return once the robot takes commands.

        Raises:
            StackFailed: the run ended, control does not arm, or nobody plans or carries out.
        """
        self.wait_until_ready()
        if not self.wait_until(lambda: self.state() == "armed"):
            raise StackFailed(f"control does not arm: {self.status()['control']}")
        for topic in _TAKERS:
            if not self.wait_until(partial(self.document, topic, _FRESH_S)):
                raise StackFailed(f"{topic} is silent: {self.status()['process_table']}")

    # --- as a user ----------------------------------------------------------------------------

    def ask(self, *words: str) -> "subprocess.CompletedProcess[str]":
        """Run `vla-deploy WORDS` to its end."""
        return subprocess.run(
            self._words(*words), capture_output=True, text=True, timeout=_ANSWER_S, check=False
        )

    def begin(self, *words: str) -> "subprocess.Popen[str]":
        """Start `vla-deploy WORDS` and do not wait for it; it ends with the run at the latest."""
        pipe = subprocess.PIPE
        begun = subprocess.Popen(self._words(*words), stdout=pipe, stderr=pipe, text=True)
        self._begun.append(begun)
        return begun

    def say(self, text: str) -> dict[str, Any]:
        """Give a command, wait for its end and return its last event.

        Raises:
            StackFailed: there is no outcome, as when nobody answers.
        """
        done = self.ask("say", "--json", text)
        if not done.stdout:
            raise StackFailed(done.stderr.strip())
        outcome: dict[str, Any] = json.loads(done.stdout)
        return outcome

    def operate(self, act: str) -> None:
        """Do an operator's act: estop, reset, arm, disarm or stop.

        Raises:
            StackFailed: it was refused.
        """
        done = self.ask(act)
        if done.returncode:
            raise StackFailed(done.stderr.strip())

    def status(self) -> dict[str, Any]:
        """Return what `vla-deploy status --json` tells."""
        document: dict[str, Any] = json.loads(self.ask("status", "--json").stdout)
        return document

    def state(self) -> str:
        """Return control's state, "silent" where control tells none."""
        return str(self.document("control_status", _FRESH_S).get("state", "silent"))

    def document(self, topic: str, age_limit_s: float | None = None) -> dict[str, Any]:
        """Return the newest document of a cell, empty when there is none that young."""
        return self.session.document(topic, age_limit_s) or {}

    @property
    def session(self) -> RobotSession:
        """Return the way to the run's shared memory."""
        if self._session is None:
            self._session = RobotSession(self.run_dir, self.clock)
        return self._session

    def speak(self, text: str, voice: str = "en-gb", snr_db: float | None = None) -> dict[str, Any]:
        """Let somebody in the room say a text; return when the words begin and end, host's time.

        Raises:
            TwinError: the twin does not answer, or the robot has no microphone.
            VoiceError: the words do not become sound.
        """
        return talk(self.run_dir, text, voice, snr_db=snr_db)

    def said(self) -> Samples:
        """Return what the robot's speaker has played since the last call, (n, channels)."""
        return said(self.run_dir)

    # --- as an adversary ----------------------------------------------------------------------

    def row(self, name: str) -> dict[str, Any]:
        """Return a process' row of the supervisor's table.

        Raises:
            KeyError: there is no such process.
        """
        rows = {row["name"]: row for row in self.document("process_table")["processes"]}
        row: dict[str, Any] = rows[name]
        return row

    def is_back(self, name: str, pid: int, timeout_s: float = 60.0) -> bool:
        """Return whether another process took the place of `pid` in time, and is ready.

        Raises:
            KeyError: there is no such process.
        """

        def is_ready() -> bool:
            row = self.row(name)
            return row["pid"] not in (pid, None) and row["state"] == "ready"

        return self.wait_until(is_ready, timeout_s)

    def kill(self, name: str) -> None:
        """End a process as `kill -9` does.

        Raises:
            KeyError: there is no such process.
        """
        self._signal(name, signal.SIGKILL)

    def freeze(self, name: str) -> None:
        """Let a process neither run nor end, as a machine that hangs would.

        Raises:
            KeyError: there is no such process.
        """
        self._signal(name, signal.SIGSTOP)

    def thaw(self, name: str) -> None:
        """Let a frozen process go on.

        Raises:
            KeyError: there is no such process.
        """
        self._signal(name, signal.SIGCONT)

    def _signal(self, name: str, number: signal.Signals) -> None:
        os.kill(self.row(name)["pid"], number)

    @property
    def faults(self) -> RemoteFaults:
        """Return the way to make the twin's devices fail."""
        return RemoteFaults(self.run_dir)

    # --- as the judge -------------------------------------------------------------------------

    def truth(self) -> dict[str, Any]:
        """Return what the physics knows."""
        return ask(self.run_dir, "truth")

    def inside(self, name: str, container: str) -> dict[str, Any]:
        """Return whether an object rests in a container."""
        return ask(self.run_dir, "inside", object=name, container=container)

    def fastest_rad_s(self) -> float:
        """Return the speed of the fastest joint."""
        return fastest_joint(self.truth())[1]

    def wait_until(self, condition: Callable[[], object], timeout_s: float = 60.0) -> bool:
        """Return whether `condition()` came true in time."""
        deadline_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while not condition():
            if self.clock.now_ns() > deadline_ns:
                return False
            self.clock.sleep_until(self.clock.now_ns() + _POLL_NS)
        return True

    def members(self) -> list[psutil.Process]:
        """Return every process that carries the run's id, the supervisor's descendants or not."""
        return [one for one in psutil.process_iter() if run_id_of(one) == self.run_dir.name]

    def close(self) -> None:
        """End the run in order; ending twice is allowed."""
        self._let_go()
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGTERM)
        self._wait()

    def cut(self) -> None:
        """End the run as a power cut does: its end in order takes longer than many a test."""
        if self.run_dir == self.base:  # it has not come up: only the supervisor knows its parts
            self.close()
            return
        self._let_go()
        self.process.kill()
        self._wait()
        members = self.members()
        end_leftovers(self.run_dir.name)
        psutil.wait_procs(members, timeout=_END_S)
        shutil.rmtree((self.run_dir / "ipc").resolve(), ignore_errors=True)

    def _let_go(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None
        for begun in self._begun:
            begun.kill()  # nothing, where it has ended
            begun.communicate()  # closes its pipes, too
        self._begun.clear()

    def _wait(self) -> None:
        self.process.wait(_END_S)
        if self.process.stdout is not None:
            self.process.stdout.close()

    def _words(self, *words: str) -> list[str]:
        return [*_COMMAND, "--runtime-base", str(self.base), *words]
