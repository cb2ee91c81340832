"""Have the robot say something aloud, and learn what became of it: the way in for every source.

Text that must be known goes to a person's eyes too; a robot may have no voice, or nobody near.
"""

import itertools
import os
from collections import deque
from dataclasses import dataclass
from typing import Final

from drivers.clock import Clock
from vla_deploy.ipc import topics
from vla_deploy.ipc.space import SharedSpace
from vla_deploy.ipc.topics import BY_NAME

BEGAN: Final = "began"
_STATUS_AGE_S: Final = BY_NAME["speech_status"].deadline_s
_REMEMBERED: Final = 32
_LETTERS: Final = 600  # of any alphabet, a slot holds them; the voice says fewer


@dataclass(frozen=True, slots=True, kw_only=True)
class Announced:
    """Say how something to be said ended: finished, interrupted, failed or dropped."""

    event: str
    reason: str


class Announcer:
    """Speak on behalf of one source, whose name the voice shows."""

    def __init__(self, space: SharedSpace, source: str, clock: Clock) -> None:
        """Open the topics.

        Raises:
            SpaceUnavailable: shared memory cannot be opened.
        """
        self._source = source
        self._clock = clock
        self._say = space.ring_writer(topics.SAY)
        self._told = space.ring_reader(topics.VOICE_EVENT, from_start=False)
        self._status = space.cell_reader(topics.SPEECH_STATUS)
        self._numbers = itertools.count(1)
        self._said: deque[str] = deque(maxlen=_REMEMBERED)
        self._ended: dict[str, Announced] = {}

    def why_silent(self) -> str:
        """Return why nothing would be heard now; empty when the voice is ready."""
        sample = self._status.latest()
        if sample is None or sample.age_s(self._clock.now_ns()) > _STATUS_AGE_S:
            return "no speech process runs"
        voice = sample.document().get("voice") or {}
        if voice.get("state") == "ready":
            return ""
        return str(voice.get("why") or "the robot has no speaker")

    def say(self, text: str) -> str:
        """Have a text said, after what waits to be, and return its id."""
        say_id = f"{self._source}-{os.getpid()}-{next(self._numbers)}"
        self._said.append(say_id)
        self._say.publish({"say_id": say_id, "text": text[:_LETTERS], "source": self._source})
        return say_id

    def take_back(self, say_id: str) -> None:
        """Have something not said, or broken off."""
        self._say.publish({"say_id": say_id, "cancel": True})

    def ended(self, say_id: str) -> Announced | None:
        """Return how something ended, once, or None while it waits or sounds."""
        for event in self._told.drain():
            told = event.payload
            if told["say_id"] in self._said and told["event"] != BEGAN:
                self._ended[told["say_id"]] = Announced(event=told["event"], reason=told["reason"])
        self._ended = {one: ended for one, ended in self._ended.items() if one in self._said}
        return self._ended.pop(say_id, None)

    def close(self) -> None:
        """Unmap the topics."""
        for topic in (self._say, self._told, self._status):
            topic.close()
