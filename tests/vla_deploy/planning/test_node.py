"""Talk to the planner through its topics, on a time that only the test moves."""

import dataclasses

import pytest

from platforms import load_profile
from vla_deploy.planning.node import AWAY, UTTERANCE_AGE_S
from vla_deploy.robots.known_things import OwnWord


def test_a_command_becomes_a_plan_for_the_executor(desk):
    accepted, planned = desk.answers_to("go to the kitchen")
    assert (accepted["event"], planned["event"]) == ("accepted", "plan")
    (plan,) = desk.plans()
    assert plan == {"command_id": "c1", "plan": planned["plan"]}
    assert [action["skill"] for action in plan["plan"]["actions"]] == ["navigate_to"]
    assert (planned["rung"], planned["confidence"]) == ("patterns", 1.0)
    (attempt,) = planned["attempts"]
    assert (attempt["rung"], attempt["outcome"]) == ("patterns", "planned")


def test_a_command_to_a_disarmed_robot_is_refused_with_what_to_do(desk):
    desk.control("disarmed")
    (answer,) = desk.answers_to("go to the kitchen")
    assert answer["event"] == "rejected"
    assert "vla-deploy arm" in answer["reason"]
    assert desk.plans() == []


def test_a_command_that_waited_too_long_for_the_planner_is_refused(desk):
    desk.give(text="go to the kitchen")
    desk.clock.pass_s(UTTERANCE_AGE_S + 0.1)
    desk.control("armed")
    (answer,) = desk.answers()
    assert answer["event"] == "rejected"
    assert answer["reason"] == "the command is 5 s old, the planner was away; give it again"
    assert desk.plans() == []


@pytest.mark.parametrize("is_restarted", [False, True])
@pytest.mark.parametrize("utterance", [{"cancel": True}, {"text": "stop"}])
def test_a_stop_is_handed_on_however_old_it_is(desk, utterance, is_restarted):
    desk.give(**utterance)
    desk.clock.pass_s(60.0)
    if is_restarted:
        desk.start()
    assert desk.answers() == []
    assert desk.plans() == [{"command_id": "c1", "cancel": True}]


def test_why_nobody_planned_it_is_told(desk):
    (refused,) = desk.answers_to("sing a sea shanty")
    assert refused["event"] == "rejected"
    assert refused["reason"].startswith('I do not understand "sing a sea shanty"')
    assert [one["rung"] for one in refused["attempts"]] == ["patterns"]


def test_a_word_of_the_homes_own_is_read_as_what_it_means(desk):
    word = OwnWord(said="thermos", means="green bottle")
    desk.robot = dataclasses.replace(desk.robot, words=(word,))
    desk.start()
    desk.sees("green bottle_1", "red bottle_2")
    (plan,) = desk.plans_for("Pick up the Thermos.")
    picked = plan["plan"]["actions"][-1]
    assert (picked["skill"], picked["parameters"]["object"]) == ("pick_up", "green bottle")


def test_a_plan_made_elsewhere_is_checked_and_handed_on(desk):
    desk.give(plan=[{"action": "go_to", "params": {"location": "kitchen"}}])
    accepted, planned, refused = desk.answers_to(
        plan=[{"action": "go_to", "params": {"location": "narnia"}}]
    )
    assert (accepted["event"], planned["rung"]) == ("accepted", "given")
    assert (refused["command_id"], refused["event"]) == ("c2", "rejected")
    assert 'I do not know the place "narnia"' in refused["reason"]


@pytest.mark.parametrize("utterance", [{}, {"text": 7}, {"text": None}, {"text": "go " * 1000}])
def test_an_utterance_that_is_no_command_is_refused_with_what_was_expected(desk, utterance):
    (answer,) = desk.answers_to(**utterance)
    assert answer["event"] == "rejected"
    assert answer["reason"].startswith("expected a command")


GO_ALL_OVER = [{"skill": "navigate_to", "parameters": {"place": "kitchen"}}]


