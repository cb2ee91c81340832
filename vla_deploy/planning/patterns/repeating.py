"""Put into full words what a command leaves to the one before it: "again", "a bit more", "back".

Nothing is repeated that failed, was refused or called off: a person has to say that anew.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.planning.errors import NothingBefore
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import PUT_IN, Plan
from vla_deploy.planning.understanding.conversation import Outcome, Turn

_AGAIN: Final = re.compile(
    r"(?:and )?(?:(?:do|try) (?:it|that|this) )?(?:once )?again|once more|one more time|"
    r"repeat(?: (?:it|that))?|(?:do )?the same(?: thing)?(?: again)?"
)
# How much "a bit more" is of the distance, angle or time that was last given outright.
RATIOS: Final[Mapping[str, float]] = {
    r"(?:just )?a (?:tiny |little |wee )?(?:bit|touch|tad|fraction)": 0.25,
    r"(?:just )?a little|slightly": 0.25,
    r"(?:some|quite a bit)": 0.5,
    r"": 0.5,
    r"(?:much|a lot|lots)": 1.0,
}
_FURTHER: Final = (
    r"(?:more|further|farther|longer)(?: (?:on|ahead|round))?"
    r"(?: than that|,? (?:the same|that) way|,? in (?:the same|that) direction)?"
)
_LESS: Final = r"(?:back(?: again)?(?:,? the other way)?|the other way|less)"
_SHARES: Final[Mapping[str, float]] = {
    r"half (?:that|as (?:much|far|long)|the (?:way|distance))(?: again)?": 0.5,
    r"(?:as much|the same amount|that much)(?: again)?": 1.0,
    r"twice (?:that|as (?:much|far|long))|double(?: (?:that|it))?": 2.0,
}
_GO: Final = r"(?:and |now |then )*(?:(?:go|move|drive|turn|rotate|spin|roll|come|wait) )?"
_MORE: Final[tuple[tuple[re.Pattern[str], float], ...]] = tuple(
    (re.compile(rf"{_GO}(?:{words})"), ratio)
    for words, ratio in (
        *((rf"(?:{bit}) {_FURTHER}" if bit else _FURTHER, ratio) for bit, ratio in RATIOS.items()),
        *((rf"(?:{bit}) {_LESS}", -ratio) for bit, ratio in RATIOS.items() if bit),
        *_SHARES.items(),
    )
)
_ALL_BACK: Final = r"(?:all the way )?back(?: again)?"
_BACK: Final = re.compile(
    rf"(?:and )?(?:now )?(?:{_ALL_BACK}|"
    r"(?:turn|move|drive|go|come|step|roll) back again)"
)
# After a look these are for the head.
_AHEAD: Final = re.compile(
    rf"(?:and )?(?:now )?(?:{_ALL_BACK}(?: to the (?:middle|cent(?:re|er)))?|"
    r"(?:back |look )*(?:straight )?(?:ahead|forwards?|in front(?: of you)?|to the middle)"
    r"(?: again)?)"
)
_REVERSE: Final = re.compile(
    r"(?:and )?(?:now )?(?:to )?the other (?:way(?: (?:round|around))?|side|direction)|"
    r"(?:and )?(?:now )?(?:the )?same (?:distance|amount|way|thing)?(?: ?again)?,? "
    r"(?:but |only |just )?(?:backwards?|in reverse|the other way|in the other direction)"
)

Amounts = tuple[str, Callable[[float], str]]


def _straight(distance_m: float) -> str:
    return f"move {'backward' if distance_m < 0 else 'forward'} {_figure(distance_m)} m"


def _turning(angle_rad: float) -> str:
    return f"turn {'right' if angle_rad < 0 else 'left'} {_figure(angle_rad)} rad"


def _waiting(duration_s: float) -> str:
    return f"wait {_figure(duration_s)} s"


def _figure(value: float) -> str:
    return f"{abs(value):.4f}".rstrip("0").rstrip(".")


# What of a step can be more or less, and the words for it.
_AMOUNTS: Final[Mapping[str, Amounts]] = {
    "move": ("distance_m", _straight),
    "turn": ("angle_rad", _turning),
    "wait": ("duration_s", _waiting),
}


def recalled(text: str, request: Request) -> str | None:
    """Return the full words of a command that only points at the one before it, else None.

    Raises:
        NothingBefore: there is none, it did not end well, or it has no amount.
    """
    ratio = _ratio(text)
    if ratio is not None:
        return _more(ratio, request)
    if _REVERSE.fullmatch(text):
        return _reverse(request)
    if _AHEAD.fullmatch(text) and any(map(_looked, request.conversation.turns[-1:])):
        return "look ahead"
    return (_reverse(request) or "go back") if _BACK.fullmatch(text) else None


def is_again(text: str) -> bool:
    """Tell whether words want what was done last to be done again, and nothing else."""
    return _AGAIN.fullmatch(text) is not None


def can_repeat(request: Request) -> bool:
    """Tell whether the command before this one was carried out, or is."""
    last = next(iter(request.conversation.turns[-1:]), None)
    is_done = last is not None and last.outcome in (Outcome.UNDER_WAY, Outcome.SUCCEEDED)
    return is_done and last is not None and last.plan is not None


def repeated(request: Request) -> Plan:
    """Return the plan of the command before this one, without what grounding has put in.

    Raises:
        NothingBefore: there is none, or it did not end well.
    """
    last = _last(request)
    own = [one for one in last.plan.actions if one.description != PUT_IN] if last.plan else []
    chained = tuple(
        one.model_copy(update={"depends_on": (own[number - 1].id,) if number else ()})
        for number, one in enumerate(own)
    )
    return Plan(goal=last.words, summary=last.understood, actions=chained)


def _last(request: Request) -> Turn:
    """Return the turn before this one, where that may be done again.

    Raises:
        NothingBefore: it may not.
    """
    turns = request.conversation.turns
    if not turns:
        raise NothingBefore("there is no command yet that I could repeat; say the whole command")
    last = turns[-1]
    if not can_repeat(request):
        raise NothingBefore(
            f'"{last.said[:60]}" was not done ({last.outcome.value}), so I do not repeat it; '
            "say the whole command"
        )
    return last


def _ratio(text: str) -> float | None:
    return next((ratio for pattern, ratio in _MORE if pattern.fullmatch(text)), None)


def _more(ratio: float, request: Request) -> str:
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
    return _AMOUNTS[skill][1](ratio * value)


def _amount(turn: Turn) -> tuple[str, float] | None:
    """Return the last step of a turn that can be more or less, with its amount in SI units."""
    actions = () if turn.plan is None else turn.plan.actions
    for action in reversed(actions):
        if action.skill in _AMOUNTS:
            return action.skill, _number(action.parameters.get(_AMOUNTS[action.skill][0]))
    return None


def _reverse(request: Request) -> str | None:
    """Return the last straight way, turn or look in the other direction, None for other things."""
    last = _last(request)
    if way := _looked(last):
        return f"look {_OPPOSITE[way]}"
    amount = _amount(last)
    if amount is None or amount[0] == "wait":
        return None
    skill, value = amount
    return _AMOUNTS[skill][1](-value)


_OPPOSITE: Final = {"left": "right", "right": "left", "up": "down", "down": "up"}


def _looked(turn: Turn) -> str:
    """Return the side to which a turn's last action turned the head, "" for none."""
    if turn.plan is None:
        return ""
    action = turn.plan.actions[-1]
    way = str(action.parameters.get("direction", ""))
    return way if action.skill == "look_at" and way in _OPPOSITE else ""


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
