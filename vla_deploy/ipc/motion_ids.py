"""Number motions so that no two senders, nor two starts of one, ever use the same number."""

import itertools
from collections.abc import Iterator
from typing import Final

from drivers.clock import Clock

SENDERS: Final = ("executor", "ros", "cli")
_US_NS: Final = 1000


def motion_ids(clock: Clock, sender: str) -> Iterator[int]:
    """Yield numbers of one sender, rising from the present time on.

    Raises:
        ValueError: the sender is none of `SENDERS`.
    """
    step = len(SENDERS)
    first = (clock.now_ns() // _US_NS + 1) * step + SENDERS.index(sender)
    return itertools.count(first, step)


def sender_of(motion_id: int) -> str:
    """Return who has sent a motion."""
    return SENDERS[motion_id % len(SENDERS)]
