"""Attach to the run that is going on: its shared memory, its commands, its events."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock
from vla_deploy.cli.errors import UsageError
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import RingReader
from vla_deploy.supervisor.runs.runtime import default_base, running

POLL_NS = NS_PER_S // 50


class Session(RobotLink):
    """Talk to a running robot through its topics, and wait for what it says."""

    def __init__(self, run_dir: Path, clock: Clock | None = None) -> None:
        super().__init__(run_dir, clock, source="cli")

    def pause(self, duration_s: float = POLL_NS / NS_PER_S) -> None:
        """Wait a moment; a poll's worth unless told otherwise."""
        self.clock.sleep_until(self.clock.now_ns() + round(duration_s * NS_PER_S))

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
        answers = self.events("flight_event")
        self.publish("flight_request", {"source": self.source, "reason": reason})
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while self.clock.now_ns() < end_ns:
            for event in answers.drain():
                if "request" in event.payload["causes"]:
                    return event.payload
            self.pause()
        return None

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
