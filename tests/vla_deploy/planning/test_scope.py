"""No word that changes what a command means is left out of a plan that runs unasked."""

import re
from typing import Final

import pytest

from benchmarks.planner_bounds import moves
from benchmarks.planner_session import PlannerAnswer, PlannerSession
from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanRequest, Proposal
from vla_deploy.planning.scope import guarded, scope_words
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots import load_robot

PLAIN: Final = ("go to the kitchen", "bring me the red cup", "put the ball in the box")
CHANGES: Final = (
    "don't {}", "do not {}", "never {}", "please do not {} yet", "no, don't {}",
    "{} unless I am asleep", "if it rains, {}", "{} if Tom comes", "{} when the bell rings",
    "{} later", "{} tomorrow", "until I am back {}", "{} before dinner", "{} after lunch",
    "{} or the bedroom", "either {} or wait", "{} instead", "rather {} than that",
    "everything except that: {}", "{} but not now", "without asking {}", "{} every evening",
    "{} once the film is over", "in ten minutes {}", "as soon as mum calls {}",
    "Anna, {}",
)  # fmt: skip


def runs(answer: PlannerAnswer) -> bool:
    return answer.outcome == "plan" and moves(answer.plan or {})


@pytest.mark.parametrize("plain", PLAIN)
def test_a_plain_command_runs_unasked(flat: PlannerSession, plain: str) -> None:
    assert runs(flat.say(plain)[1])


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("plain", PLAIN)
def test_with_a_word_that_changes_it_the_same_plan_does_not_run_unasked(
    flat: PlannerSession, plain: str, change: str
) -> None:
    answer = flat.say(change.format(plain))[1]
    assert not runs(answer), answer.plan


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("go to the kitchen", ()),
        ("Don’t go to the kitchen", ("don't",)),
        ("bring me both cups, not the ball", ("both", "not")),
        ("stay away from the keys", ("avoid",)),
        ("go there in five minutes", ("later",)),
        ("mum, where is my phone", ("mum",)),
        ("robot, where is my phone", ()),
        ("could you go there if you don't mind", ()),
        ("no rush, when you have a moment get the cup", ()),
    ],
)
def test_scope_words_are_found_and_idioms_are_none(text: str, words: tuple[str, ...]) -> None:
    assert scope_words(text) == words


def test_the_question_names_what_may_not_be_understood(flat: PlannerSession) -> None:
    answer = flat.say("go to the kitchen before dinner")[1]
    assert answer.outcome in ("ask", "refuse")
    assert re.search(r"before|later|time|sure|leave out|understand", answer.text), answer.text


def proposed(skill: str = "navigate_to", **changes: object) -> Proposal:
    plan = Plan(goal="g", summary="go to the kitchen", actions=(Action(id="a", skill=skill),))
    return Proposal(plan=plan, back_end="test", confidence=1.0, **changes)


def request_for(text: str) -> PlanRequest:
    return PlanRequest(command_id="c", text=text, world=world_of(load_robot("butler"), {}))


def test_a_language_model_is_asked_about_what_others_are_refused_for() -> None:
    request = request_for("don't go to the kitchen")
    with pytest.raises(CannotBeDone, match="don't"):
        guarded(proposed(), request)
    assert guarded(proposed(knows_grammar=True), request).left_out == ("don't",)


def test_what_a_plan_covers_or_what_moves_nothing_is_not_asked_about() -> None:
    request = request_for("go to the kitchen before dinner")
    assert guarded(proposed(covers=frozenset({"before"})), request).left_out == ()
    assert guarded(proposed(covers=None), request).left_out == ()
    assert guarded(proposed("speak"), request).left_out == ()
    assert guarded(proposed(), request).left_out == ("before",)
