"""Draft a plan from the table of rules: clause by clause, in the speaker's own words."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from vla_deploy.action_words import action_words
from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import NotUnderstood
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.rules.asides import straightened
from vla_deploy.planning.rules.building import Groups, Step, is_one, parts_of, split_put
from vla_deploy.planning.rules.clauses import (
    MOST_CLAUSES,
    MOST_LETTERS,
    polite_off,
    repaired,
    segments,
)
from vla_deploy.planning.rules.intents import PRIORITIES, Intent
from vla_deploy.planning.rules.refusals import refuse_unable
from vla_deploy.planning.rules.table import RULES, Rule

# Which hand to take: said at the end of a clause, whatever it is about.
_WITH_HAND: Final = re.compile(
    r"(?P<own>.+?),? (?:with|using|in) (?:the|your) (?P<arm>left|right) (?:hand|arm|gripper)"
)
_PACE: Final = re.compile(r",?\b(?:very |really |nice and )?(?:slowly|slow|carefully|gently)\b")
_MANNERS: Final = (
    _WITH_HAND,
    re.compile(r"(?P<own>.+?),? (?:at|with) (?P<speed>[\d.]+ ?(?:m/s|cm/s|km/h|mps|mph))"),
)
# What of a clause can be corrected by a part alone.
_CORRECTED: Final = frozenset({"object", "place", "destination", "quantity", "way", "what"})
# What a rule finds in a clause: all of what is put somewhere, or some of what can be known.
_PUT: Final = ("object", "relation", "destination")
_NAMED: Final = ("object", "place", "destination")
_HELP: Final = re.compile(r"(?:help|assist) me (?:to |with )?(?P<own>.+)")


@dataclass(slots=True)
class _Draft:
    """Hold the steps so far, what they are for, and the last clause, which the next may shorten."""

    request: Request
    steps: list[tuple[Step, Intent]] = field(default_factory=list)
    clause: str = ""
    thing: str = ""
    began: int = 0


@dataclass(frozen=True, slots=True)
class _Fit:
    """Hold the rule that a clause fits."""

    rule: Rule
    groups: Groups


def draft_plan(request: Request) -> Plan:
    """Return the plan of a command as it was said; `ground_plan` makes it one that can run.

    Raises:
        NotUnderstood: no rule covers a clause.
        NotAble: the robot cannot do such a thing.
        UnknownObject: a clause names an object the robot cannot recognise.
    """
    text = request.text
    if len(text) > MOST_LETTERS:
        raise NotUnderstood(f"{text[:60]}...")
    said = straightened(polite_off(text), request)
    helped = _HELP.fullmatch(said)
    parts = segments(said if helped is None else helped["own"])
    if not parts or len(parts) > MOST_CLAUSES:
        raise NotUnderstood(text)
    draft = _Draft(request)
    while parts:
        parts = parts[_take_clause(parts, draft) :]
    return Plan(goal=text.strip(), summary=_summary(draft.steps), actions=_chain(draft.steps))


def _take_clause(parts: Sequence[str], draft: _Draft) -> int:
    """Build the longest clause that the parts begin with; return how many parts it took."""
    for count in range(len(parts), 1, -1):
        clause = " and ".join(parts[:count])
        fit = _fit(clause, draft.request)
        if fit is not None and _is_whole(fit, draft.request):
            _build(clause, fit, draft)
            return count
    clause = parts[0]
    if repaired(clause) is not None:
        return _take_back(parts, draft)
    refuse_unable(clause)
    fit = _fit(clause, draft.request)
    if fit is None and draft.thing:
        clause, fit = _with_verb(clause, draft)
    if fit is None:
        raise NotUnderstood(parts[0])
    _build(clause, fit, draft)
    return 1


def _take_back(parts: Sequence[str], draft: _Draft) -> int:
    """Let "no wait, the blue one" and "I mean the bedroom" take the place of the last clause.

    Raises:
        NotUnderstood: there is nothing to take back, or what shall stand there fits no rule.
    """
    taken, said = 0, ""
    for part in parts:
        taken, instead = taken + 1, repaired(part)
        said = part if instead is None else instead
        if said:
            break
    if not draft.clause or not said:
        raise NotUnderstood(parts[0])
    del draft.steps[draft.began :]
    whole = _in_place(said, draft)
    fit = _fit(whole, draft.request)
    if fit is None:
        raise NotUnderstood(said)
    _build(whole, fit, draft)
    return taken


def _in_place(said: str, draft: _Draft) -> str:
    """Return the last clause with what was said in the place of what it corrects.

    That is the last part of it of the same kind; a clause of its own stands for itself.
    """
    request = draft.request
    own = _fit(said, request)
    if own is not None and _is_known(own, request):
        return said
    before = _fit(draft.clause, request)
    groups = {} if before is None else before.groups
    named = [value for name, value in groups.items() if name in _CORRECTED and value]
    if "relation" in groups:
        named.append(f"{groups['relation']} {groups['destination']}")
    for value in sorted(named, key=draft.clause.rfind, reverse=True):
        at = draft.clause.rfind(value)
        whole = draft.clause[:at] + said + draft.clause[at + len(value) :]
        fit = _fit(whole, request)
        if fit is not None and _is_known(fit, request):
            return whole
    return said


def _with_verb(clause: str, draft: _Draft) -> tuple[str, _Fit | None]:
    """Let the clause before say what to do: "pick up the cup, then the ball"."""
    verb = draft.clause[: draft.clause.index(draft.thing)] if draft.thing in draft.clause else ""
    for whole in (f"{verb}{clause}", draft.clause.replace(draft.thing, clause, 1)):
        fit = _fit(whole, draft.request) if verb and clause.split()[:1] != ["to"] else None
        if fit is not None and _is_known(fit, draft.request):
            return whole, fit
    return clause, None


def _is_known(fit: _Fit, request: Request) -> bool:
    """Tell whether what a clause names is known, so that it is no accident that it fits."""
    put = [fit.groups[name] for name in _PUT if name in fit.groups]
    if len(put) == len(_PUT):
        moved, _, destination = split_put(" ".join(put), request)
        return all(is_one(one, request) for one in (*parts_of(moved), destination))
    named = (fit.groups[name] for name in _NAMED if name in fit.groups)
    return all(is_one(part, request) for text in named for part in parts_of(text))


def _fit(clause: str, request: Request) -> _Fit | None:
    """Return the first rule that fits and names only what is known, else the first that fits.

    What is "for me" may as well not be said.
    """
    fits = [*_fits(clause), *_fits(clause.removesuffix(" for me"))]
    return next((fit for fit in fits if _is_known(fit, request)), fits[0] if fits else None)


def _fits(clause: str) -> Iterator[_Fit]:
    own, manner = _manner_off(clause)
    for rule in RULES:
        found = rule.pattern.fullmatch(own)
        # How fast to drive is nothing that the other skills could heed.
        if found is None or ("speed" in manner and rule.intent is not Intent.NAVIGATION):
            continue
        groups = {
            name.removesuffix("2"): value
            for name, value in found.groupdict().items()
            if value is not None
        }
        yield _Fit(rule, {**groups, **manner})


def _manner_off(clause: str) -> tuple[str, Groups]:
    """Return a clause without how it shall be done, and how: which hand, how fast."""
    manner: dict[str, str] = {"pace": "slow"} if _PACE.search(clause) else {}
    clause = " ".join(_PACE.sub(" ", clause).split())
    for pattern in _MANNERS:
        found = pattern.fullmatch(clause)
        if found is not None:
            clause = found["own"]
            manner |= {name: value for name, value in found.groupdict().items() if name != "own"}
    return clause, manner


def _is_whole(fit: _Fit, request: Request) -> bool:
    """Tell whether each of several things or places that a clause lists is one."""
    listed = [name for name in ("object", "place") if " and " in fit.groups.get(name, "")]
    others = [name for name in fit.groups if name not in listed and " and " in fit.groups[name]]
    return bool(listed) and not others and all(
        is_one(part, request) for name in listed for part in parts_of(fit.groups[name])
    )  # fmt: skip


def _build(clause: str, fit: _Fit, draft: _Draft) -> None:
    steps = fit.rule.build(fit.groups, draft.request)
    draft.began = len(draft.steps)
    draft.steps += [(step, fit.rule.intent) for step in steps]
    draft.clause = clause
    draft.thing = fit.groups.get("object", fit.groups.get("place", ""))


def _chain(steps: Sequence[tuple[Step, Intent]]) -> tuple[Action, ...]:
    return tuple(
        Action(
            id=f"a{number}",
            skill=skill,
            parameters=parameters,
            depends_on=(f"a{number - 1}",) if number > 1 else (),
            priority=PRIORITIES[intent],
        )
        for number, ((skill, parameters), intent) in enumerate(steps, start=1)
    )


def _summary(steps: Sequence[tuple[Step, Intent]]) -> str:
    """Return the intents and the steps in words."""
    intents = ", ".join(dict.fromkeys(intent.value for _, intent in steps))
    said = ", ".join(action_words(skill, parameters) for (skill, parameters), _ in steps)
    return f"{intents}: {said}"
