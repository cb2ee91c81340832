"""Read the topic `say`, and keep what waits to be said in order: bounded, and none for long."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.speech.errors import OrderRefused

LONGEST_LETTERS: Final = 400
"""More is cut at a word: half a minute of talk is enough, and the text is shown whole elsewhere."""
LONGEST_ID: Final = 80
MOST_WAITING: Final = 16
LONGEST_WAIT_NS: Final = 20 * NS_PER_S
"""News that old is none any more."""
_KEYS: Final = frozenset({"say_id", "text", "interrupt", "source", "priority", "cancel"})


class Priority(IntEnum):
    """Rank what waits to be said."""

    LOW = 0
    MEDIUM = 1
    HIGH = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """Ask for a text to be said; `interrupt` cuts off what is no more urgent than this.

    With `withdraws` it takes the order of that id back, whether it waits or is being said.
    """

    say_id: str
    text: str = ""
    priority: Priority = Priority.MEDIUM
    interrupt: bool = False
    given_ns: int = 0
    is_cut: bool = False
    withdraws: bool = False


class SayQueue:
    """Hold orders; those that interrupt come first among their kind, else it is first come."""

    def __init__(self) -> None:
        self._orders: list[Order] = []

    def __len__(self) -> int:
        return len(self._orders)

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

    def drop(self, is_dropped: Callable[[Order], bool]) -> list[Order]:
        """Return and forget those of a kind."""
        dropped = [each for each in self._orders if is_dropped(each)]
        self._orders = [each for each in self._orders if each not in dropped]
        return dropped


def read_order(payload: Mapping[str, Any], given_ns: int) -> Order:
    """Return what a message of the topic `say` asks for.

    Raises:
        OrderRefused: it is no order; says what was expected.
    """
    unknown = sorted(set(payload) - _KEYS)
    if unknown:
        raise OrderRefused(f"expected {', '.join(sorted(_KEYS))}, got {', '.join(unknown):.100}")
    say_id = payload.get("say_id")
    if not isinstance(say_id, str) or not 0 < len(say_id) <= LONGEST_ID:
        raise OrderRefused(f"say_id: expected 1..{LONGEST_ID} letters, got {say_id!r:.100}")
    if payload.get("cancel") is True:
        return Order(say_id=say_id, withdraws=True)
    spoken, is_cut = _spoken(payload.get("text"))
    return Order(
        say_id=say_id,
        text=spoken,
        priority=_priority(payload.get("priority", "medium")),
        interrupt=payload.get("interrupt") is True,
        given_ns=given_ns,
        is_cut=is_cut,
    )


def _spoken(text: object) -> tuple[str, bool]:
    """Return a text as it is said, and whether it was cut; `red_cup` is two words."""
    if not isinstance(text, str) or not text.strip():
        raise OrderRefused(f"text: expected words, got {text!r:.100}")
    said = " ".join(text.replace("_", " ").split())
    if len(said) <= LONGEST_LETTERS:
        return said, False
    return said[:LONGEST_LETTERS].rsplit(" ", 1)[0], True


def _priority(word: object) -> Priority:
    names = {one.name.lower(): one for one in Priority}
    if not isinstance(word, str) or word not in names:
        raise OrderRefused(f"priority: expected one of {', '.join(names)}, got {word!r:.100}")
    return names[word]


def _rank(order: Order) -> tuple[int, bool]:
    return order.priority, order.interrupt
