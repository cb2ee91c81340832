"""Give commands in words, one at a time, and see how each ends."""

from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.following import LAST_EVENTS
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import topics

_ANSWER_NS: Final = 8 * NS_PER_S
"""After so long without a word nobody has heard the command: the planner was away."""


class CommandTalk:
    """Give commands one at a time and see how each ends, without ever waiting."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._events = link.events(topics.TASK_EVENT)
        self._now = ""
        self._answer_by_ns: int | None = None
        self.done = 0
        self.failed = 0

    @property
    def is_busy(self) -> bool:
        """Return whether the last command goes on, or may still be answered."""
        unheard = self._answer_by_ns is not None and self._link.clock.now_ns() > self._answer_by_ns
        return bool(self._now) and not unheard

    def say(self, text: str) -> None:
        """Give a command; the one before is no longer followed."""
        self._answer_by_ns = self._link.clock.now_ns() + _ANSWER_NS
        self._now = self._link.utter(text=text)

    def cancel(self) -> None:
        """End what goes on."""
        self._link.utter(cancel=True)

    def listen(self) -> None:
        """Note how the command goes on and ends."""
        for event in self._events.drain():
            said = event.payload
            if said["command_id"] != self._now:
                continue
            self._answer_by_ns = None
            if said["event"] in LAST_EVENTS:
                self._now = ""
                success = said["event"] == "finished" and said["success"]
                self.done += success
                self.failed += not success
