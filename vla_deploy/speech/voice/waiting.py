"""Keep what waits to be said in order: the urgent first, a bounded number, none for too long."""

from collections.abc import Iterable, Iterator
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.speech.voice.orders import Order

MOST_WAITING: Final = 16
LONGEST_WAIT_NS: Final = 20 * NS_PER_S
"""News that old is none any more."""


class WaitingLine:
    """Hold orders; those that interrupt come first among their kind, else it is first come."""

    def __init__(self) -> None:
        self._orders: list[Order] = []

    def __len__(self) -> int:
        return len(self._orders)

    def __iter__(self) -> Iterator[Order]:
        return iter(self._orders)

    def add(self, order: Order) -> Order | None:
        """Take an order; return the one that has no room: the least urgent, of those the last."""
        rank = _rank(order)
        before = sum(_rank(each) >= rank for each in self._orders)
        if order.interrupt:
            before = sum(_rank(each) > rank for each in self._orders)
        self._orders.insert(before, order)
        return self._orders.pop() if len(self._orders) > MOST_WAITING else None

    def take(self) -> Order | None:
        """Return and forget the first one."""
        return self._orders.pop(0) if self._orders else None

    def withdraw(self, say_id: str) -> Order | None:
        """Return and forget one by its id."""
        return self._taken(each for each in self._orders if each.say_id == say_id)

    def expired(self, now_ns: int) -> Order | None:
        """Return and forget one that has waited for too long."""
        oldest_ns = now_ns - LONGEST_WAIT_NS
        return self._taken(each for each in self._orders if each.given_ns < oldest_ns)

    def _taken(self, found: Iterable[Order]) -> Order | None:
        order = next(iter(found), None)
        if order is not None:
            self._orders.remove(order)
        return order


def _rank(order: Order) -> tuple[int, bool]:
    return order.priority, order.interrupt
