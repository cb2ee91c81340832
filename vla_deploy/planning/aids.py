"""Give those who plan what is not at hand in every step: memories, and which aids they can use."""

import logging
from enum import Enum
from typing import Final

from vla_deploy.memory import LastSeen, MemoryStore, MemoryUnusable
from vla_deploy.memory.episode import unix_s
from vla_deploy.memory.wording import sentence_of

MOST_SENTENCES: Final = 5
MOST_THINGS: Final = 60
# What is older says nothing of where a thing is now.
OLDEST_S: Final = 30 * 86_400.0
_log = logging.getLogger(__name__)


class Aid(Enum):
    """Name what some planners can use, and what takes time to get."""

    IMAGE = "what the camera sees"
    MEMORY = "what is remembered of earlier commands"


class Recall:
    """Read the memory; one that cannot be read is done without."""

    def __init__(self, store: MemoryStore) -> None:
        self._store = store

    def sentences(self, text: str) -> tuple[str, ...]:
        """Return what is remembered that fits a command, a sentence each."""
        now_s = unix_s()
        try:
            found = self._store.recall(text, MOST_SENTENCES)
        except MemoryUnusable as error:
            _log.warning("%s", error)
            return ()
        return tuple(sentence_of(one.episode, now_s) for one in found)

    def things(self) -> tuple[LastSeen, ...]:
        """Return things with where they were in the last weeks, the newest first."""
        oldest_s = unix_s() - OLDEST_S
        try:
            seen = self._store.last_seen(count=MOST_THINGS)
        except MemoryUnusable as error:
            _log.warning("%s", error)
            return ()
        return tuple(one for one in seen if one.seen_s > oldest_s)
