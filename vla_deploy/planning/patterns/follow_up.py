"""Make plans of the one before: "again", or a correction of it: "no, the blue one".

Nothing is repeated that failed, was refused or called off: a person has to say that anew. A
correction is the same with another thing or place, of what was asked or has begun.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Final

from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.patterns.table import NAMED
from vla_deploy.planning.understanding.conversation import ConversationTurn, TurnOutcome
from vla_deploy.plans.knowledge import match_place, object_or_none
from vla_deploy.plans.plan import PUT_IN, Action, Plan, chained
from vla_deploy.world import UnknownWord, parse_query

_AGAIN: Final = re.compile(
    r"(?:and )?(?:(?:do|try) (?:it|that|this) )?(?:once )?again|once more|one more time|"
    r"repeat(?: (?:it|that))?|(?:do )?the same(?: thing)?(?: again)?"
)


def repeated(text: str, request: PlanRequest) -> Plan | None:
    """Return the plan of a clause that repeats the command before it, None for other clauses.

    Raises:
        NotAble: there is none, or it did not end well.
    """
    if _AGAIN.fullmatch(text) is None:
        return None
    last = last_done(request)
    if last is None:
        raise NotAble("nothing was done before that I could repeat; say the whole command")
    assert last.plan is not None, "it was carried out"
    own = [(one.skill, one.parameters) for one in asked_for(last.plan)]
    return Plan(goal=last.plan.goal, summary=last.understood, actions=chained(own))


def last_done(request: PlanRequest) -> ConversationTurn | None:
    """Return the turn before this one if it was carried out, or is."""
    turns = request.conversation.turns
    is_done = bool(turns) and turns[-1].outcome in (TurnOutcome.UNDER_WAY, TurnOutcome.SUCCEEDED)
    return turns[-1] if is_done and turns[-1].plan is not None else None


def asked_for(plan: Plan) -> list[Action]:
    """Return the actions of a plan that grounding has not put in."""
    return [one for one in plan.actions if one.description != PUT_IN]


# --- "no, the blue one" ---------------------------------------------------------------------------

_NO: Final = r"(?:no,? (?:wait|sorry)|wait,? no|no|nope|wrong|sorry|not that(?: one)?|not it)"
_CORRECTIONS: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_NO}[,. ]+(?:i (?:meant?|said|want(?:ed)?)|rather|take|use|make it)[, ]+(?P<rest>.+)",
        # "No phone" is about none.
        rf"{_NO}(?:[,.]+ *| (?=(?:the|my|your|that|an?) ))(?P<rest>.+)",
        r"i meant? (?P<rest>.+)",
        r"(?P<rest>the other(?: one)?)",
    )
)
_INSTEAD: Final = re.compile(r"[, ]+(?:instead|please|rather)$", re.IGNORECASE)
_ONE: Final = re.compile(r"\bones?\b", re.IGNORECASE)
_OTHER: Final = re.compile(r"(?:the )?other(?: one)?", re.IGNORECASE)


def correction_in(text: str) -> str:
    """Return what follows a no, "" where nothing does."""
    said = text.strip().strip(".!")
    found = next((one for one in (it.fullmatch(said) for it in _CORRECTIONS) if one), None)
    return "" if found is None else _INSTEAD.sub("", found["rest"]).strip()


def corrected(
    command: str, text: str, about: Iterable[object], places: Mapping[str, str]
) -> str | None:
    """Return a command as an utterance corrects it, None where it does not, or not clearly.

    What was said takes the place of the only thing of its kind in the command, else of the only
    kind of thing that it is `about`, or of the only place.

    "no, the can", about "pick up the cup" -> "pick up the can"; "no, the blue one" -> "the blue
    cup".
    """
    words = correction_in(text)
    if not words:
        return None
    if match_place(words, places) is not None:
        longest_first = sorted(map(re.escape, places), key=len, reverse=True)
        return _exchanged(command, rf"(?:the )?(?:{'|'.join(longest_first)})", words)
    wanted = object_or_none(words)
    spots = [found[0] for found in NAMED.finditer(command.lower())]
    named = {spot: one.kind for spot in spots if (one := object_or_none(spot)) is not None}
    kinds = {wanted.kind} & {*named.values()} if wanted is not None else set()
    kinds = kinds or {one.kind for one in map(object_or_none, about) if one is not None}
    meant = [spot for spot in spots if named.get(spot) in (kinds or {*named.values()})]
    if len(meant) != 1 or (wanted is None and not _tells_apart(words)):
        return None
    if wanted is None:  # "the blue one", "blue", "the other one"
        kind = named[meant[0]]
        words = _ONE.sub(kind, words) if _ONE.search(words) else f"{words} {kind}"
    return _exchanged(command, re.escape(meant[0]), words)


def _tells_apart(words: str) -> bool:
    """Return whether words tell one thing from others without naming its kind."""
    if _OTHER.fullmatch(words):
        return True
    try:
        parse_query(words)
    except UnknownWord:
        return False
    return True


def _exchanged(command: str, spot: str, words: str) -> str | None:
    told, count = re.subn(rf"\b{spot}\b", lambda _: words, command, flags=re.IGNORECASE)
    return told if count == 1 else None
