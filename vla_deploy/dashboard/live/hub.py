"""Send live topics to clients; no client waits for another.

The hub reads only topics with subscribers. Each client has a bounded outbox and a
task that empties it; a client that takes nothing for `FROZEN_S` is dropped.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.dashboard.live.message import (
    LiveFeed,
    LiveMessage,
    LookTime,
    json_message,
    lost_message,
)

MOST_EVENTS: Final = 256
Send = Callable[[Sequence[LiveMessage]], Awaitable[None]]
STEP_S: Final = 0.05
FROZEN_S: Final = 5.0
ALIVE: Final = "alive"
ALIVE_S: Final = 2.0
"""The interval of the message to every client that the hub works."""
MOST_CLIENTS: Final = 100
_log = logging.getLogger(__name__)


class Outbox:
    """Hold the messages that wait for one client: newest values, and events with a limit."""

    def __init__(self, most_events: int = MOST_EVENTS) -> None:
        self._most_events = most_events
        self._values: dict[str, LiveMessage] = {}
        self._events: deque[LiveMessage] = deque()
        self._lost: dict[str, int] = {}

    def __bool__(self) -> bool:
        return bool(self._values or self._events)

    def put(self, message: LiveMessage) -> None:
        """Add a message: a value replaces the previous one, a full queue loses its oldest event."""
        if not message.queued:
            self._values[message.topic] = message
            return
        if len(self._events) >= self._most_events:
            topic = self._events.popleft().topic
            self._lost[topic] = self._lost.get(topic, 0) + 1
        self._events.append(message)

    def take(self) -> list[LiveMessage]:
        """Return and forget all messages: counts of lost events, the events, then the values."""
        lost = [lost_message(topic, count) for topic, count in self._lost.items()]
        waiting = [*lost, *self._events, *self._values.values()]
        self._lost.clear()
        self._events.clear()
        self._values.clear()
        return waiting

    def forget(self, topic: str) -> None:
        """Drop the value of a topic without subscription."""
        self._values.pop(topic, None)


class LiveClient:
    """Hold the subscription and the outbox of one client."""

    def __init__(self, send: Send, clock: Clock) -> None:
        self.outbox = Outbox()
        self.topics: frozenset[str] = frozenset()
        self._send = send
        self._clock = clock
        self._filled = asyncio.Event()
        self._sending_since_ns: int | None = None

    def wake(self) -> None:
        """Start to send what is in the outbox."""
        if self.outbox:
            self._filled.set()

    def is_frozen(self, now_ns: int) -> bool:
        """Return whether it has taken nothing for too long."""
        since_ns = self._sending_since_ns
        return since_ns is not None and now_ns - since_ns > FROZEN_S * NS_PER_S

    async def deliver(self) -> None:
        """Send what comes into the outbox until cancelled."""
        while True:
            await self._filled.wait()
            self._filled.clear()
            self._sending_since_ns = self._clock.now_ns()
            await self._send(self.outbox.take())
            self._sending_since_ns = None


class LiveHub:
    """Send the messages of the feeds to the clients that are subscribed."""

    def __init__(self, feeds: Iterable[LiveFeed], clock: Clock, wall_ns: Callable[[], int]) -> None:
        self.failed_looks: Counter[str] = Counter()
        self._feeds: dict[str, LiveFeed] = {feed.topic: feed for feed in feeds}
        self.clock = clock
        self._wall_ns = wall_ns
        self._clients: dict[LiveClient, asyncio.Task[None]] = {}
        self._due_ns: dict[str, int] = {}
        self._alive_ns = 0

    @property
    def topics(self) -> frozenset[str]:
        """Return the names of all live topics."""
        return frozenset(self._feeds)

    @property
    def client_count(self) -> int:
        """Return how many clients there are."""
        return len(self._clients)

    @property
    def is_full(self) -> bool:
        """Return whether no more clients are admitted."""
        return len(self._clients) >= MOST_CLIENTS

    def join(self, client: LiveClient) -> "asyncio.Task[None]":
        """Add a client; the task ends when it is dropped or its connection fails."""
        self._clients[client] = asyncio.create_task(client.deliver())
        return self._clients[client]

    def leave(self, client: LiveClient) -> None:
        """Remove a client."""
        self._clients.pop(client).cancel()

    def subscribe(self, client: LiveClient, topics: frozenset[str]) -> None:
        """Send a client these topics and no others; each begins with its newest value."""
        for topic in client.topics - topics:
            client.outbox.forget(topic)
        for topic in (topics - client.topics) & self.topics:
            if topic in self._due_ns:
                self._look_at(
                    self._feeds[topic], self._now()
                )  # events of before belong to the other clients
            self._feeds[topic].begin()
            self._due_ns[topic] = 0
        client.topics = topics

    def step(self) -> None:
        """Look at every subscribed topic that is due, and drop frozen clients."""
        if not self._clients:
            return
        now = self._now()
        wanted = frozenset[str]().union(*(client.topics for client in self._clients))
        self._due_ns = {topic: due for topic, due in self._due_ns.items() if topic in wanted}
        for topic, due_ns in list(self._due_ns.items()):
            if now.run_ns >= due_ns:
                self._look_at(self._feeds[topic], now)
        self._send_alive(now)
        for client, task in self._clients.items():
            client.wake()
            if client.is_frozen(now.run_ns):
                task.cancel()

    def stop(self) -> None:
        """Remove all clients."""
        for client in list(self._clients):
            self.leave(client)

    def _look_at(self, feed: LiveFeed, now: LookTime) -> None:
        # A step may come slightly early; the next one would be half a period late.
        self._due_ns[feed.topic] = now.run_ns + round((feed.period_s - STEP_S / 2) * NS_PER_S)
        try:
            messages = feed.look(now)
        except Exception:  # main loop of the live topics: one bad topic must not stop the others
            self.failed_looks[feed.topic] += 1
            if self.failed_looks[feed.topic] == 1:
                _log.exception("live topic %s: it cannot be told", feed.topic)
            return
        for client in self._clients if messages else ():
            if feed.topic in client.topics:
                for message in messages:
                    client.outbox.put(message)

    def _send_alive(self, now: LookTime) -> None:
        if now.run_ns >= self._alive_ns:
            self._alive_ns = now.run_ns + round(ALIVE_S * NS_PER_S)
            message = json_message(ALIVE, now.run_ns, now, {})
            for client in self._clients:
                client.outbox.put(message)

    def _now(self) -> LookTime:
        return LookTime(run_ns=self.clock.now_ns(), wall_ns=self._wall_ns())
