"""Read the topic `say`: who wants what to be said, how urgently, and what is taken back."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

from vla_deploy.speech.voice.errors import OrderRefused

LONGEST_LETTERS: Final = 400
"""More is cut at a word: half a minute of talk is enough, and the text is shown whole elsewhere."""
LONGEST_ID: Final = 80
_KEYS: Final = frozenset({"say_id", "text", "interrupt", "source", "priority", "cancel"})


class Priority(IntEnum):
    """Rank what waits to be said."""

    LOW = 0
    MEDIUM = 1
    HIGH = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """Ask for a text to be said; `interrupt` cuts off what is no more urgent than this."""

    say_id: str
    text: str
    priority: Priority = Priority.MEDIUM
    interrupt: bool = False
    source: str = ""
    given_ns: int = 0
    is_cut: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Withdrawal:
    """Take an order back, whether it waits or is being said."""

    say_id: str


def read_order(payload: Mapping[str, Any], given_ns: int) -> Order | Withdrawal:
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
        return Withdrawal(say_id=say_id)
    spoken, is_cut = _spoken(payload.get("text"))
    return Order(
        say_id=say_id,
        text=spoken,
        priority=_priority(payload.get("priority", "medium")),
        interrupt=payload.get("interrupt") is True,
        source=str(payload.get("source", "")),
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
