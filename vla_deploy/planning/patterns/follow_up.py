"""Make plans of the one before: "again", "a bit more", "the other one too", "no, the blue one".

Nothing is repeated that failed, was refused or called off: a person has to say that anew. A
correction is the same with another thing or place, of what was asked or has begun.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from vla_deploy.action_words import action_words
from vla_deploy.planning.builders.steps import way_back
from vla_deploy.planning.errors import Declined, NotAble
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import match_place, object_or_none
from vla_deploy.planning.plan import PUT_IN, Action, Plan, chained
from vla_deploy.planning.scope import IDIOMS
from vla_deploy.planning.understanding import Question
from vla_deploy.planning.understanding.conversation import Outcome, Turn
from vla_deploy.world import Query, UnknownWord, parse_query

_AGAIN: Final = re.compile(
    r"(?:and )?(?:(?:do|try) (?:it|that|this) )?(?:once )?again|once more|one more time|"
    r"repeat(?: (?:it|that))?|(?:do )?the same(?: thing)?(?: again)?"
)
# How much "a bit more" is of the distance, angle or time that was last given outright.
RATIOS: Final[Mapping[str, float]] = {
    r"(?:just )?(?:a (?:tiny |little |wee )?(?:bit|touch|tad)|a little|slightly)": 0.25,
    r"(?:some|quite a bit)?": 0.5,
    r"(?:much|a lot|lots)": 1.0,
    r"(?:twice (?:that|as (?:much|far|long))|double(?: (?:that|it))?)": 2.0,
}
_FURTHER: Final = (
    r" ?(?:more|further|farther|longer)(?: (?:on|ahead|round))?"
    r"(?: than that|,? (?:the same|that) way|,? in (?:the same|that) direction)?"
)
_LESS: Final = r" (?:back(?: again)?(?:,? the other way)?|the other way|less)"
_GO: Final = r"(?:and |now |then )*(?:(?:go|move|drive|turn|rotate|spin|roll|come|wait) )?"
_MORE: Final = tuple(
    (re.compile(f"{_GO}{share}{direction}"), sign * ratio)
    for share, ratio in RATIOS.items()
    for direction, sign in ((_FURTHER if ratio < 2.0 else "", 1.0), (_LESS, -1.0))
)
_BACK: Final = re.compile(
    r"(?:and )?(?:now )?(?:(?:all the way )?back(?: again)?|"
    r"(?:turn|move|drive|go|come|step|roll) back again)"
)
_REVERSE: Final = re.compile(
    r"(?:and )?(?:now )?(?:to )?the other (?:way(?: (?:round|around))?|side|direction)|"
    r"(?:and )?(?:now )?(?:the )?same (?:distance|amount|way|thing)?(?: ?again)?,? "
    r"(?:but |only |just )?(?:backwards?|in reverse|the other way|in the other direction)"
)
# What of a step can be more or less, and can be done in the other direction.
_AMOUNTS: Final = {"move": "distance_m", "turn": "angle_rad", "wait": "duration_s"}
_REVERSIBLE: Final = ("move", "turn")


def follow_up(text: str, request: Request) -> Plan | None:
    """Return the plan of a clause that only points at the command before it, else None.

    Raises:
        NotAble: there is none, it did not end well, or it has no amount.
        Declined: there is no other thing that it could be done with.
    """
    if _AGAIN.fullmatch(text):
        return asked_for(_last(request))
    if _OTHER_TOO.fullmatch(text):
        plan = with_other(asked_for(_last(request)))
        if plan is None:
            raise Declined("there is no one thing of which there may be another")
        return plan
    ratio = _ratio(text)
    if ratio is not None:
        return _more(ratio, request)
    if _REVERSE.fullmatch(text):
        return _reversed(_last(request))
    if _BACK.fullmatch(text):
        return _reversed(_last(request)) or _single(*way_back(request))
    return None


def last_done(request: Request) -> Turn | None:
    """Return the turn before this one if it was carried out, or is."""
    turns = request.conversation.turns
    return turns[-1] if turns and _is_done(turns[-1]) else None


def _is_done(turn: Turn) -> bool:
    return turn.outcome in (Outcome.UNDER_WAY, Outcome.SUCCEEDED) and turn.plan is not None


def _last(request: Request) -> Turn:
    """Return the turn before this one, where that may be done again.

    Raises:
        NotAble: it may not.
    """
    turns = request.conversation.turns
    if not turns:
        raise NotAble("there is no command yet that I could repeat; say the whole command")
    last = turns[-1]
    if not _is_done(last):
        raise NotAble(
            f'"{last.said[:60]}" was not done ({last.outcome.value}), so I do not repeat it; '
            "say the whole command"
        )
    return last


def asked_for(last: Turn) -> Plan:
    """Return the plan of a turn, without what grounding has put in."""
    plan = last.plan or Plan(goal=last.said)
    own = [(one.skill, one.parameters) for one in plan.actions if one.description != PUT_IN]
    return Plan(goal=plan.goal, summary=last.understood, actions=chained(own))


def _single(skill: str, parameters: Mapping[str, Any]) -> Plan:
    words = action_words(skill, parameters)
    return Plan(goal=words, summary=words, actions=chained([(skill, parameters)]))


def _ratio(text: str) -> float | None:
    return next((ratio for pattern, ratio in _MORE if pattern.fullmatch(text)), None)


def _more(ratio: float, request: Request) -> Plan:
    """Return more of the last way, turn or wait, by what was given before any "more"."""
    last = _last(request)
    amount = _amount(last)
    if amount is None:
        raise NotAble(
            f'"{last.said[:60]}" has no distance, angle or time of which I could do more; '
            "say how much"
        )
    skill, value = amount
    for turn in reversed(request.conversation.turns):
        outright = _amount(turn)
        if outright is None or outright[0] != skill:
            break
        value = outright[1]
        if _ratio(turn.said.lower().strip(" .!?")) is None:
            break
    more = round(ratio * value, 4)
    return _single(skill, {_AMOUNTS[skill]: abs(more) if skill == "wait" else more})


def _amount(turn: Turn) -> tuple[str, float] | None:
    """Return the last step of a turn that can be more or less, with its amount in SI units."""
    actions = () if turn.plan is None else turn.plan.actions
    for action in reversed(actions):
        value = action.parameters.get(_AMOUNTS.get(action.skill, ""))
        if isinstance(value, int | float):
            return action.skill, float(value)
    return None


def _reversed(last: Turn) -> Plan | None:
    """Return the last straight way or turn in the other direction, None for other things."""
    amount = _amount(last)
    if amount is None or amount[0] not in _REVERSIBLE:
        return None
    skill, value = amount
    return _single(skill, {_AMOUNTS[skill]: round(-value, 4)})


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
    words, before = correction_in(text), object_or_none(question.expression)
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
        if (thing := object_or_none(action.parameters.get(name))) is not None
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
            thing = object_or_none(" ".join(words[:count]))
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
