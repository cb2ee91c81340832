"""Bring what shall be done into the order of doing: "before A, B" is "B, then A".

A subordinate clause is read where it says what the robot itself shall do or has done. What waits
for something else to happen ("when you see the ball") is a condition, and stays as it was said.
"""

import re
from collections.abc import Callable, Mapping
from typing import Final

from vla_deploy.planning.rules.clauses import courtesy_off, is_stop
from vla_deploy.planning.rules.verbs import FORMS

Known = Callable[[str], bool]

# How one says that one is somewhere: that is where to go.
_THERE: Final = re.compile(
    r"(?:are|'re|get|have got|'ve got|have arrived|'ve arrived|arrive|have been|'ve been|reach|"
    r"have reached|'ve reached) ?(?:in|at|to|back (?:in|at)|before)? (?P<place>the .+|my .+)"
)
# What only says that the clause before it is done.
_DONE: Final = re.compile(
    r",? ?\b(?:once|when|as soon as|after) (?:you(?:'re| are| get| have got|'ve got| have arrived|"
    r"'ve arrived| arrive| have done| have finished|'ve done|'ve finished)(?: (?:back|over))?"
    r"(?: (?:there|done|finished|ready|that|it|so))*|(?:that|it)(?:'s| is| has been)? done|"
    r"(?:you(?:'ve| have)(?: got)?|you hold) (?:it|them))(?:,| then\b)? ?"
)
_AFTER: Final = r"(?:after(?:wards)?|once|as soon as|when)"
_SUBJECT: Final = r"(?:you(?:'ve| have|'re| are|'ll|'d)?(?: just| first| then)? ?)?"
_PATTERNS: Final[tuple[re.Pattern[str], ...]] = tuple(
    re.compile(pattern)
    for pattern in (
        r"before (?P<under_later>[^,]+?),(?: then)? (?P<first>.+)",
        rf"{_AFTER} (?P<under_first>[^,]+?),(?: then)? (?P<later>.+)",
        r"(?P<later>.+?)[,.]? but (?:first(?: of all)?|before(?:hand| that)),? (?P<first>.+)",
        r"(?P<later>.+?)[,.]? but (?P<first>.+) (?:first|before(?:hand| that))",
        r"(?P<first>.+?),? before (?P<under_later>.+)",
        rf"(?P<later>.+?),? {_AFTER} (?P<under_first>.+)",
    )
)
_UNPARTED: Final = re.compile(rf"(?P<word>before|{_AFTER}) (?P<rest>[^,]+)")
# These hold the robot up, or forbid: they are no part of an order.
_HOLDING: Final = re.compile(r"(?:stop|halt|freeze|wait|hold on|pause|don'?t|do not|never|not)\b")


def in_order(text: str, is_known: Known) -> str:
    """Return a command with its parts in the order of doing, else as it was.

    `is_known` tells whether a text is one clause that the rules can build.
    """
    text = _DONE.sub(lambda found: ", then " if found.start() and found.end() < len(text) else
                     found[0], text)  # fmt: skip
    for pattern in _PATTERNS:
        found = pattern.fullmatch(text)
        ordered = None if found is None else _ordered(found.groupdict())
        if ordered is not None:
            return ordered
    return _parted(text, is_known) or text


def _ordered(parts: Mapping[str, str]) -> str | None:
    """Return what comes first, then what comes later; None where either is no such thing."""
    first = _command(parts, "first")
    later = _command(parts, "later")
    if not first or not later or any(map(_holds, (first, later))):
        return None
    return f"{first}, then {later}"


def _parted(text: str, is_known: Known) -> str | None:
    """Return the order of "after you've gone to the kitchen find the keys", said in one breath."""
    found = _UNPARTED.fullmatch(text)
    if found is None:
        return None
    under, main = ("later", "first") if found["word"] == "before" else ("first", "later")
    words = found["rest"].split()
    for at in range(len(words) - 1, 1, -1):
        if words[at] not in FORMS.values():
            continue
        halves = {f"under_{under}": " ".join(words[:at]), main: " ".join(words[at:])}
        commands = (_command(halves, under), halves[main])
        if all(one is not None and is_known(one) for one in commands):
            return _ordered(halves)
    return None


def _command(parts: Mapping[str, str], name: str) -> str | None:
    """Return a part as a command: "you've put it down" is "put it down"."""
    if name in parts:
        return courtesy_off(parts[name])
    said = parts[f"under_{name}"].strip()
    somewhere = re.fullmatch(rf"you ?{_THERE.pattern}", said)
    if somewhere is not None:
        return f"go to {somewhere['place']}"
    said = re.sub(rf"^{_SUBJECT}", "", said)
    verb, _, rest = said.partition(" ")
    return f"{FORMS[verb]} {rest}".strip() if verb in FORMS else None


def _holds(command: str) -> bool:
    return is_stop(command) or _HOLDING.match(command) is not None
