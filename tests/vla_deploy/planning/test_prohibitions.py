"""What a person forbids stands until they take it back, whoever plans, also over a restart."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.planner_bounds import moves
from benchmarks.planner_session import PlannerSession
from drivers.clock import MonotonicClock
from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import Forbidden, Prohibition, StandingOrder
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions, held_to, read_order
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots import load_robot
from vla_deploy.world import Snapshot

WORLD = world_of(load_robot("butler"), {})
KEYS = Prohibition(what=Forbidden.THING, words="keys")
KITCHEN = Prohibition(what=Forbidden.PLACE, words="kitchen")


def refused(desk: PlannerSession, text: str) -> str:
    answer = desk.say(text)[1]
    assert answer.outcome == "refuse", answer
    return answer.text


@pytest.mark.parametrize(
    ("text", "order"),
    [
        ("don't touch the keys", StandingOrder(forbids=True, of=KEYS)),
        ("Never ever touch my keys again!", StandingOrder(forbids=True, of=KEYS)),
        ("please leave the keys alone", StandingOrder(forbids=True, of=KEYS)),
        ("hands off the keys", StandingOrder(forbids=True, of=KEYS)),
        ("stay out of the kitchen", StandingOrder(forbids=True, of=KITCHEN)),
        ("never go into the kitchen again", StandingOrder(forbids=True, of=KITCHEN)),
        ("don't go to the kitchen", None),
        ("you may touch the keys again", StandingOrder(forbids=False, of=KEYS)),
        ("you can go into the kitchen", StandingOrder(forbids=False, of=KITCHEN)),
        ("forget what I said about the kitchen", StandingOrder(forbids=False, of=KITCHEN)),
        ("you can go into the bedroom", None),
        ("touch the keys", None),
    ],
)
def test_orders_are_read_from_whole_sentences(text: str, order: StandingOrder | None) -> None:
    assert read_order(text, WORLD, (KEYS, KITCHEN)) == order


def test_a_thing_is_not_taken_until_that_is_permitted(flat: PlannerSession) -> None:
    (said,) = (flat.say("don't touch the keys")[1].plan or {})["actions"]
    assert said["parameters"] == {"text": "All right, I will not touch the keys."}
    why = refused(flat, "bring me the keys")
    assert 'say "you may touch the keys again" first' in why
    refused(flat, "put the keys in the box")
    assert moves(flat.say("pick up the red cup")[1].plan or {})
    asked = flat.say("you may touch the keys again")[1]
    assert (asked.outcome, asked.text) == ("ask", "May I touch the keys again?")
    refused(flat, "bring me the keys")
    flat.say("you may touch the keys again")
    flat.say("yes")
    assert flat.say("bring me the keys")[1].outcome == "plan"


@pytest.mark.parametrize(
    ("forbidden", "taken", "is_refused"),
    [
        ("the green cup", "a cup", True),
        ("the green cup", "the green cup", True),
        ("the green cup", "the white cup", False),
        ("the green cup", "a green bowl", False),
        ("the can", "the white can", True),
        ("the can", "the object", True),
    ],
)
def test_what_is_not_seen_is_not_taken_where_it_may_be_the_forbidden(
    scene: Snapshot, forbidden: str, taken: str, is_refused: bool
) -> None:
    order = read_order(f"don't touch {forbidden}", WORLD, ())
    assert order is not None
    step = Action(id="a", skill="pick_up", parameters={"object": taken})
    plan = Plan(goal="take it", actions=(step,))
    with pytest.raises(NotAble) if is_refused else nullcontext():
        held_to((order.of,), plan, WORLD, replace(scene, things=()))


@pytest.mark.parametrize(
    ("command", "order"),
    [
        ("bring me the keys", "don't touch the keys"),
        ("find the remote", "stay out of the kitchen"),
        ("go to the bedroom", "stay out of the kitchen"),
    ],
)
def test_what_is_under_way_ends_where_something_is_forbidden(
    flat: PlannerSession, command: str, order: str
) -> None:
    assert flat.say(command)[1].outcome == "plan"
    assert flat.say(order)[1].outcome == "stop"


def test_nobody_goes_where_it_is_forbidden_nor_takes_what_is_there(flat: PlannerSession) -> None:
    flat.say("stay out of the kitchen")
    refused(flat, "go to the kitchen")
    refused(flat, "go to the kitchen table")
    refused(flat, "patrol the kitchen")
    refused(flat, "bring me the green bottle")
    assert flat.say("go to the bedroom")[1].outcome == "plan"


@pytest.mark.parametrize(
    ("orders", "text", "outcome", "keeps_out"),
    [
        ((), "find the remote", "plan", []),
        (("stay out of the kitchen",), "find the remote", "plan", ["kitchen", "kitchen_table"]),
        (("stay out of the kitchen",), "bring me the remote", "plan",
         ["kitchen", "kitchen_table"]),
        (("stay out of the kitchen",), "find the remote in the kitchen", "refuse", None),
        (("stay out of the kitchen",), "find the red cup", "plan", ["kitchen", "kitchen_table"]),
    ],
)  # fmt: skip
def test_a_search_leaves_out_what_may_not_be_entered(
    flat: PlannerSession,
    orders: tuple[str, ...],
    text: str,
    outcome: str,
    keeps_out: list[str] | None,
) -> None:
    for order in orders:
        flat.say(order)
    answer = flat.say(text)[1]
    assert answer.outcome == outcome, answer
    assert (answer.plan and answer.plan["keeps_out"]) == keeps_out
    if outcome == "refuse":
        assert "you told me not to go into the kitchen" in answer.text


def test_a_plan_of_somebody_else_is_held_to_it_too(flat: PlannerSession) -> None:
    flat.say("don't touch the keys")
    plan = {"goal": "keys", "actions": [{"id": "a", "skill": "pick_up",
                                         "parameters": {"object": "keys_1"}}]}  # fmt: skip
    assert flat.hand_in(plan)[1].outcome == "refuse"


def test_another_profiles_planner_holds_to_it_too(flat: PlannerSession) -> None:
    flat.say("stay out of the kitchen")
    flat.node.commit(Planner(MonotonicClock()))
    refused(flat, "go to the kitchen")


def test_they_stand_after_a_restart_and_a_spoilt_file_is_no_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "state" / "prohibitions.json"
    Prohibitions(file).apply(StandingOrder(forbids=True, of=KEYS))
    again = Prohibitions(file)
    assert again.items == (KEYS,)
    again.apply(StandingOrder(forbids=False, of=KEYS))
    assert Prohibitions(file).items == ()
    for spoilt in ("{", "[1]", '[{"what": "mood", "words": "x"}]'):
        file.write_text(spoilt)
        assert Prohibitions(file).items == ()
    assert "cannot be read" in caplog.text