@pytest.mark.parametrize(
    "plan",
    [
        {"actions": [{"skill": "speak", "parameters": {"text": "x" * 500}}] * 60},
        {"actions": [{"skill": "speak", "parameters": {"text": "\U0001f600" * 499}}] * 20},
        {"actions": GO_ALL_OVER, "safety_concerns": ["\U0001f600" * 10_000]},
        {"actions": GO_ALL_OVER, "goal": "g" * 60_000},
    ],
)
def test_a_plan_too_long_to_be_told_is_refused(desk, plan):
    assert [(one["event"]) for one in desk.answers_to(plan={"goal": "talk"} | plan)] == ["rejected"]
    assert desk.plans() == []


def test_a_long_plan_is_told_whole(desk):
    said = [{"skill": "speak", "parameters": {"text": "y" * 400}}] * 20
    (plan,) = desk.plans_for(plan={"goal": "talk", "actions": said})
    assert len(plan["plan"]["actions"]) == 20


@pytest.mark.parametrize("text", ["\\ud800", "\\u0000\\u001b[2J", "\U0001f600" * 2_000])
def test_no_text_of_a_plan_can_end_the_planner(desk, text):
    go = '{"skill": "navigate_to", "parameters": {"place": "kitchen"}}'
    assert desk.answers_to(
        plan=f'{{"goal": "{text}", "safety_concerns": ["{text}"], "actions": [{go}]}}'
    )[-1]["event"] in ("asked", "rejected")
    assert desk.answers_to("go to the kitchen")[-1]["event"] == "plan"


def test_an_id_without_end_is_cut(desk):
    (refused,) = desk.answers_to(command_id="x" * 60_000, text="sing a sea shanty")
    assert refused["command_id"] == "x" * 128


def test_a_plan_with_very_many_faults_is_refused_in_a_bounded_answer(desk):
    (refused,) = desk.answers_to(
        plan={"actions": [{"skill": f"fly_{number}"} for number in range(100)]}
    )
    assert refused["reason"].endswith("... (and more)")
    assert len(refused["reason"]) < 3000


def test_a_restarted_planner_takes_up_what_nobody_has_answered(desk):
    desk.give(text="go to the kitchen")
    desk.clock.pass_s(1.0)
    desk.start()
    assert [one["event"] for one in desk.answers()] == ["accepted", "plan"]
    desk.start()
    assert desk.answers() == [], "it was answered"


def test_a_restarted_planner_tells_which_commands_went_with_the_old_one(
    open_desk, later, back_end, propose
):
    desk = open_desk(back_end("model", propose(("wait", {"duration_s": 1.0}))), executor=later)
    assert [one["event"] for one in desk.answers_to("sing a sea shanty")] == ["planning"]
    desk.start()
    (lost,) = desk.told()
    assert (lost["event"], lost["reason"]) == ("rejected", AWAY)
    assert desk.answers() == []


def test_the_status_tells_of_commands_and_rungs(desk):
    desk.give(text="go to the kitchen")
    desk.answers_to("sing a sea shanty")
    status = desk.status()
    assert (status["heard"], status["planned"], status["refused"]) == (2, 1, 1)
    assert status["by_rung"]["patterns"]["planned"] == 1
    assert status["by_rung"]["patterns"]["declined"] == 1
    assert status["rungs"] == ["patterns"]


def test_a_planner_that_is_replaced_is_closed_when_its_work_is_done(
    open_desk, later, back_end, propose
):
    closed = []
    model = back_end("model", propose(("wait", {"duration_s": 1.0})))
    model.close = lambda: closed.append("model")
    desk = open_desk(model, executor=later)
    desk.answers_to("sing a sea shanty")
    node = desk.planner
    before = node.commit(node.prepare(load_profile("desktop"), 0))
    node.discard(before)
    assert closed == []
    later.do_one()
    assert [one["event"] for one in desk.answers()] == ["accepted", "plan"]
    later.do_one()
    assert closed == ["model"]
