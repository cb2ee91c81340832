"""Each back end falls to the next; what each said is noted, and the most helpful reason is told."""

from threading import Event

from vla_deploy.planning.errors import Ambiguous, Declined
from vla_deploy.planning.planner import Planner
from vla_deploy.plans.errors import UnknownPlace
from vla_deploy.runtime.deadline import Deadline

GO = ("navigate_to", {"place": "kitchen"})
NOWHERE = ("navigate_to", {"place": "narnia"})


def first_plan(clock, request, *rungs, within_s=10.0, recall=None):
    deadline = Deadline.within(clock, within_s, recall)
    return Planner(clock).first_plan(rungs, request, deadline)


def test_the_first_plan_that_may_run_wins_and_the_others_are_not_asked(
    clock, ask, propose, back_end
):
    later = back_end("later", propose(GO))
    answer = first_plan(
        clock, ask("go"), back_end("no", Declined("not mine")), back_end("yes", propose(GO)), later
    )
    assert answer.plan.actions[0].parameters == {"place": "kitchen"}
    assert [(one.back_end, one.outcome) for one in answer.attempts] == [
        ("no", "declined"),
        ("yes", "planned"),
    ]
    assert answer.error is None
    assert later.asked == []


def test_a_plan_that_the_validator_refuses_falls_to_the_next(clock, ask, propose, back_end):
    answer = first_plan(
        clock, ask("go"), back_end("bad", propose(NOWHERE)), back_end("good", propose(GO))
    )
    assert answer.attempts[0].outcome == "refused"
    assert 'I do not know the place "narnia"' in answer.attempts[0].reason
    assert answer.proposal.plan.actions[0].parameters == {"place": "kitchen"}


def test_a_question_ends_the_first_plan(clock, ask, propose, back_end):
    later = back_end("later", propose(GO))
    answer = first_plan(clock, ask("go"), back_end("asks", Ambiguous("Which cup?")), later)
    assert answer.is_final
    assert str(answer.error) == "Which cup?"
    assert later.asked == []


def test_the_reason_that_tells_most_is_told(clock, ask, back_end):
    answer = first_plan(
        clock,
        ask("go to narnia"),
        back_end("a", Declined("it is away")),
        back_end("b", UnknownPlace("narnia", ["kitchen"])),
        back_end("c", Declined("it is away too")),
    )
    assert not answer.is_final
    assert str(answer.error) == 'I do not know the place "narnia"; I know: kitchen'


def test_a_back_end_may_take_its_share_of_the_time_and_the_rest_is_for_the_next(
    clock, ask, back_end
):
    slow = back_end("slow", Declined("gave up"), takes_s=5.0)
    quick = back_end("quick", Declined("no"))
    answer = first_plan(clock, ask("go"), slow, quick, within_s=10.0)
    assert [one.outcome for one in answer.attempts] == ["late", "declined"]
    assert answer.attempts[0].took_s == 5.0


def test_a_plan_that_comes_after_the_time_for_all_is_refused(clock, ask, propose, back_end):
    late = back_end("late", propose(GO), takes_s=10.0)
    never = back_end("never", propose(GO))
    answer = first_plan(clock, ask("go"), late, never, within_s=10.0)
    assert answer.plan is None
    assert [one.outcome for one in answer.attempts] == ["late", "late"]
    assert never.asked == []


def test_nobody_is_asked_for_a_command_that_was_recalled(clock, ask, propose, back_end):
    recall = Event()
    recall.set()
    asked = back_end("model", propose(GO))
    assert first_plan(clock, ask("go"), asked, recall=recall).plan is None
    assert asked.asked == []
