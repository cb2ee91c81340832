"""Attach to the run on this machine: its shared memory, its commands, its events."""

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar, Unpack

from drivers.clock import NS_PER_S, Clock
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.client.following import ANSWER_TIMEOUT_S, Following
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import RingReader, topics
from vla_deploy.ipc.payloads.scene import SceneDocument
from vla_deploy.ipc.payloads.tasks import TaskEvent, UtteranceContent
from vla_deploy.supervisor.runs.runtime import default_base, running

if TYPE_CHECKING:  # loads NumPy: an emergency stop must not wait for it
    from vla_deploy.robots import RobotDescription

POLL_S: Final = 0.02
FRESH_S: Final = 5.0
T = TypeVar("T")


class RobotSession(RobotLink):
    """Talk to a running robot through its topics, and wait for its answers."""

    def __init__(self, run_dir: Path, clock: Clock | None = None) -> None:
        super().__init__(run_dir, clock, source="cli")

    def pause(self, duration_s: float = POLL_S) -> None:
        """Wait for a moment."""
        self.clock.sleep_until(self.clock.now_ns() + round(duration_s * NS_PER_S))

    def wait_for(
        self, look: Callable[[], T | None], timeout_s: float, poll_s: float = POLL_S
    ) -> T | None:
        """Call `look` until it returns a value; return that, or None after the time limit."""
        end_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while self.clock.now_ns() < end_ns:
            found = look()
            if found is not None:
                return found
            self.pause(poll_s)
        return None

    def command(
        self, wait: Callable[[], None] | None = None, **utterance: Unpack[UtteranceContent]
    ) -> Iterator[TaskEvent]:
        """Give a command and return its events, up to and including the last one.

        `wait` waits between two reads of the events.

        Raises:
            CommandFailed: planner and executor do not answer; raised by the iterator.
        """
        events = self.events(topics.TASK_EVENT)
        return self.follow(self.utter(**utterance), events, wait)

    def follow(
        self,
        command_id: str,
        events: RingReader[TaskEvent],
        pause: Callable[[], None] | None = None,
    ) -> Iterator[TaskEvent]:
        """Return the task events of a given command; the last is `finished` or `rejected`.

        Where the command answers a question, the command that asked is followed from then on.

        Raises:
            CommandFailed: planner and executor do not answer; raised by the iterator.
        """
        following = Following(
            command_id,
            lambda: self.fresh(topics.PLANNER_STATUS, age_limit_s=2.0),
            lambda: self.fresh(topics.EXECUTOR_STATUS, age_limit_s=1.0),
            self.clock,
        )
        return _events_of(following, events, pause or self.pause)

    def cancel(self) -> None:
        """Ask the executor to stop what it does; the robot stays ready.

        Raises:
            CommandFailed: planner and executor do not answer.
        """
        for _ in self.command(cancel=True):
            pass

    def scene(self) -> SceneDocument:
        """Return the document of the topic `scene`.

        Raises:
            UsageError: perception is silent.
        """
        document = self.document(topics.SCENE, age_limit_s=FRESH_S)
        if document is None:
            raise UsageError("perception tells no scene; see: vla-deploy status")
        return document

    def running_robot(self) -> "RobotDescription":
        """Return the description of the robot that runs.

        Raises:
            UsageError: the supervisor is silent.
        """
        from vla_deploy.robots import load_robot

        table = self.document(topics.PROCESS_TABLE, age_limit_s=FRESH_S)
        if table is None:
            raise UsageError(
                "the supervisor does not tell which robot this is; see: vla-deploy status"
            )
        return load_robot(table["robot"])


def _events_of(
    following: Following, events: RingReader[TaskEvent], pause: Callable[[], None]
) -> Iterator[TaskEvent]:
    while True:
        yield from following.look(events)
        if following.has_ended:
            return
        if following.is_unanswered:
            raise CommandFailed(
                f"no answer from planner or executor within {ANSWER_TIMEOUT_S:g} s, the command is "
                "not carried out; see: vla-deploy status, and to stop the robot at once: "
                "vla-deploy estop"
            )
        pause()


def base_of(arguments: argparse.Namespace) -> Path:
    """Return the runtime directory that the arguments name, or the default one."""
    base: Path = arguments.runtime_base or default_base()
    return base


def attach(runtime_base: Path | None) -> RobotSession:
    """Return a session with the robot that runs on this machine.

    Raises:
        UsageError: none runs.
        RuntimeUnavailable: the runtime directory belongs to another user.
    """
    base = runtime_base or default_base()
    owner = running(base)
    if owner is None:
        raise UsageError(f"no robot runs in {base}; start one: vla-deploy run --twin")
    return RobotSession(Path(owner.run_dir))
