"""Find the rule that a clause fits: the first that names only what is known."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.rules.building import PUT_GROUPS, Groups, is_one, parts_of, split_put
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.rules.pattern_parts import Rule
from vla_deploy.planning.rules.table import RULES

# Which hand to take: said at the end of a clause, whatever it is about. "What is in your left hand"
# is a thing.
_WITH_HAND: Final = re.compile(
    r"(?P<own>.+?),? "
    r"(?:(?:with|using|(?<! is )(?<!'s )(?<!thing )(?<!object )(?<! one )in) (?:the|your) "
    r"(?P<arm>left|right) (?:hand|arm|gripper)|"
    r"(?:with|using) (?:the|your) (?P<arm2>left|right)(?: one)?|in your (?P<arm3>left|right))"
)
# "In one hand": in either.
_IN_A_HAND: Final = re.compile(
    r"(?P<own>.+?),? (?:with|using|in) (?:(?:one|either|any|a)(?: of (?:your|the))? hands?|"
    r"(?:the|your) other(?: hand| one)?)"
)
HANDS: Final = re.compile(r"\bin (?:your|the) (?:left|right)\b")
_FETCHES: Final = re.compile(r"(?:get|fetch|grab|take|pick|bring)\b")
_PACE: Final = re.compile(r",?\b(?:very |really |nice and )?(?:slowly|slow|carefully|gently)\b")
_MANNERS: Final = (
    _WITH_HAND,
    _IN_A_HAND,
    re.compile(r"(?P<own>.+?),? (?:at|with) (?P<speed>[\d.]+ ?(?:m/s|cm/s|km/h|mps|mph))"),
)
# What a rule finds in a clause: all of what is put somewhere, or some of what can be known.
_NAMED: Final = ("object", "place", "destination")


@dataclass(frozen=True, slots=True)
class Fit:
    """Hold the rule that a clause fits, and what it found in it."""

    rule: Rule
    groups: Groups


def fit_of(clause: str, request: Request) -> Fit | None:
    """Return the first rule that fits and names only what is known, else the first that fits.

    What is "for me" may as well not be said, unless it is brought.
    """
    first: Fit | None = None
    ways = (clause, clause.removesuffix(" for me"))
    for said in dict.fromkeys(ways if _FETCHES.match(clause) else ways[::-1]):
        for fit in _fits(said):
            if is_known(fit, request):
                return fit
            first = first or fit
    return first


def known_fit(clause: str, request: Request) -> Fit | None:
    """Return the first rule that fits and names only what is known, or None."""
    fit = fit_of(clause, request)
    return fit if fit is not None and is_known(fit, request) else None


def is_known(fit: Fit, request: Request) -> bool:
    """Tell whether what a clause names is known, so that it is no accident that it fits."""
    if all(name in fit.groups for name in PUT_GROUPS):
        moved, _, destination = split_put(fit.groups, request)
        return all(is_one(one, request) for one in (*parts_of(moved), destination))
    named = (fit.groups[name] for name in _NAMED if name in fit.groups)
    return all(is_one(part, request) for text in named for part in parts_of(text))


def names_hand(clause: str) -> bool:
    """Tell whether a clause ends with which hand to take."""
    return _WITH_HAND.fullmatch(clause) is not None


def is_whole(fit: Fit, request: Request) -> bool:
    """Tell whether each of several things or places that a clause lists is one."""
    listed = [name for name in ("object", "place") if " and " in fit.groups.get(name, "")]
    others = [name for name in fit.groups if name not in listed and " and " in fit.groups[name]]
    return bool(listed) and not others and all(
        is_one(part, request) for name in listed for part in parts_of(fit.groups[name])
    )  # fmt: skip


def _fits(clause: str) -> Iterator[Fit]:
    own, manner = _manner_off(clause)
    for rule in RULES:
        found = rule.pattern.fullmatch(own)
        # How fast to drive is nothing that the other skills could heed.
        if found is None or ("speed" in manner and rule.intent is not Intent.NAVIGATION):
            continue
        yield Fit(rule, {**_given(found), **manner})


def _given(found: re.Match[str]) -> Groups:
    """Return what a pattern has found; further groups for the same thing have a number behind."""
    return {
        name.rstrip("234"): value for name, value in found.groupdict().items() if value is not None
    }


def _manner_off(clause: str) -> tuple[str, Groups]:
    """Return a clause without how it shall be done, and how: which hand, how fast."""
    manner: dict[str, str] = {"pace": "slow"} if _PACE.search(clause) else {}
    clause = " ".join(_PACE.sub(" ", clause).split())
    for pattern in _MANNERS:
        found = pattern.fullmatch(clause)
        if found is not None:
            clause = found["own"]
            manner |= {name: value for name, value in _given(found).items() if name != "own"}
    return clause, manner
