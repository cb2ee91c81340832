"""Hold what one client has yet to get, bounded: the newest values, and events in order."""

from collections import deque
from typing import Final

from vla_deploy.dashboard.live.message import Message, lost_message

MOST_EVENTS: Final = 256


class Outbox:
    """Give messages in turn; a slow client skips values and is told how many events it lost."""

    def __init__(self, most_events: int = MOST_EVENTS) -> None:
        self._most_events = most_events
        self._values: dict[str, Message] = {}
        self._events: deque[Message] = deque()
        self._lost: dict[str, int] = {}

    def __bool__(self) -> bool:
        return bool(self._values or self._events)

    def put(self, message: Message) -> None:
        """Take a message: a value replaces the one before, a full queue loses its oldest event."""
        if not message.queued:
            self._values[message.topic] = message
            return
        if len(self._events) >= self._most_events:
            topic = self._events.popleft().topic
            self._lost[topic] = self._lost.get(topic, 0) + 1
        self._events.append(message)

    def take(self) -> list[Message]:
        """Return all that waits, and forget it: what was lost, the events, then the values."""
        lost = [lost_message(topic, count) for topic, count in self._lost.items()]
        waiting = [*lost, *self._events, *self._values.values()]
        self._lost.clear()
        self._events.clear()
        self._values.clear()
        return waiting

    def forget(self, topic: str) -> None:
        """Drop the value of a topic that is wanted no more."""
        self._values.pop(topic, None)
