"""Each rung falls to the next; what each said is noted, and the most helpful reason is told."""

from threading import Event

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.errors import Ambiguous, Declined, UnknownPlace
from vla_deploy.planning.planner import Planner

GO = ("navigate_to", {"place": "kitchen"})
NOWHERE = ("navigate_to", {"place": "narnia"})


def climb(clock, request, *rungs, within_s=10.0, recall=None):
    deadline = Deadline.within(clock, within_s, recall)
    return Planner(clock).first_plan(rungs, request, deadline)


def test_the_first_plan_that_may_run_wins_and_the_others_are_not_asked(clock, ask, propose, rung):
    later = rung("later", propose(GO))
    answer = climb(
        clock, ask("go"), rung("no", Declined("not mine")), rung("yes", propose(GO)), later
    )
    assert answer.plan.actions[0].parameters == {"place": "kitchen"}
    assert [(one.rung, one.outcome) for one in answer.attempts] == [
        ("no", "declined"),
        ("yes", "planned"),
    ]
    assert answer.error is None
    assert later.asked == []


def test_a_plan_that_the_validator_refuses_falls_to_the_next_rung(clock, ask, propose, rung):
    answer = climb(clock, ask("go"), rung("bad", propose(NOWHERE)), rung("good", propose(GO)))
    assert answer.attempts[0].outcome == "refused"
    assert 'I do not know the place "narnia"' in answer.attempts[0].reason
    assert answer.proposal.plan.actions[0].parameters == {"place": "kitchen"}


def test_a_question_ends_the_climb(clock, ask, propose, rung):
    later = rung("later", propose(GO))
    answer = climb(clock, ask("go"), rung("asks", Ambiguous("Which cup?")), later)
    assert answer.is_final
    assert str(answer.error) == "Which cup?"
    assert later.asked == []


def test_the_reason_that_tells_most_is_told(clock, ask, rung):
    answer = climb(
        clock,
        ask("go to narnia"),
        rung("a", Declined("it is away")),
        rung("b", UnknownPlace("narnia", ["kitchen"])),
        rung("c", Declined("it is away too")),
    )
    assert not answer.is_final
    assert str(answer.error) == 'I do not know the place "narnia"; I know: kitchen'


def test_a_rung_may_take_its_share_of_the_time_and_the_rest_is_for_the_next(clock, ask, rung):
    slow = rung("slow", Declined("gave up"), takes_s=5.0)
    quick = rung("quick", Declined("no"))
    answer = climb(clock, ask("go"), slow, quick, within_s=10.0)
    assert [one.outcome for one in answer.attempts] == ["late", "declined"]
    assert answer.attempts[0].took_s == 5.0


def test_a_plan_that_comes_after_the_time_for_all_is_refused(clock, ask, propose, rung):
    late = rung("late", propose(GO), takes_s=10.0)
    never = rung("never", propose(GO))
    answer = climb(clock, ask("go"), late, never, within_s=10.0)
    assert answer.plan is None
    assert [one.outcome for one in answer.attempts] == ["late", "late"]
    assert never.asked == []


def test_nobody_is_asked_for_a_command_that_was_recalled(clock, ask, propose, rung):
    recall = Event()
    recall.set()
    asked = rung("model", propose(GO))
    assert climb(clock, ask("go"), asked, recall=recall).plan is None
    assert asked.asked == []
