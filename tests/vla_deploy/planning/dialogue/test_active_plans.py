"""A plan that fails is planned anew, seen from the topics: another plan, or why there is none."""

import re
from typing import Any

import pytest

from vla_deploy.planning.dialogue.active_plans import ActivePlans
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.errors import CannotBeDone, Declined
from vla_deploy.planning.interfaces import PlanningResult
from vla_deploy.plans.plan import Plan
from vla_deploy.robots.plan_bounds import NOT_BOUNDED


def fail(desk: Any, plan: dict[str, Any], **changes: Any) -> list[dict[str, Any]]:
    """Let the first action of a plan fail; return the events of the planner's next step."""
    action_id = plan["plan"]["actions"][0]["id"]
    told = {"action_id": action_id, "error": "the way is blocked", "cause": "skill", "done": []}
    desk.executor_tells(command_id=plan["command_id"], event="setback", **(told | changes))
    return [one for one in desk.answers() if one["event"] != "setback"]


def set_back(desk: Any, plan: dict[str, Any], **changes: Any) -> list[dict[str, Any]]:
    """Let the first action of a plan fail; return what the planner hands to the executor."""
    fail(desk, plan, **changes)
    return desk.plans()


@pytest.mark.parametrize(
    ("command", "word"),
    [
        ({"text": "go to the kitchen"}, ""),
        ({"text": "go to the kitchen", "heard": {"confidence": 0.4}}, "yes"),
        ({"text": "go to the kitchen when I say so"}, "go"),
    ],
    ids=["at once", "agreed to", "at a word"],
)
def test_a_plan_that_failed_is_followed_by_another_without_another_word(desk, command, word):
    plans = desk.plans_for(**command)
    (first,) = desk.plans_for(word) if word else plans
    (told,) = fail(desk, first)
    assert (told["event"], told["rung"], told["origin"]) == ("plan", "recovery", "wait")
    (second,) = desk.plans()
    assert second["command_id"] == "c1"
    assert [one["skill"] for one in second["plan"]["actions"]] == ["wait", "navigate_to"]
    assert all(one["id"].startswith("r1_") for one in second["plan"]["actions"])


def test_what_was_corrected_and_agreed_to_is_mended_without_another_yes(desk):
    desk.give(text="go to the kitchen")
    assert desk.answers_to("no, the bedroom")[-1]["question"] == "Shall I go to the bedroom?"
    (second,) = set_back(desk, desk.plans_for("yes")[-1])
    assert [one["skill"] for one in second["plan"]["actions"]] == ["wait", "navigate_to"]


def test_after_the_last_strategy_the_command_is_given_up_with_the_first_cause(desk):
    (second,) = set_back(desk, desk.plans_for("go to the kitchen")[0])
    last = second["plan"]["actions"][-1]["id"]
    (end,) = set_back(desk, second, action_id=last)
    assert "the way is blocked" in end["give_up"]


def test_who_takes_time_is_asked_with_the_history_and_no_more_often_than_three_times(
    open_desk, back_end, propose
):
    go = propose(("navigate_to", {"place": "bedroom"}))
    model = back_end("model", Declined("nothing"), go)
    desk = open_desk(model)
    assert desk.answers_to("sing one")[-1]["event"] == "rejected"
    (plan,) = desk.plans_for("sing two")
    for _ in range(NOT_BOUNDED.further_plans):
        (plan,) = set_back(desk, plan, action_id=plan["plan"]["actions"][-1]["id"])
        assert "plan" in plan
    (end,) = set_back(desk, plan)
    assert f"allows {NOT_BOUNDED.further_plans} other plans" in end["give_up"]
    assert any("the way is blocked" in one for one in model.asked[-1].failed)


@pytest.mark.parametrize("further_plans", [0, 1])
def test_no_more_plans_than_the_robot_file_allows(further_plans: int) -> None:
    active = ActivePlans(further_plans)
    go = {"id": "a1", "skill": "navigate_to", "parameters": {"place": "kitchen"}}
    plan = Plan.model_validate({"goal": "go", "actions": [go]})
    command = UserCommand(command_id="c1", text="go to the kitchen", told_ns=0)
    told = {"action_id": "a1", "error": "blocked", "cause": "skill", "done": []}
    active.add(command, plan, PlanningResult(), 0)
    for _ in range(further_plans):
        active.add(active.set_back("c1", told), plan, PlanningResult(), 0)
    words = f"[planning] further_plans of the robot file allows {further_plans} other plans"
    with pytest.raises(CannotBeDone, match=re.escape(words)):
        active.set_back("c1", told)


def test_what_is_risky_in_another_way_than_what_was_agreed_to_is_not_done(
    open_desk, back_end, propose
):
    back = propose(("move", {"distance_m": -2.0}))
    desk = open_desk(back_end("model", back))
    asked = desk.answers_to("go to the kitchen", heard={"confidence": 0.4})[-1]
    assert asked["event"] == "asked"
    (plan,) = set_back(desk, desk.plans_for("yes")[0])
    (end,) = set_back(desk, plan, action_id=plan["plan"]["actions"][-1]["id"])
    assert "I would drive 2 m backward" in end["give_up"]


def test_who_takes_time_is_told_what_was_done_before_the_failure(open_desk, back_end, propose):
    go = propose(("speak", {"text": "I go"}), ("move", {"distance_m": 1.0}))
    model = back_end("model", go, Declined("nothing"))
    desk = open_desk(model)
    (plan,) = desk.plans_for("sing one")
    done, failed = (one["id"] for one in plan["plan"]["actions"])
    set_back(desk, plan, action_id=failed, done=[done], left={failed: {}})
    (told,) = model.asked[-1].failed
    assert "done before: speak(text I go)" in told


def test_a_plan_that_came_as_one_is_not_changed(desk):
    plan = {"goal": "go", "actions": [
        {"id": "a1", "skill": "navigate_to", "parameters": {"place": "kitchen"}}
    ]}  # fmt: skip
    (end,) = set_back(desk, desk.plans_for(plan=plan)[0])
    assert "given" in end["give_up"]


def test_a_planner_that_was_started_again_has_no_other_plan(desk):
    (first,) = desk.plans_for("go to the kitchen")
    desk.executor_tells(command_id="c1", event="setback", action_id="a1", error="x", done=[])
    desk.start()
    assert [one.get("give_up") for one in desk.plans()] == [
        "the planner was started again meanwhile"
    ]
    assert first["command_id"] == "c1"


@pytest.mark.parametrize("said", ["stop", "no, the bedroom", "stay out of the kitchen"])
def test_a_setback_that_a_cancel_has_overtaken_starts_nothing(desk, said):
    (plan,) = desk.plans_for("go to the kitchen")
    assert "cancel" in desk.plans_for(said)[0]
    assert [one for one in set_back(desk, plan) if "plan" in one] == []


def test_a_stop_ends_the_search_for_another_plan(open_desk, later, back_end, propose):
    desk = open_desk(
        back_end("model", propose(("navigate_to", {"place": "bedroom"}))), executor=later
    )
    (second,) = set_back(desk, desk.plans_for("go to the kitchen")[0])
    assert set_back(desk, second, action_id=second["plan"]["actions"][-1]["id"]) == []
    desk.answers_to("stop")
    later.do_one()
    desk.answers()
    told = desk.plans()
    assert [one for one in told if "plan" in one] == []
    assert {"command_id": "c2", "cancel": True} in told
