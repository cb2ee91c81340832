"""Plans go on after a failure: each strategy where it helps, judged by the world as it is now."""

from typing import Any

from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.planner import checked
from vla_deploy.planning.recovery.setback import Carried, Setback, numbered, read_setback
from vla_deploy.planning.recovery.strategies import recover
from vla_deploy.plans.plan import Action, FailureCause, Plan

TAKE = ("pick_up", {"object": "cup_1"})
MOVE = ("move", {"distance_m": 2.0, "speed_m_s": 0.2})
BLOCKED = {"action_id": "a0", "error": "blocked", "done": []}
PUT = ("place", {"destination": "coffee_table", "relation": "on"})


def plan_of(*steps: tuple[str, dict[str, Any]]) -> Plan:
    actions = []
    for number, (skill, parameters) in enumerate(steps):
        needed = (f"a{number - 1}",) if number else ()
        actions.append(
            Action(id=f"a{number}", skill=skill, parameters=parameters, depends_on=needed)
        )
    return Plan(goal="a test", actions=tuple(actions))


def failed(plan: Plan, number: int, error: str = "it slipped", **changes: Any) -> Carried:
    done = plan.actions[:number]
    setback = Setback(action=plan.actions[number], error=error, done=done, **changes)
    return Carried(plan=plan).after(setback)


def skills(plan: Plan | None) -> list[str]:
    assert plan is not None
    return [one.skill for one in plan.actions]


def test_a_grasp_that_failed_is_tried_again_after_a_fresh_look(ask: Any):
    answer = recover(failed(plan_of(TAKE, PUT), 0), ask("put the red cup away"), checked)
    assert answer.proposal is not None
    assert answer.proposal.origin == "look again"
    assert skills(answer.plan) == ["find_object", "navigate_to", "pick_up", "navigate_to", "place"]


def test_what_was_lost_on_the_way_is_taken_again_before_it_is_put_down(ask: Any):
    answer = recover(failed(plan_of(TAKE, PUT), 1), ask("put the red cup away"), checked)
    assert answer.proposal is not None
    assert answer.proposal.origin == "take again"
    assert skills(answer.plan)[-3:] == ["pick_up", "navigate_to", "place"]


def test_what_is_still_held_is_only_put_down(ask: Any):
    carried = failed(plan_of(TAKE, ("place", {"destination": "cup_2", "relation": "on"})), 1)
    request = ask("put the red cup on the blue one", holding={"left": "cup", "right": None})
    answer = recover(carried, request, checked)
    assert answer.proposal is not None
    assert answer.proposal.origin == "look again"
    assert "pick_up" not in skills(answer.plan)


def test_a_blocked_way_is_given_time(ask: Any):
    plan = plan_of(("navigate_to", {"place": "kitchen"}))
    answer = recover(failed(plan, 0, "the way is blocked"), ask("go to the kitchen"), checked)
    assert skills(answer.plan) == ["wait", "navigate_to"]


def test_a_strategy_that_has_failed_for_an_action_is_not_used_for_it_again(ask: Any):
    plan = plan_of(("navigate_to", {"place": "kitchen"}))
    first = failed(plan, 0, "the way is blocked")
    again = first.going_on(plan, "wait").after(first.setbacks[0])
    answer = recover(again, ask("go to the kitchen"), checked)
    assert answer.plan is None
    assert isinstance(answer.error, CannotBeDone)
    assert "the way is blocked" in str(answer.error)


def test_the_other_hand_takes_what_one_hand_could_not(ask: Any):
    plan = plan_of(("pick_up", {"object": "cup_1", "arm": "left"}))
    first = failed(plan, 0, "out of reach")
    again = first.going_on(plan, "look again").after(first.setbacks[0])
    answer = recover(again, ask("take the red cup"), checked)
    assert answer.plan is not None
    assert answer.plan.actions[-1].parameters["arm"] == "right"


