"""Give commands in words, one at a time, and see how each ends."""

import uuid
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import RingReader, RingWriter
from vla_deploy.ipc.payloads.tasks import TaskEvent, Utterance

_LAST_EVENTS: Final = ("finished", "rejected")
_ANSWER_NS: Final = 8 * NS_PER_S
"""After so long without a word nobody has heard the command: the planner was away."""


class CommandTalk:
    """Give commands one at a time and see how each ends, without ever waiting."""

    def __init__(
        self, utterances: RingWriter[Utterance], events: RingReader[TaskEvent], clock: Clock
    ) -> None:
        self._utterances = utterances
        self._events = events
        self._clock = clock
        self._now = ""
        self._answer_by_ns: int | None = None
        self.done = 0
        self.failed = 0

    @property
    def is_busy(self) -> bool:
        """Return whether the last command goes on, or may still be answered."""
        unheard = self._answer_by_ns is not None and self._clock.now_ns() > self._answer_by_ns
        return bool(self._now) and not unheard

    def say(self, text: str) -> None:
        """Give a command; the one before is no longer followed."""
        self._now = f"campaign-{uuid.uuid4().hex[:12]}"
        self._answer_by_ns = self._clock.now_ns() + _ANSWER_NS
        self._utterances.publish({"command_id": self._now, "source": "cli", "text": text})

    def cancel(self) -> None:
        """End what goes on."""
        command_id = f"campaign-{uuid.uuid4().hex[:12]}"
        self._utterances.publish({"command_id": command_id, "source": "cli", "cancel": True})

    def listen(self) -> None:
        """Note how the command goes on and ends."""
        for event in self._events.drain():
            said = event.payload
            if said["command_id"] != self._now:
                continue
            self._answer_by_ns = None
            if said["event"] == "finished" or said["event"] == "rejected":
                self._now = ""
                success = said["event"] == "finished" and said["success"]
                self.done += success
                self.failed += not success
