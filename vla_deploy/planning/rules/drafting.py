"""Draft a plan from the table of rules: clause by clause, in the speaker's own words."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from vla_deploy.action_words import action_words
from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import NothingBefore, NotUnderstood, PlanningError
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.references import match_place
from vla_deploy.planning.rules.asides import straightened
from vla_deploy.planning.rules.building import Step, is_one
from vla_deploy.planning.rules.clauses import (
    MOST_CLAUSES,
    MOST_LETTERS,
    courtesy_off,
    plain,
    polite_off,
    repaired,
    segments,
)
from vla_deploy.planning.rules.exchanging import continued, corrected, tells_of_another
from vla_deploy.planning.rules.fits import HANDS, Fit, fit_of, is_whole, known_fit, names_hand
from vla_deploy.planning.rules.intents import PRIORITIES, Intent
from vla_deploy.planning.rules.ordering import in_order
from vla_deploy.planning.rules.pointing_back import by_another, pointing_alone
from vla_deploy.planning.rules.recalling import is_again, last_words, leans, recalled, same_with
from vla_deploy.planning.rules.refusals import refuse_unable
from vla_deploy.planning.rules.second_thoughts import outright, thought_again
from vla_deploy.planning.rules.statements import begins_with_statement, statements_off
from vla_deploy.planning.understanding.conversation import Conversation
from vla_deploy.planning.understanding.phrases import PRONOUNS

# What of a clause the next one may exchange.
_THINGS: Final = ("object", "place", "what")
_NEXT_VERB: Final = re.compile(
    r"(?<!\bto )(?<!\bi )(?<!\bme )(?<!\byou )"
    r"\b(?:get|fetch|grab|pick|take|put|bring|find|turn|go|drive|come|open|close|drop|place|look|wait|"
    r"tell|say)\b(?= )"
)
_INTO: Final = re.compile(r"\b(?:into|onto)\b")
_IN_THE_SIDE: Final = re.compile(r"\bin the (?:left|right)$")
_TO_WHERE: Final = re.compile(r"\w (?:to|into|in|onto|on) (?:the|my|your) \w")
_HELP: Final = re.compile(r"(?:help|assist) me (?:to |with )?(?P<own>.+)")


@dataclass(slots=True)
class _Draft:
    """Hold the steps so far, what they are for, and the last clause, which the next may shorten.

    `said` are all clauses, in full. One that `leans` may be short for the command before it.
    """

    request: Request
    leans: bool = False
    is_short: bool = False
    steps: list[tuple[Step, Intent]] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    clause: str = ""
    thing: str = ""
    began: int = 0


def draft_plan(request: Request) -> Plan:
    """Return the plan of a command as it was said; `ground_plan` makes it one that can run.

    Its goal has in full words what the command left to the one before it.

    Raises:
        NotUnderstood: no rule covers a clause.
        NotAble: the robot cannot do such a thing, or there is nothing to repeat.
        UnknownObject: a clause names an object the robot cannot recognise.
    """
    if len(request.text) > MOST_LETTERS:
        raise NotUnderstood(f"{request.text[:60]}...")
    said = courtesy_off(request.text)
    meant = by_another(thought_again(said), request)
    full = recalled(pointing_alone(meant, request), request)
    own = request.text if meant == said else meant
    draft = _drafted(replace(request, text=full or own))
    goal = ", then ".join(draft.said) if draft.is_short else draft.request.text.strip()
    return Plan(goal=goal, summary=_summary(draft.steps), actions=_chain(draft.steps))


def _drafted(request: Request) -> _Draft:
    said = courtesy_off(request.text)
    said = said if begins_with_statement(said) else straightened(said, request)
    helped = _HELP.fullmatch(said)
    said = in_order(
        said if helped is None else helped["own"],
        lambda clause: known_fit(polite_off(clause), request) is not None,
    )
    parts = statements_off(segments(said), request)
    if not parts or len(parts) > MOST_CLAUSES:
        raise NotUnderstood(request.text)
    draft = _Draft(request, leans=leans(plain(request.text).strip(" .!?")))
    while parts:
        parts = parts[_take_clause(parts, draft) :]
    return draft


def _take_clause(parts: Sequence[str], draft: _Draft) -> int:
    """Build the longest clause that the parts begin with; return how many parts it took."""
    for count in range(len(parts), 1, -1):
        clause = " and ".join(parts[:count])
        if len(HANDS.findall(clause)) > 1 or any(map(tells_of_another, parts[1:count])):
            continue
        fit = fit_of(clause, draft.request)
        if fit is not None and is_whole(fit, draft.request):
            _build(clause, fit, draft)
            return count
    clause = parts[0]
    if repaired(clause) is not None:
        return _take_back(parts, draft)
    refuse_unable(clause)
    two = _run_on(clause, draft.request)
    if two is not None:
        _take_clause(two[:1], draft)
        return _take_clause((two[1], *parts[1:]), draft)
    clause, fit = _in_full(clause, draft)
    if fit is None:
        clause, fit = _with_verb(clause, draft, others=len(parts) > 1)
    if fit is None:
        raise NotUnderstood(parts[0])
    _build(clause, fit, draft)
    return 1


def _run_on(clause: str, request: Request) -> tuple[str, str] | None:
    """Return the two clauses of "go to the kitchen get the can", said in one breath."""
    places = [found.start() for found in _NEXT_VERB.finditer(clause) if found.start()]
    if not places or known_fit(clause, request) is not None:
        return None
    for at in places:
        two = clause[:at].strip(), polite_off(clause[at:])
        if all(known_fit(one, request) is not None for one in two):
            return two
    return None


def _with_verb(clause: str, draft: _Draft, *, others: bool) -> tuple[str, Fit | None]:
    """Return "take the phone in your left hand" for what leaves the verb out, and its rule.

    "The can in the box" is one thing by itself, and "kitchen" one word; beside other clauses they
    are something to do.
    """
    clause = _IN_THE_SIDE.sub(r"\g<0> hand", clause) if names_hand(draft.clause) else clause
    if others and match_place(clause, draft.request.world.places):
        return f"go to {clause}", known_fit(f"go to {clause}", draft.request)
    if names_hand(clause):
        return f"take {clause}", known_fit(f"take {clause}", draft.request)
    if (others or draft.steps or _INTO.search(clause)) and _TO_WHERE.search(clause):
        return f"put {clause}", known_fit(f"put {clause}", draft.request)
    return clause, None


def _in_full(clause: str, draft: _Draft) -> tuple[str, Fit | None]:
    """Return a clause with what it leaves to the one before it, and the rule that it fits."""
    same = same_with(clause)
    fit = fit_of(clause, draft.request) if same is None else None
    if fit is not None:
        return clause, fit
    names_another = clause not in PRONOUNS and is_one(clause, draft.request)
    is_short = same is not None or (draft.leans and names_another)
    if is_short and not draft.clause:
        _go_on_from_last(draft)
    if is_again(clause) and draft.clause:
        return draft.clause, fit_of(draft.clause, draft.request)
    own = clause if same is None else same
    found = continued(own, draft.clause, draft.thing, draft.request)
    if found is not None or same is None:
        return found or (clause, None)
    whole = corrected(own, draft.clause, draft.request)
    return whole, known_fit(whole, draft.request)


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
    said = outright(said)
    if not said:
        raise NotUnderstood(parts[0])
    if not draft.clause:
        _correct_last(parts[0], draft)
    del draft.steps[draft.began :], draft.said[-1:]
    whole = corrected(said, draft.clause, draft.request)
    fit = fit_of(whole, draft.request)
    if fit is None:
        raise NotUnderstood(said)
    _build(whole, fit, draft)
    return taken


def _correct_last(part: str, draft: _Draft) -> None:
    """Let the last clause of the command before this one be what is corrected.

    Raises:
        NotUnderstood: there is none that can be.
    """
    try:
        _go_on_from_last(draft)
    except NothingBefore as error:
        raise NotUnderstood(part) from error


def _go_on_from_last(draft: _Draft) -> None:
    """Let the last clause of the command before this one be the last clause.

    Raises:
        NothingBefore: there is no command before, or none that may be done again.
        NotUnderstood: that one was understood by somebody else.
    """
    words = last_words(draft.request)
    alone = replace(draft.request, text=words, conversation=Conversation())
    try:
        last = _drafted(alone)
    except PlanningError as error:
        raise NotUnderstood(draft.request.text) from error
    draft.clause, draft.thing, draft.is_short = last.clause, last.thing, True


def _build(clause: str, fit: Fit, draft: _Draft) -> None:
    steps = fit.rule.build(fit.groups, draft.request)
    draft.began = len(draft.steps)
    draft.steps += [(step, fit.rule.intent) for step in steps]
    draft.said.append(clause)
    draft.clause = clause
    draft.thing = next((fit.groups[name] for name in _THINGS if name in fit.groups), "")


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