def test_a_need_that_the_world_denies_is_put_in(ask: Any):
    carried = failed(
        plan_of(TAKE), 0, "robot before it: 2.1 m away", cause=FailureCause.PRECONDITION
    )
    answer = recover(carried, ask("take the red cup"), checked)
    assert answer.proposal is not None
    assert answer.proposal.origin == "put in"
    assert skills(answer.plan) == ["find_object", "navigate_to", "pick_up"]


def test_actions_of_a_recovery_are_never_taken_for_those_before(ask: Any):
    plan = plan_of(TAKE, PUT)
    told = numbered(plan, 2)
    assert [one.id for one in told.actions] == ["r2_0", "r2_1"]
    assert told.actions[1].depends_on == ("r2_0",)
    assert [one.id for one in numbered(told, 3).actions] == ["r3_0", "r3_1"]


def test_history_says_what_was_tried_and_what_came_of_it(ask: Any):
    carried = failed(plan_of(TAKE), 0)
    carried = carried.going_on(carried.plan, "look again").after(carried.setbacks[0])
    assert carried.history == (
        "pick_up(object cup_1) failed: it slipped; then tried: look again",
        "pick_up(object cup_1) failed: it slipped",
    )


def test_history_says_what_was_done_and_what_is_left(ask: Any):
    plan = plan_of(TAKE, MOVE)
    told = {
        "action_id": "a1",
        "error": "blocked",
        "done": ["a0"],
        "left": {"a1": {"distance_m": 0.6}},
    }
    setback = read_setback(told, plan)
    assert setback is not None
    assert Carried(plan=plan).after(setback).history == (
        "move(distance_m 2.0, speed_m_s 0.2) failed: blocked; "
        "left of it: move(distance_m 0.6, speed_m_s 0.2); done before: pick_up(object cup_1)",
    )


def test_of_a_drive_that_had_begun_only_the_rest_is_driven(ask: Any):
    setback = read_setback(BLOCKED | {"left": {"a0": {"distance_m": 0.6}}}, plan_of(MOVE))
    assert setback is not None
    first = Carried(plan=plan_of(MOVE)).after(setback)
    answer = recover(first, ask("go ahead two metres"), checked)
    assert answer.plan is not None
    assert skills(answer.plan) == ["wait", "move"]
    assert answer.plan.actions[1].parameters == {"distance_m": 0.6, "speed_m_s": 0.2}

    again = read_setback(
        BLOCKED | {"action_id": answer.plan.actions[1].id, "left": {}}, answer.plan
    )
    assert again is not None
    second = first.going_on(answer.plan, "wait").after(again)
    assert recover(second, ask("go ahead two metres"), checked).plan is None, "it was tried"


def test_a_drive_that_never_began_is_driven_whole(ask: Any):
    plan = plan_of(("navigate_to", {"place": "kitchen"}), MOVE)
    answer = recover(failed(plan, 0, "the way is blocked"), ask("go"), checked)
    assert answer.plan is not None
    assert answer.plan.actions[-1].parameters["distance_m"] == 2.0


def test_a_drive_of_which_nobody_knows_the_rest_is_not_driven_again(ask: Any):
    setback = read_setback(BLOCKED | {"left": {"a0": {}}}, plan_of(MOVE))
    assert setback is not None
    carried = Carried(plan=plan_of(MOVE)).after(setback)
    answer = recover(carried, ask("go ahead two metres"), checked)
    assert answer.plan is None
    assert str(answer.error) == "blocked (nobody knows how much of the way was done)"
    assert carried.history[0].endswith("nobody knows how much was left of it")


def test_a_setback_of_another_plan_is_not_read():
    assert read_setback({"action_id": "r1_a0", "error": "x"}, plan_of(TAKE)) is None


def test_every_plan_is_judged_before_it_may_run(ask: Any):
    asked: list[Plan] = []

    def refuse(plan: Plan, request: PlanRequest) -> Plan:
        asked.append(plan)
        raise CannotBeDone("not in this world")

    answer = recover(failed(plan_of(TAKE), 0), ask("take a red cup"), refuse)
    assert answer.plan is None
    assert asked, "nothing was judged"
    assert "not in this world" in str(answer.error)
