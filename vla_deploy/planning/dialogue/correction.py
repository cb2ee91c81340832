"""Take "no, the blue one" to a plan that was read back: the same plan with another thing."""

import re
from dataclasses import replace
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.references import ObjectQuery, parse_object
from vla_deploy.world import Query, UnknownWord, parse_query

CORRECTED: Final = "correction"
_CORRECTION: Final = re.compile(
    r"(?:(?:no,? (?:wait|sorry)|wait,? no|no|nope|wrong|sorry|not that(?: one)?|not it)\b[,. ]*"
    r"(?:(?:i (?:meant|mean|said|wanted|want)|rather|take|use|make it)\b)?|i meant?\b)"
    r"[, ]*(?P<rest>.+)",
    re.IGNORECASE,
)
_INSTEAD: Final = re.compile(r"[, ]+(?:instead|please|rather)$", re.IGNORECASE)
_ONE: Final = re.compile(r"\bones?\b", re.IGNORECASE)
_NAMES_THINGS: Final = ("object", "destination")
_ARTICLE: Final = r"(?:the|an?|my|your)\b"
_CALLED: Final = re.compile(
    rf"\b(?P<article>{_ARTICLE})(?P<words>(?: (?!{_ARTICLE})\w+){{1,4}})", re.IGNORECASE
)


def correction_in(text: str) -> str:
    """Return what follows a no, "" where nothing does."""
    found = _CORRECTION.fullmatch(text.strip().strip(".!"))
    return "" if found is None else _INSTEAD.sub("", found["rest"]).strip()


def corrected_by(plan: Plan | None, text: str) -> Plan | None:
    """Return what becomes of a plan by an utterance, None where it corrects nothing."""
    words = correction_in(text)
    return corrected(plan, words) if words and plan is not None else None


def corrected(plan: Plan, words: str) -> Plan | None:
    """Return the plan with another thing in the place of the one that the words can replace.

    That is the only thing of the kind that they name, or the only thing taken where they name none.
    What the plan says of it is said of the other. None where the words are no such thing, or
    several things could be meant.
    """
    wanted = _query(words)
    if wanted is None:
        return None
    named = {
        str(action.parameters[name]): thing
        for action in plan.actions
        for name in _NAMES_THINGS
        if (thing := _thing(action.parameters.get(name))) is not None
        and (wanted.kind == thing.kind if wanted.is_named else name == "object")
    }
    kinds = {(thing.kind, thing.colour, thing.track_id) for thing in named.values()}
    if len(kinds) != 1:
        return None
    kind = next(iter(kinds))[0]
    instead = words if wanted.is_named else _ONE.sub(kind, words)
    if not _ONE.search(words) and not wanted.is_named:
        instead = f"{words} {kind}"
    actions = tuple(
        _saying(action, kind, instead)
        if action.skill == "speak"
        else _with(action, set(named), instead)
        for action in plan.actions
    )
    return plan.model_copy(update={"actions": actions, "summary": "", "reasoning": ""})


def _saying(action: Action, kind: str, instead: str) -> Action:
    """Return what is said with "the blue cup" wherever it calls a cup by any words."""
    wanted = _query(instead)
    text = action.parameters.get("text")
    if wanted is None or not isinstance(text, str):
        return action
    name = str(replace(wanted, thing_id="", order="", relation="", anchor=None))

    def renamed(found: re.Match[str]) -> str:
        words = found["words"].split()
        for count in range(len(words), 0, -1):
            thing = _thing(" ".join(words[:count]))
            if thing is not None and thing.kind == kind and not thing.asked.relation:
                the = "The" if found["article"][0].isupper() else "the"
                return " ".join((the, name, *words[count:]))
        return found[0]

    return action.model_copy(
        update={"parameters": {**action.parameters, "text": _CALLED.sub(renamed, text)}}
    )


def _with(action: Action, names: set[str], instead: str) -> Action:
    parameters = {
        name: instead if name in _NAMES_THINGS and str(value) in names else value
        for name, value in action.parameters.items()
    }
    return action.model_copy(update={"parameters": parameters})


def _query(words: str) -> Query | None:
    try:
        return parse_query(words)
    except UnknownWord:
        return None


def _thing(words: object) -> ObjectQuery | None:
    if not isinstance(words, str):
        return None
    try:
        return parse_object(words)
    except UnknownObject:  # a place
        return None
