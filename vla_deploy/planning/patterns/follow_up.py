"""Plan commands that lean on the one before: "again", "a bit more", "the other way".

Nothing is repeated that failed, was refused or called off: a person has to say that anew.
"""

import re
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.action_words import action_words
from vla_deploy.planning.builders.steps import way_back
from vla_deploy.planning.dialogue.correction import wants_other_too, with_other
from vla_deploy.planning.errors import Declined, NothingBefore
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import PUT_IN, Plan, chained
from vla_deploy.planning.understanding.conversation import Outcome, Turn

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
        NothingBefore: there is none, it did not end well, or it has no amount.
        Declined: there is no other thing that it could be done with.
    """
    if _AGAIN.fullmatch(text):
        return asked_for(_last(request))
    if wants_other_too(text):
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
        NothingBefore: it may not.
    """
    turns = request.conversation.turns
    if not turns:
        raise NothingBefore("there is no command yet that I could repeat; say the whole command")
    last = turns[-1]
    if not _is_done(last):
        raise NothingBefore(
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
        raise NothingBefore(
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
