"""Attach to the run that is going on: its shared memory, its commands, its events."""

import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from vla_deploy.cli.errors import UsageError
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor import default_base, running

POLL_NS = NS_PER_S // 50
ANSWER_TIMEOUT_S = 5.0


class Session:
    """Talk to a running robot through its topics."""

    def __init__(self, run_dir: Path, clock: Clock | None = None) -> None:
        self.run_dir = run_dir
        self.clock: Clock = clock or MonotonicClock()
        self.space = SharedSpace(run_dir / "ipc", self.clock)
        self._numbers = itertools.count(1)

    def document(self, topic: str, age_limit_s: float | None = None) -> dict[str, Any] | None:
        """Return the newest JSON document of a cell, or None when there is none that fresh."""
        sample = self.space.cell_reader(topic).latest()
        if sample is None:
            return None
        if age_limit_s is not None and sample.age_s(self.clock.now_ns()) > age_limit_s:
            return None
        return sample.document()

    def operate(self, act: str, reason: str = "") -> None:
        """Publish an operator's act: estop, reset, arm or disarm; control reads it directly."""
        message = {"act": act, "source": "cli", "reason": reason}
        self.space.ring_writer("operator").publish(message)

    def command(self, **utterance: Any) -> Iterator[dict[str, Any]]:
        """Give a command and return its events, up to and including the last one.

        Raises:
            UsageError: the planner does not answer.
        """
        command_id = f"cli-{os.getpid()}-{next(self._numbers)}"
        events = self.space.ring_reader("task_event", from_start=False)
        message = {"command_id": command_id, "source": "cli"} | utterance
        self.space.ring_writer("utterance").publish(message)
        return self._follow(events, command_id)

    def _follow(self, events: Any, command_id: str) -> Iterator[dict[str, Any]]:
        answer_by_ns = self.clock.now_ns() + round(ANSWER_TIMEOUT_S * NS_PER_S)
        answered = False
        while True:
            for event in events.drain():
                if event.payload.get("command_id") != command_id:
                    continue
                answered = True
                yield event.payload
                if event.payload["event"] in ("finished", "rejected"):
                    return
            if not answered and self.clock.now_ns() > answer_by_ns:
                raise UsageError(
                    f"no answer from the planner within {ANSWER_TIMEOUT_S:g} s; "
                    "see what runs: vla-deploy status"
                )
            self.clock.sleep_until(self.clock.now_ns() + POLL_NS)

    def cancel(self) -> None:
        """Ask the executor to stop what it does; the robot stays ready."""
        for _ in self.command(cancel=True):
            pass


def attach(runtime_base: Path | None) -> Session:
    """Return a session with the robot that runs on this machine.

    Raises:
        UsageError: none runs.
    """
    base = runtime_base or default_base()
    owner = running(base)
    if owner is None:
        raise UsageError(f"no robot runs in {base}; start one: vla-deploy run --twin")
    return Session(Path(owner.run_dir))
