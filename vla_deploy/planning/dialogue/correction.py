"""Take "no, the blue one" to what was asked or has begun: the same with another thing or place."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.knowledge import match_place, parse_object
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.scope import IDIOMS
from vla_deploy.planning.understanding import Question
from vla_deploy.world import Query, UnknownWord, parse_query

CORRECTED: Final = "correction"
_NO: Final = r"(?:no,? (?:wait|sorry)|wait,? no|no|nope|wrong|sorry|not that(?: one)?|not it)"
_CORRECTIONS: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_NO}[,. ]+(?:i (?:meant?|said|want(?:ed)?)|rather|take|use|make it)[, ]+(?P<rest>.+)",
        # "No phone" is about none.
        rf"{_NO}(?:[,.]+ *| (?=(?:the|my|your|that|an?) ))(?P<rest>.+)",
        r"i meant? (?P<rest>.+)",
        r"(?P<rest>.+?),? i meant?",
        r"(?P<rest>the other(?: one)?)",
    )
)
_REJECTS: Final = re.compile(rf"(?!sorry){_NO}(?:[,.!]| (?:the|my|your|that|an?)\b)")
_OTHER: Final = re.compile(r"(?:the )?other(?: one)?", re.IGNORECASE)
_OTHER_TOO: Final = re.compile(r"the other (?:one|thing)(?:,? (?:too|as well|also))")
_INSTEAD: Final = re.compile(r"[, ]+(?:instead|please|rather)$", re.IGNORECASE)
_ONE: Final = re.compile(r"\bones?\b", re.IGNORECASE)
_NAMES_THINGS: Final = ("object", "destination")
_ARTICLE: Final = r"(?:the|an?|my|your)\b"
_CALLED: Final = re.compile(
    rf"\b(?P<article>{_ARTICLE})(?P<words>(?: (?!{_ARTICLE})\w+){{1,4}})", re.IGNORECASE
)


def correction_in(text: str) -> str:
    """Return what follows a no, "" where nothing does."""
    said = text.strip().strip(".!")
    found = next((one for one in (it.fullmatch(said) for it in _CORRECTIONS) if one), None)
    return "" if found is None else _INSTEAD.sub("", found["rest"]).strip()


def rejects(text: str) -> bool:
    """Tell whether an utterance begins with a no, whatever else it says."""
    return _REJECTS.match(IDIOMS.sub(" ", text.strip().lower())) is not None


def wants_other_too(clause: str) -> bool:
    """Tell whether a clause wants the last command done with the other thing as well."""
    return _OTHER_TOO.fullmatch(clause) is not None


def corrected_by(plan: Plan | None, text: str, places: Mapping[str, str]) -> Plan | None:
    """Return what becomes of a plan by an utterance, None where it corrects nothing."""
    words = correction_in(text)
    if not words or plan is None:
        return None
    return corrected(plan, words) or _with_place(plan, words, places)


def corrected_text(question: Question, text: str, places: Mapping[str, str]) -> str | None:
    """Return the command that waits for an answer with what was said in place of what is unclear.

    "no, the can", to "Which cup, ...?" about "pick up the cup" -> "pick up the can".
    """
    words, before = correction_in(text), _thing(question.expression)
    if not words or not question.expression:
        return None
    wanted = _query(words)
    if wanted is None and match_place(words, places) is None:
        return None
    if wanted is not None and not wanted.is_named:
        if before is None:
            return None
        words = _of_kind(words, before.kind)
    spot = re.compile(rf"\b(?:{_ARTICLE} )?{re.escape(question.expression)}\b", re.IGNORECASE)
    told, count = spot.subn(words, question.command_text)
    return told if count == 1 else None


def corrected(plan: Plan, words: str) -> Plan | None:
    """Return the plan with another thing in the place of the one that the words can replace.

    That is the only thing of the kind that they name, else the only thing taken. What the plan says
    of it is said of the other. None where the words are no such thing, or several could be meant.
    """
    wanted = _query(words)
    is_other = _OTHER.fullmatch(words) is not None
    if wanted is None and not is_other:
        return None
    things = [
        (name, str(action.parameters[name]), thing)
        for action in plan.actions
        for name in _NAMES_THINGS
        if (thing := _thing(action.parameters.get(name))) is not None
    ]
    is_kind = wanted is not None and wanted.is_named
    alike = [one for one in things if is_kind and wanted and one[2].kind == wanted.kind]
    meant = alike or [one for one in things if one[0] == "object"]
    if len({(thing.kind, thing.colour, thing.thing_id) for _, _, thing in meant}) != 1:
        return None
    kind, named = meant[0][2].kind, {text for _, text, _ in meant}
    instead = f"the other {kind}" if is_other else words if is_kind else _of_kind(words, kind)
    told = (
        _saying(action, kind, instead)
        if action.skill == "speak"
        else _changed(
            action,
            **{name: instead for name in _NAMES_THINGS if action.parameters.get(name) in named},
        )
        for action in plan.actions
    )
    return _doing(plan, told)


def with_other(plan: Plan) -> Plan | None:
    """Return the plan with the other thing: of the same kind, or what the other hand holds."""
    taken = corrected(plan, "the other one")
    puts = [one for one in plan.actions if one.skill == "place"]
    if taken is not None or len(puts) != len(plan.actions):
        return taken
    return _doing(plan, (_changed(one, object="the other one", arm=None) for one in puts))


def _of_kind(words: str, kind: str) -> str:
    """Return "the blue cup" for "the blue one" or "blue"."""
    return _ONE.sub(kind, words) if _ONE.search(words) else f"{words} {kind}"


def _with_place(plan: Plan, words: str, places: Mapping[str, str]) -> Plan | None:
    """Return the plan with another place as the only destination, else as the only goal."""
    if match_place(words, places) is None:
        return None
    for name in ("destination", "place"):
        named = {str(one.parameters[name]) for one in plan.actions if name in one.parameters}
        if len(named) > 1:
            return None
        if named:  # things are put onto a place, not into it
            told = (
                _changed(one, relation=None, **{name: words}) if name in one.parameters else one
                for one in plan.actions
            )
            return _doing(plan, told)
    return None


def _doing(plan: Plan, actions: Iterable[Action]) -> Plan:
    """Return a plan with other actions, which nobody has summed up."""
    return plan.model_copy(update={"actions": tuple(actions), "summary": "", "reasoning": ""})


def _changed(action: Action, **changes: str | None) -> Action:
    """Return an action with other parameters; None leaves one out."""
    parameters = {**action.parameters, **changes}
    kept = {name: value for name, value in parameters.items() if value is not None}
    return action.model_copy(update={"parameters": kept})


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
            if thing is not None and thing.kind == kind and not thing.relation:
                the = "The" if found["article"][0].isupper() else "the"
                return " ".join((the, name, *words[count:]))
        return found[0]

    return action.model_copy(
        update={"parameters": {**action.parameters, "text": _CALLED.sub(renamed, text)}}
    )


def _query(words: str) -> Query | None:
    try:
        return parse_query(words)
    except UnknownWord:
        return None


def _thing(words: object) -> Query | None:
    if not isinstance(words, str):
        return None
    try:
        return parse_object(words)
    except UnknownObject:  # a place
        return None
