from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.planning.dialogue.phrasing import spoken_refusal
from vla_deploy.planning.errors import PlanInvalid
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.validator import check_plan
from vla_deploy.world import Snapshot
from vla_deploy.world.thing import Rest

WORLD = World(
    places={"kitchen": "kitchen", "galley": "kitchen"}, poses=frozenset({"tuck"}), holding={}
)


def action(
    skill: str, name: str = "a1", depends_on: tuple[str, ...] = (), **given: object
) -> Action:
    return Action(id=name, skill=skill, parameters=given, depends_on=depends_on)


def faults_of(plan: Plan) -> list[str]:
    try:
        check_plan(plan, WORLD)
    except PlanInvalid as error:
        return list(error.faults)
    return []


def faults(*actions: Action) -> list[str]:
    return faults_of(Plan(goal="test", actions=actions))


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (action("fly"), 'unknown skill "fly"'),
        (action("turn_on"), "turn_on: this robot declares no device"),
        (action("pick_up"), 'needs "object"'),
        (action("pick_up", object="red cup", speed=3), 'no parameter "speed"'),
        (action("pick_up", object="dinosaur"), 'do not know the object "dinosaur"'),
        (action("pick_up", object="box"), "too large"),
        (action("pick_up", object="cup", arm="third"), "one of left, right"),
        (action("navigate_to", place="moon"), 'unknown place "moon"'),
        (action("navigate_to"), "exactly one of place or object or x_m+y_m"),
        (action("navigate_to", place="kitchen", object="cup"), "exactly one of"),
        (action("navigate_to", x_m=1.0), 'needs "y_m" too'),
        (action("move", distance_m=99), "in -3 to 3"),
        (action("move", distance_m=float("nan")), "must be a number"),
        (action("move", distance_m=True), "must be a number"),
        (action("speak", text="  "), "1 to 500 characters"),
        (action("move_arm", pose="dance"), "unknown pose"),
        (action("place", destination="moon", relation="in"), "moon"),
    ],
)
def test_each_fault_is_named(bad: Action, said: str) -> None:
    found = faults(bad)
    assert len(found) == 1
    assert said in found[0]


def test_a_cycle_is_named_with_its_path() -> None:
    found = faults(
        action("stop", "a", depends_on=("c",)),
        action("stop", "b", depends_on=("a",)),
        action("stop", "c", depends_on=("b",)),
    )
    assert found == ["the dependencies form a cycle: a -> c -> b -> a"]


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    plan = Plan(goal="x", actions=(action("fly"), action("wait", "a1", ("zz",), duration_s=-1)))
    with pytest.raises(PlanInvalid) as caught:
        check_plan(plan, WORLD)
    assert len(caught.value.faults) == 4


def test_an_infeasible_or_empty_plan_is_refused() -> None:
    assert faults_of(Plan(goal="x", feasible=False, reasoning="no arm"))
    assert faults_of(Plan(goal="x")) == ["it has no actions"]


def test_aliases_of_places_are_accepted() -> None:
    assert faults(action("navigate_to", place="the galley")) == []


WIDE = {"size_m": (0.14, 0.14, 0.1), "position_m": (2.3, 1.5, 0.5)}
ON_CUP = Rest("on", "cup_1")
HERE = (2.15, 2.05, -1.5708)
TAKE = ("pick_up", {"object": "cup_2"})


@pytest.fixture
def refused(ask: Any, propose: Any):
    """Return how the plan of some steps is refused among some things."""

    def refused(scene: Snapshot, *steps: Any, **changes: Any) -> PlanInvalid:
        plan: Plan = propose(*steps).plan
        request = ask("x", scene=scene, here=HERE, **changes)
        with pytest.raises(PlanInvalid) as found:
            check_plan(plan, request.world, request.scene, request.here)
        return found.value

    return refused


@pytest.fixture
def cups(scene: Snapshot, thing: Any) -> Snapshot:
    """A red cup, and a blue one that is too wide."""
    return replace(scene, things=(thing("cup_1"), thing("cup_2", "blue", **WIDE)))


def test_another_thing_is_offered_in_place_of_one_that_cannot_be_gripped(refused, cups):
    error = refused(cups, TAKE)
    assert error.advice == "I could take the red cup (cup_1) instead"
    assert str(error) == f"{error.why}. {error.advice}"
    assert "graspable" in error.why


def test_only_what_the_hands_can_take_is_offered(refused, cups, thing):
    wide = replace(cups.things[0], size_m=(0.14, 0.14, 0.1))
    under = replace(cups.things[0], colour="green")
    on_top = thing("ball_1", "green", position_m=(2.0, 1.5, 0.58), rests=ON_CUP)
    offered = [
        refused(replace(cups, things=(*others, cups.things[1])), TAKE).advice
        for others in ((under,), (under, on_top), (wide,), (thing("ball_1", "green"),), ())
    ]
    assert offered == ["I could take the green cup (cup_1) instead", "", "", "", ""]


def test_what_is_too_heavy_too_is_not_offered(refused, cups, thing):
    heavy = thing("bottle_1", "green", size_m=(0.07, 0.07, 0.24), position_m=(2.3, 1.5, 0.57))
    also = replace(heavy, thing_id="bottle_2", position_m=(2.0, 1.5, 0.57))
    light = thing("bottle_3", size_m=(0.05, 0.05, 0.1), position_m=(1.8, 1.5, 0.5))
    take = ("pick_up", {"object": "bottle_1"})
    assert refused(replace(cups, things=(heavy, also)), take).advice == ""
    error = refused(replace(cups, things=(heavy, also, light)), take)
    assert error.advice == "I could take the red bottle (bottle_3) instead"


def test_a_box_is_offered_in_place_of_what_is_none(refused, cups, thing):
    box = thing("box_1", "orange", position_m=(2.4, 1.5, 0.5), size_m=(0.24, 0.24, 0.13))
    put = ("place", {"destination": "cup_2", "relation": "in"})
    holding = {"left": "ball", "right": None}
    scene = replace(cups, things=(*cups.things, box))
    error = refused(scene, put, holding=holding)
    assert error.advice == "I could put it in the orange box (box_1) instead"
    assert refused(cups, put, holding=holding).advice == ""


def test_nothing_is_offered_where_the_robot_is_the_reason(refused, cups, thing):
    far = ("navigate_to", {"place": "bedroom"})
    full = {"left": "ball", "right": "can"}
    good = ("pick_up", {"object": "cup_1"})
    near = thing("cup_3", "green", position_m=(2.0, 4.6, 0.5))
    assert "robot before it" in refused(cups, far, good).why
    assert refused(replace(cups, things=(*cups.things, near)), far, good).advice == ""
    assert refused(cups, good, holding=full).advice == ""
    assert refused(cups, TAKE, holding=full).advice == ""


def test_a_plan_that_is_none_is_refused_without_advice(refused, cups):
    assert refused(cups, TAKE, ("fly", {})).advice == ""


def test_aloud_the_advice_is_a_sentence_of_its_own_without_ids(refused, cups):
    said = spoken_refusal(refused(cups, TAKE))
    assert said.endswith(". I could take the red cup instead.")
    short = spoken_refusal(PlanInvalid(["it is wet"], "I could rest instead"))
    assert (
        short == "Sorry, I cannot do that: the plan was refused: it is wet. I could rest instead."
    )
    assert spoken_refusal(PlanInvalid(["it has no actions"])).count(".") == 1
