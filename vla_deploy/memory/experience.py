"""Call up what is remembered that may bear on a command: the one way for every back end."""

import logging
import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from vla_deploy.memory.episode import (
    Episode,
    LastSeen,
    PastAction,
    attempt_words,
    place_words,
    sentence_of,
)
from vla_deploy.memory.errors import MemoryUnusable
from vla_deploy.memory.store import MemoryStore

MOST_EPISODES: Final = 5
MOST_THINGS: Final = 60
_MOST_TOLD: Final = 4
# What is older says nothing of where a thing is now.
OLDEST_S: Final = 30 * 86_400.0
# A hand that failed may have been mended by the next day; a way is free again sooner.
HAND_S: Final = 86_400.0
BLOCKED_S: Final = 3_600.0
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experience:
    """Hold what is remembered at `now_s`, in seconds since 1970, that may bear on one command.

    `episodes` are commands like it, the best first; `last_seen` is where things were, `actions` how
    actions went, the newest first. Without `has_memory` nothing is kept of the command either.
    """

    has_memory: bool = False
    now_s: float = 0.0
    episodes: tuple[Episode, ...] = ()
    last_seen: tuple[LastSeen, ...] = ()
    actions: tuple[PastAction, ...] = ()

    def where(self, kind: str, colour: str = "") -> LastSeen | None:
        """Return where such a thing was seen last, None where it was sought in vain since then."""
        alike = (one for one in self.last_seen if one.kind == kind and colour in ("", one.colour))
        seen = next(alike, None)
        if seen is None:
            return None
        sought = self._last("find_object", kind, colour)
        is_gone = sought is not None and not sought.succeeded and sought.done_s > seen.seen_s
        return None if is_gone else seen

    def failed_hand(self, kind: str) -> str:
        """Return the hand that could not take such a thing the last time, "" where none failed."""
        known = (one for one in self.actions if one.skill == "pick_up" and one.hand)
        last = next((one for one in known if one.kind == kind), None)
        if last is None or last.succeeded or last.done_s < self.now_s - HAND_S:
            return ""
        return last.hand

    def is_blocked(self, place: str) -> bool:
        """Return whether the robot did not get to a place when it tried last, a while ago."""
        tried = (one for one in self.actions if one.skill == "navigate_to")
        last = next((one for one in tried if one.place == place), None)
        return last is not None and not last.succeeded and last.done_s >= self.now_s - BLOCKED_S

    def sentences(self, words: str = "", in_sight: Collection[str] = ()) -> tuple[str, ...]:
        """Return it for a model: commands alike, then where things were, then what failed.

        Of kinds of things that are `in_sight` no place is told, unless the command's `words` name
        one; what these are about comes first.
        """
        said = frozenset(re.findall(r"[a-z]+", words.casefold()))
        hidden = [one for one in self.last_seen if one.kind in said or one.kind not in in_sight]
        hidden.sort(key=lambda one: one.kind not in said)
        failed = [one for one in self.actions if not one.succeeded]
        failed.sort(key=lambda one: one.kind not in said)
        return (
            *(sentence_of(one, self.now_s) for one in self.episodes),
            *(place_words(one, self.now_s) for one in hidden[:_MOST_TOLD]),
            *(attempt_words(one, self.now_s) for one in failed[:_MOST_TOLD]),
        )

    def _last(self, skill: str, kind: str, colour: str) -> PastAction | None:
        """Return the last action of a skill on such a thing; an unknown colour fits any."""
        for one in self.actions:
            is_same = "" in (colour, one.colour) or colour == one.colour
            if one.skill == skill and one.kind == kind and is_same:
                return one
        return None


NO_EXPERIENCE: Final = Experience()


def experience_of(
    store: MemoryStore | None, text: str, now_s: float, *, with_episodes: bool = True
) -> Experience:
    """Return what is remembered that bears on a command; a memory that cannot be read is left out.

    Commands alike cost a search, and are left out where no back end reads them.
    """
    if store is None:
        return NO_EXPERIENCE
    try:
        found = store.recall(text, MOST_EPISODES) if with_episodes else []
        seen, actions = store.last_seen(count=MOST_THINGS), store.past_actions()
    except MemoryUnusable as error:
        _log.warning("%s", error)
        return NO_EXPERIENCE
    return Experience(
        has_memory=True,
        now_s=now_s,
        episodes=tuple(one.episode for one in found),
        last_seen=tuple(one for one in seen if one.seen_s > now_s - OLDEST_S),
        actions=tuple(one for one in actions if one.done_s > now_s - OLDEST_S),
    )
