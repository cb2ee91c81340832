"""Read from the end of a command how each of its actions went, as it is remembered."""

import re
from collections.abc import Iterator, Sequence
from typing import Any, Final

from vla_deploy.ipc.payloads.tasks import ActionResult
from vla_deploy.memory.episode import PastAction
from vla_deploy.world import UnknownWord, parse_query
from vla_deploy.world.vocabulary import ANY_CLASS

MOST_ACTIONS: Final = 20
"""Of one command, the last ones."""
_ERROR_CHARACTERS: Final = 160
# What was cancelled or never begun says nothing of how it goes.
_WENT: Final = frozenset({"succeeded", "aborted"})
_HAND: Final = re.compile(r"\b(left|right) hand\b")


def past_actions(results: Sequence[ActionResult], done_s: float) -> tuple[PastAction, ...]:
    """Return how the actions of one command went, in their order."""
    went = [one for one in results if one["status"] in _WENT]
    return tuple(_past(one, done_s) for one in went[-MOST_ACTIONS:])


def _past(result: ActionResult, done_s: float) -> PastAction:
    given = result["parameters"]
    kind, colour = _thing(given.get("object"))
    return PastAction(
        skill=result["skill"],
        succeeded=result["status"] == "succeeded",
        kind=kind,
        colour=colour,
        hand=str(given.get("arm") or "") or next(_named_hands(result), ""),
        place=str(given.get("place") or given.get("destination") or ""),
        error=(result["error"] or "")[:_ERROR_CHARACTERS],
        done_s=round(done_s, 1),
    )


def _thing(words: Any) -> tuple[str, str]:
    """Return kind and colour of what an action was about, "" where its words tell neither."""
    if not isinstance(words, str):
        return "", ""
    try:
        query = parse_query(words)
    except UnknownWord:
        return "", ""
    kind = query.thing_id.rpartition("_")[0] or query.kind
    return ("" if kind == ANY_CLASS else kind), query.colour


def _named_hands(result: ActionResult) -> Iterator[str]:
    """Yield the hand that a skill names by itself: in its note, or in what went wrong."""
    for text in (result.get("note"), result["error"]):
        found = _HAND.search(text or "")
        if found is not None:
            yield found[1]
