from dataclasses import replace

import pytest

from vla_deploy.planning.dialogue.confirmation import agreement_to, confirmation_of
from vla_deploy.planning.interfaces import PlanRequest, Proposal
from vla_deploy.plans.knowledge import World, world_of
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots import load_robot
from vla_deploy.robots.plan_bounds import Confirm
from vla_deploy.world import Snapshot, Thing

GO = Action(id="a", skill="navigate_to", parameters={"place": "kitchen"})
SPEAK = Action(id="s", skill="speak", parameters={"text": "hello"})
PICK = Action(id="p", skill="pick_up", parameters={"object": "bottle"})


@pytest.fixture(scope="module")
def butler() -> World:
    return world_of(load_robot("butler"), {"left": None, "right": None})


def asking(world: World, when: Confirm) -> World:
    return replace(world, bounds=replace(world.bounds, require_confirmation=when))


def ask(world: World, *actions: Action, **changes: object) -> str:
    heard = changes.pop("heard_confidence", None)
    scene = changes.pop("scene", None)
    plan = Plan(goal="x", actions=actions).model_copy(update=changes)
    request = PlanRequest(
        command_id="c", text="x", world=world, scene=scene, heard_confidence=heard
    )  # fmt: skip
    return confirmation_of(plan, request)


def test_an_ordinary_plan_runs_at_once(butler: World) -> None:
    assert ask(butler, GO, PICK) == ""


def test_the_robot_file_says_how_far_it_goes(butler: World) -> None:
    back = Action(id="b", skill="move", parameters={"distance_m": -2.0})
    always, never = asking(butler, Confirm.ALWAYS), asking(butler, Confirm.NEVER)
    assert ask(always, GO) == "Shall I go to the kitchen?"
    assert ask(always, SPEAK) == "", "it moves nothing"
    assert ask(butler, back).endswith("I would drive 2 m backward.")
    assert ask(never, back) == ""
    assert ask(never, PICK.model_copy(update={"feasibility_score": 0.6})), "doubt is always asked"


def test_each_risk_of_a_plan_is_told(butler: World) -> None:
    unsure = PICK.model_copy(update={"feasibility_score": 0.6})
    assert ask(butler, unsure).endswith("I am not sure that I understood you.")
    assert "There may be a danger: it is hot." in ask(butler, GO, safety_concerns=("it is hot",))
    assert "not sure that I heard" in ask(butler, GO, heard_confidence=0.4)
    assert ask(butler, GO, heard_confidence=0.9) == ""
    assert "I would move 4 things: the bottle, the bottle" in ask(butler, *[PICK] * 4)
    assert ask(butler, *[GO] * 70) == ""


def test_what_was_left_out_is_named_without_a_word_that_would_end_all(butler: World) -> None:
    plan = Plan(goal="x", actions=(GO,))
    proposal = Proposal(plan=plan, back_end="t", confidence=1.0, left_out=("not", "freeze", "not"))
    request = PlanRequest(command_id="c", text="x", world=butler)
    assert confirmation_of(plan, request, proposal) == (
        'You said "not" and "standstill", which I may not have understood. '
        "Shall I go to the kitchen?"
    )


def test_a_heavy_thing_is_asked_for(butler: World) -> None:
    full = Thing(thing_id="bottle_1", kind="bottle", colour="green",
                 position_m=(2.0, 1.5, 0.5), size_m=(0.06, 0.06, 0.20))  # fmt: skip
    said = ask(butler, PICK, scene=Snapshot(stamp_ns=0, things=(full,)))
    assert said.endswith("The green bottle may weigh 0.5 kg.")


def test_what_was_agreed_to_is_not_asked_about_again(butler: World) -> None:
    request = PlanRequest(command_id="c", text="x", world=butler, heard_confidence=0.4)
    plan = Plan(goal="x", actions=(PICK,) * 4)
    agreed = agreement_to(plan, request)
    assert agreed == {"many", "unheard"}
    assert confirmation_of(plan, request, agreed=agreed) == ""
    back = Action(id="b", skill="move", parameters={"distance_m": -2.0})
    farther = plan.model_copy(update={"actions": (*plan.actions, back)})
    assert confirmation_of(farther, request, agreed=agreed).endswith("I would drive 2 m backward.")


def test_a_yes_to_one_danger_is_none_to_another(butler: World) -> None:
    request = PlanRequest(command_id="c", text="x", world=butler)
    hot, sharp = (Plan(goal="x", actions=(GO,), safety_concerns=(why,)) for why in ("hot", "sharp"))
    assert confirmation_of(hot, request, agreed=agreement_to(hot, request)) == ""
    assert "sharp" in confirmation_of(sharp, request, agreed=agreement_to(hot, request))


def test_where_every_motion_waits_for_a_yes_an_answer_is_none(butler: World) -> None:
    request = PlanRequest(command_id="c", text="x", world=asking(butler, Confirm.ALWAYS))
    said, moved = (Plan(goal="x", actions=(one,)) for one in (SPEAK, GO))
    assert confirmation_of(moved, request, agreed=agreement_to(moved, request)) == ""
    assert confirmation_of(moved, request, agreed=agreement_to(said, request))


@pytest.mark.parametrize(
    ("count", "said"),
    [
        (3, ""),
        (4, "I would move 4 things: the red cup, the red cup, the red cup and the red cup."),
        (8, "the red cup, the red cup and 2 more."),
    ],
)
def test_of_many_things_the_first_are_named(butler: World, count: int, said: str) -> None:
    things = tuple(
        Thing(thing_id=f"cup_{number}", kind="cup", colour="red",
              position_m=(2.0, 1.5, 0.5), size_m=(0.06, 0.06, 0.08))
        for number in range(count)
    )  # fmt: skip
    takes = [
        Action(id=one.thing_id, skill="pick_up", parameters={"object": one.thing_id})
        for one in things
    ]
    assert ask(butler, *takes, scene=Snapshot(stamp_ns=0, things=things)).endswith(said)
