"""Make plans of the one before: "again", or a correction of it: "no, the blue one".

Nothing is repeated that failed, was refused or called off: a person has to say that anew. A
correction is the same with another thing or place, of what was asked or has begun.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import match_place, object_or_none
from vla_deploy.planning.plan import PUT_IN, Plan, chained
from vla_deploy.planning.scope import IDIOMS
from vla_deploy.planning.understanding.conversation import Outcome, Question, Turn
from vla_deploy.world import Query, UnknownWord, parse_query

_AGAIN: Final = re.compile(
    r"(?:and )?(?:(?:do|try) (?:it|that|this) )?(?:once )?again|once more|one more time|"
    r"repeat(?: (?:it|that))?|(?:do )?the same(?: thing)?(?: again)?"
)


def repeated(text: str, request: Request) -> Plan | None:
    """Return the plan of a clause that repeats the command before it, None for other clauses.

    Raises:
        NotAble: there is none, or it did not end well.
    """
    if _AGAIN.fullmatch(text) is None:
        return None
    last = last_done(request)
    if last is None:
        raise NotAble("nothing was done before that I could repeat; say the whole command")
    return asked_for(last)


def last_done(request: Request) -> Turn | None:
    """Return the turn before this one if it was carried out, or is."""
    turns = request.conversation.turns
    is_done = bool(turns) and turns[-1].outcome in (Outcome.UNDER_WAY, Outcome.SUCCEEDED)
    return turns[-1] if is_done and turns[-1].plan is not None else None


def asked_for(last: Turn) -> Plan:
    """Return the plan of a turn, without what grounding has put in."""
    plan = last.plan or Plan(goal=last.said)
    own = [(one.skill, one.parameters) for one in plan.actions if one.description != PUT_IN]
    return Plan(goal=plan.goal, summary=last.understood, actions=chained(own))


# --- "no, the blue one" ---------------------------------------------------------------------------

CORRECTED: Final = "correction"
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
_REJECTS: Final = re.compile(rf"(?!sorry){_NO}(?:[,.!]| (?:the|my|your|that|an?)\b)")
_OTHER: Final = re.compile(r"(?:the )?other(?: one)?", re.IGNORECASE)
_INSTEAD: Final = re.compile(r"[, ]+(?:instead|please|rather)$", re.IGNORECASE)
_ONE: Final = re.compile(r"\bones?\b", re.IGNORECASE)
_NAMES_THINGS: Final = ("object", "destination")


def correction_in(text: str) -> str:
    """Return what follows a no, "" where nothing does."""
    said = text.strip().strip(".!")
    found = next((one for one in (it.fullmatch(said) for it in _CORRECTIONS) if one), None)
    return "" if found is None else _INSTEAD.sub("", found["rest"]).strip()


def rejects(text: str) -> bool:
    """Tell whether an utterance begins with a no, whatever else it says."""
    return _REJECTS.match(IDIOMS.sub(" ", text.strip().lower())) is not None


def corrected_text(question: Question, text: str) -> str | None:
    """Return the command that waits for an answer with another thing than the one that is unclear.

    "no, the can", to "Which cup, ...?" about "pick up the cup" -> "pick up the can".
    """
    words = correction_in(text)
    if not question.expression or object_or_none(words) is None:
        return None
    spot = rf"\b(?:(?:the|an?|my|your) )?{re.escape(question.expression)}\b"
    told, count = re.subn(spot, words, question.command_text, flags=re.IGNORECASE)
    return told if count == 1 else None


def corrected_by(plan: Plan, text: str, places: Mapping[str, str]) -> Plan | None:
    """Return what becomes of a plan by an utterance, None where it corrects nothing.

    A plan that says something is not corrected: that may be about what is exchanged.
    """
    words = correction_in(text)
    if not words or any(one.skill == "speak" for one in plan.actions):
        return None
    return _with_thing(plan, words) or _with_place(plan, words, places)


def _with_thing(plan: Plan, words: str) -> Plan | None:
    """Return the plan with another thing in the place of the one that the words can replace.

    That is the only thing of the kind that they name, else the only thing taken. None where the
    words are no such thing, or several could be meant.
    """
    wanted = _query(words)
    is_other = _OTHER.fullmatch(words) is not None
    if wanted is None and not is_other:
        return None
    things = [
        (name, str(action.parameters[name]), thing)
        for action in plan.actions
        for name in _NAMES_THINGS
        if (thing := object_or_none(action.parameters.get(name))) is not None
    ]
    is_kind = wanted is not None and wanted.is_named
    alike = [one for one in things if is_kind and wanted and one[2].kind == wanted.kind]
    meant = alike or [one for one in things if one[0] == "object"]
    if len({(thing.kind, thing.colour, thing.thing_id) for _, _, thing in meant}) != 1:
        return None
    kind, named = meant[0][2].kind, {text for _, text, _ in meant}
    if is_other:
        words = f"the other {kind}"
    elif not is_kind:  # "the blue one", or "blue"
        words = _ONE.sub(kind, words) if _ONE.search(words) else f"{words} {kind}"
    changes = (
        {name: words for name in _NAMES_THINGS if action.parameters.get(name) in named}
        for action in plan.actions
    )
    return _changed(plan, changes)


def _with_place(plan: Plan, words: str, places: Mapping[str, str]) -> Plan | None:
    """Return the plan with another place as the only destination, else as the only goal."""
    if match_place(words, places) is None:
        return None
    for name in ("destination", "place"):
        named = {str(one.parameters[name]) for one in plan.actions if name in one.parameters}
        if len(named) > 1:
            return None
        if named:  # things are put onto a place, not into it
            change = {name: words, "relation": None}
            return _changed(
                plan, (change if name in one.parameters else {} for one in plan.actions)
            )
    return None


def _changed(plan: Plan, changes: Iterable[Mapping[str, str | None]]) -> Plan:
    """Return a plan with other parameters of each action, None for none, summed up by nobody."""
    actions = tuple(
        action.model_copy(update={"parameters": _merged(action.parameters, change)})
        for action, change in zip(plan.actions, changes, strict=True)
    )
    return plan.model_copy(update={"actions": actions, "summary": "", "reasoning": ""})


def _merged(parameters: Mapping[str, Any], change: Mapping[str, str | None]) -> dict[str, Any]:
    return {name: value for name, value in {**parameters, **change}.items() if value is not None}


def _query(words: str) -> Query | None:
    try:
        return parse_query(words)
    except UnknownWord:
        return None
