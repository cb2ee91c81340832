"""Declare what a live topic is made from."""

from collections.abc import Sequence
from typing import Protocol

from vla_deploy.dashboard.live.message import Message, Moment


class Feed(Protocol):
    """Look at one live topic; only while somebody is subscribed to it."""

    @property
    def topic(self) -> str:
        """Return its name."""
        ...

    @property
    def period_s(self) -> float:
        """Return the least time between two looks."""
        ...

    def begin(self) -> None:
        """Forget what happened while nobody was subscribed; the next look gives what is newest."""
        ...

    def look(self, now: Moment) -> Sequence[Message]:
        """Return what is new since the last look; quick, and never waiting for anybody."""
        ...
