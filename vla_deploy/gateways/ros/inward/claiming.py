"""Hold parts of the robot while they are moved from the graph, so that no plan moves them too.

Either nobody else holds them, or the executor does, and lends them to a server that it has asked.
"""

from collections.abc import Sequence
from typing import Protocol

from vla_deploy.gateways.ros.outgoing.lending import Lending


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
