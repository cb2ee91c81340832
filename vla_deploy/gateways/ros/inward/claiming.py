"""Hold parts of the robot while they are moved from the graph, so that no plan moves them too.

Either nobody else holds them, or the executor does, and lends them to a server that it has asked.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.outgoing.lending import Lending
from vla_deploy.ipc import ClaimBook
from vla_deploy.ipc.errors import ClaimRefused


class PartsHold(Protocol):
    """Hold some of the robot's parts; `is_held` tells whether they were taken."""

    is_held: bool

    def why_not_taken(self) -> str:
        """Take them, or return why not; holding them already is fine."""
        ...

    def why_over(self) -> str:
        """Return why what moves them has to end now, "" where it may go on."""
        ...

    def most_m_s(self) -> float:
        """Return the greatest speed at which they may be driven, in m/s."""
        ...

    def release(self) -> None:
        """Give them back."""
        ...


class Claimed:
    """Ask for some of the robot's parts, all or none; waiting for them is not offered."""

    def __init__(self, link: RobotLink, holder: str, parts: Sequence[str]) -> None:
        self.is_held = False
        self._book = ClaimBook(link.space, link.clock)
        self._holder = holder
        self._wants = dict.fromkeys(parts, 1)

    def why_not_taken(self) -> str:
        """Take them, or return who has them; holding them already is fine."""
        if self.is_held:
            return ""
        try:
            self.is_held = self._book.ask(self._holder, self._wants)
        except ClaimRefused as error:
            return str(error)
        if self.is_held:
            return ""
        self._book.release(self._holder)
        return self._book.obstacles(self._wants) or "another command was faster"

    def why_over(self) -> str:
        """Return "": what is held is held until it is released."""
        return ""

    def most_m_s(self) -> float:
        """Return infinity: the limits are control's."""
        return math.inf

    def release(self) -> None:
        """Give them back."""
        self._book.release(self._holder)
        self.is_held = False


class Borrowed:
    """Hold parts in the executor's name, while it lends them to the server of one of its goals."""

    def __init__(self, lending: Lending, parts: Sequence[str], *, driving: bool = False) -> None:
        self.is_held = False
        self._lending = lending
        self._parts = tuple(parts)
        self._driving = driving

    def why_not_taken(self) -> str:
        """Take them, or return why they are not lent now."""
        why = self._lending.why_not(self._parts, driving=self._driving)
        self.is_held = not why
        return why

    def why_over(self) -> str:
        """Return why they are not lent any more."""
        return self._lending.why_not(self._parts, driving=self._driving) if self.is_held else ""

    def most_m_s(self) -> float:
        """Return the speed that the executor allows the base, in m/s."""
        return self._lending.most_m_s(self._parts)

    def release(self) -> None:
        """Move them no longer; the executor goes on to hold them."""
        self.is_held = False
