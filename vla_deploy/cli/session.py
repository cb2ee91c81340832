"""Attach to the run that is going on: its shared memory, its commands, its events."""

import itertools
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from vla_deploy.cli.errors import UsageError
from vla_deploy.ipc import CellReader, Frame, FrameReader, RingReader, Sample, SharedSpace
from vla_deploy.ipc.stop_button import ESTOP, StopButton
from vla_deploy.supervisor.runtime import default_base, running

POLL_NS = NS_PER_S // 50


class Session:
    """Talk to a running robot through its topics."""

    def __init__(self, run_dir: Path, clock: Clock | None = None) -> None:
        self.run_dir = run_dir
        self.clock: Clock = clock or MonotonicClock()
        self._space = SharedSpace(run_dir / "ipc", self.clock)
        self._cells: dict[str, CellReader] = {}
        self._frames: dict[str, FrameReader] = {}
        self._numbers = itertools.count(1)

    @property
    def space(self) -> SharedSpace:
        """Return the run's shared memory."""
        return self._space

    def fresh(self, topic: str, age_limit_s: float | None = None) -> Sample | None:
        """Return the newest sample of a cell, or None when there is none that young."""
        if topic not in self._cells:
            self._cells[topic] = self._space.cell_reader(topic)
        sample = self._cells[topic].latest()
        if sample is None or age_limit_s is None:
            return sample
        return sample if sample.age_s(self.clock.now_ns()) <= age_limit_s else None

    def document(self, topic: str, age_limit_s: float | None = None) -> dict[str, Any] | None:
        """Return the newest JSON document of a cell, or None when there is none that young."""
        sample = self.fresh(topic, age_limit_s)
        return None if sample is None else sample.document()

    def frame(self, topic: str, age_limit_s: float) -> Frame | None:
        """Return the newest image of a frame ring, or None when there is none that young."""
        if topic not in self._frames:
            self._frames[topic] = self._space.frame_reader(topic)
        frame = self._frames[topic].latest()
        if frame is None:
            return None
        age_s = (self.clock.now_ns() - frame.stamp_ns) / NS_PER_S
        return frame if age_s <= age_limit_s else None

    def pause(self, duration_s: float = POLL_NS / NS_PER_S) -> None:
        """Wait a moment; a poll's worth unless told otherwise."""
        self.clock.sleep_until(self.clock.now_ns() + round(duration_s * NS_PER_S))

    def operate(self, act: str, reason: str = "") -> None:
        """Publish an operator's act: estop, reset, arm or disarm; control reads it directly."""
        if act == ESTOP:
            StopButton(self._space, "cli", self.clock).press(reason)
            return
        message = {"act": act, "source": "cli", "reason": reason}
        self._space.ring_writer("operator").publish(message)

    def utter(self, **utterance: Any) -> str:
        """Say something to the planner, and return the id that answers to it carry."""
        command_id = f"cli-{os.getpid()}-{next(self._numbers)}"
        message = {"command_id": command_id, "source": "cli"} | utterance
        self._space.ring_writer("utterance").publish(message)
        return command_id

    def command(
        self, pause: Callable[[], None] | None = None, **utterance: Any
    ) -> Iterator[dict[str, Any]]:
        """Give a command and return its events, up to and including the last one.

        `pause` waits for a moment between two looks at the events.

        Raises:
            CommandFailed: nobody answers; raised by the iterator.
        """
        events = self.events("task_event")
        return self.follow(self.utter(**utterance), events, pause)

    def events(self, topic: str) -> RingReader:
        """Return what comes on a ring from now on."""
        return self._space.ring_reader(topic, from_start=False)

    def follow(
        self, command_id: str, events: RingReader, pause: Callable[[], None] | None = None
    ) -> Iterator[dict[str, Any]]:
        """Return the task events of a command that was given, up to and including the last one.

        Raises:
            CommandFailed: nobody answers; raised by the iterator.
        """
        from vla_deploy.cli.follow import follow_command  # loads pydantic: not on an estop's way

        return follow_command(
            command_id,
            events=lambda: [event.payload for event in events.drain()],
            planner=lambda: self.fresh("planner_status", age_limit_s=2.0),
            executor=lambda: self.fresh("executor_status", age_limit_s=1.0),
            clock=self.clock,
            pause=pause or self.pause,
        )

    def save_flight(self, reason: str, timeout_s: float) -> dict[str, Any] | None:
        """Ask the flight recorder for a flight; return what it says, None when it is silent."""
        answers = self._space.ring_reader("flight_event", from_start=False)
        self._space.ring_writer("flight_request").publish({"source": "cli", "reason": reason})
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while self.clock.now_ns() < end_ns:
            for event in answers.drain():
                if "request" in event.payload["causes"]:
                    return event.payload
            self.pause()
        return None

    def close(self) -> None:
        """Let go of the run's shared memory."""
        self._space.close()

    def cancel(self) -> None:
        """Ask the executor to stop what it does; the robot stays ready.

        Raises:
            CommandFailed: nobody answers.
        """
        for _ in self.command(cancel=True):
            pass


def attach(runtime_base: Path | None) -> Session:
    """Return a session with the robot that runs on this machine.

    Raises:
        UsageError: none runs.
        RuntimeUnavailable: the runtime directory belongs to someone else.
    """
    base = runtime_base or default_base()
    owner = running(base)
    if owner is None:
        raise UsageError(f"no robot runs in {base}; start one: vla-deploy run --twin")
    return Session(Path(owner.run_dir))
