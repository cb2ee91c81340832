from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.understanding import Conversation, ConversationTurn, Mention, MentionRole
from vla_deploy.planning.understanding.grounding import ground_plan
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.errors import PlanError, PlanInvalid, UnknownPlace
from vla_deploy.plans.plan import PUT_IN, Action, Plan
from vla_deploy.plans.validator import check_plan

if TYPE_CHECKING:
    from conftest import Home

Step = tuple[str, dict[str, Any]]


def plan_of(*steps: Step) -> Plan:
    actions = tuple(
        Action(id=f"a{number}", skill=skill, parameters=parameters,
               depends_on=(f"a{number - 1}",) if number > 1 else ())
        for number, (skill, parameters) in enumerate(steps, start=1)
    )  # fmt: skip
    return Plan(goal="test", actions=actions)


def grounded(home: "Home", *steps: Step, scene: tuple[Any, ...] = (), **changes: Any) -> Plan:
    request = home.ask(*scene, **changes)
    found = ground_plan(plan_of(*steps), request)
    check_plan(found, request.world, request.scene, request.here)
    return found


def steps_of(found: Plan) -> list[Step]:
    return [(one.skill, one.parameters) for one in found.actions]


MAIN = [
    ("find_object", {"object": "red cup"}),
    ("navigate_to", {"object": "red cup"}),
    ("pick_up", {"object": "red cup"}),
    ("find_object", {"object": "box"}),
    ("navigate_to", {"object": "box"}),
    ("place", {"destination": "box", "relation": "in"}),
]


@pytest.mark.parametrize(
    "steps",
    [
        [("pick_up", {"object": "the red cup"}), ("place", {"object": "it", "destination": "box"})],
        [("place", {"object": "red cup", "destination": "the box", "relation": "in"})],
        MAIN,
    ],
)
def test_what_is_missing_is_put_in(home: "Home", steps: list[Step]) -> None:
    assert steps_of(grounded(home, *steps, scene=("cup_1", "box_1"))) == MAIN


def test_every_cup_goes_into_the_box_one_after_the_other(home: "Home") -> None:
    found = grounded(
        home,
        ("place", {"object": "both cups", "destination": "the box"}),
        scene=("cup_1", "cup_2", "box_1"),
    )
    assert [(skill, *given.values()) for skill, given in steps_of(found)] == [
        ("find_object", "cup_1"), ("navigate_to", "cup_1"), ("pick_up", "cup_1"),
        ("find_object", "box"), ("navigate_to", "box"), ("place", "box", "in"),
        ("find_object", "cup_2"), ("navigate_to", "cup_2"), ("pick_up", "cup_2"),
        ("navigate_to", "box"), ("place", "box", "in"),
    ]  # fmt: skip


def test_with_two_hands_full_the_right_one_puts_down(home: "Home") -> None:
    cup = replace(home.things["cup_1"], held_by="left")
    ball = replace(home.things["ball_1"], held_by="right")
    world = replace(home.world, holding={"left": "cup", "right": "ball"})
    found = grounded(
        home,
        ("place", {"object": "the ball", "destination": "coffee table"}),
        scene=(cup, ball),
        world=world,
    )
    assert steps_of(found)[-1] == (
        "place",
        {"destination": "coffee_table", "relation": "on", "arm": "right"},
    )


def test_with_no_hand_free_nothing_is_taken(home: "Home") -> None:
    world = replace(home.world, holding={"left": "cup", "right": "ball"})
    with pytest.raises(PlanInvalid, match="no hand is free"):
        grounded(home, ("pick_up", {"object": "bottle"}), world=world)


@pytest.mark.parametrize(
    ("given", "steps"),
    [
        (("navigate_to", {"place": "here"}),
         [("navigate_to", {"x_m": 2.15, "y_m": 2.05, "yaw_rad": -1.571})]),
        (("navigate_to", {"place": "the kitchen"}), [("navigate_to", {"place": "kitchen"})]),
        (("navigate_to", {"place": "charging"}), [("navigate_to", {"place": "charging_station"})]),
        (("navigate_to", {"place": "the table"}), [("navigate_to", {"place": "coffee_table"})]),
        (("navigate_to", {"place": "the box"}),
         [("find_object", {"object": "box"}), ("navigate_to", {"object": "box"})]),
    ],
)  # fmt: skip
def test_a_way_leads_to_a_place_or_to_a_thing(home: "Home", given: Step, steps: list[Step]) -> None:
    assert steps_of(grounded(home, given, scene=("box_1",))) == steps


GIVE = "pick_up navigate_to hand_over"


@pytest.mark.parametrize(
    ("given", "skills"),
    [
        ("the red cup", GIVE),
        ("a cup", GIVE),
        ("both cups", f"{GIVE} {GIVE}"),
    ],
)  # fmt: skip
def test_what_is_handed_over_is_fetched_to_who_asked_for_it(
    home: "Home", given: str, skills: str
) -> None:
    scene = ("cup_1", "cup_2", "ball_1")
    found = steps_of(grounded(home, ("hand_over", {"object": given}), scene=scene))
    told = [
        skill
        for skill, parameters in found
        if skill == "pick_up" or (skill in GIVE.split() and "object" not in parameters)
    ]
    assert " ".join(told) == skills


@pytest.mark.parametrize(
    ("destination", "expected"),
    [
        ("the kitchen", "kitchen_table"),
        (None, "coffee_table"),
        ("there", "bedside_table"),
    ],
)
def test_things_are_put_on_furniture(home: "Home", destination: str | None, expected: str) -> None:
    spoken = Mention(said="night stand", means="bedside_table", role=MentionRole.PLACE)
    talk = Conversation().after(ConversationTurn(said="before", mentioned=(spoken,)))
    given = {"object": "it"} if destination is None else {"destination": destination}
    world = replace(home.world, holding={"left": "cup", "right": None})
    found = grounded(home, ("place", given), world=world, conversation=talk)
    assert steps_of(found) == [
        ("navigate_to", {"place": expected}),
        ("place", {"destination": expected, "relation": "on"}),
    ]


def test_which_thing_to_go_to_is_asked_and_which_to_look_for_is_not(home: "Home") -> None:
    cup = {"object": "the cup"}
    assert steps_of(grounded(home, ("find_object", cup), scene=("cup_1", "cup_2")))
    with pytest.raises(Ambiguous):
        grounded(home, ("navigate_to", cup), scene=("cup_1", "cup_2"))


def test_an_unseen_thing_is_looked_for_where_it_was_said_to_be(home: "Home") -> None:
    found = grounded(home, ("pick_up", {"object": "the bottle on the kitchen table"}))
    assert steps_of(found)[:2] == [
        ("navigate_to", {"place": "kitchen_table"}),
        ("find_object", {"object": "bottle"}),
    ]


def test_actions_that_share_a_part_come_in_turn(home: "Home") -> None:
    actions = (Action(id="a", skill="turn", parameters={"angle_rad": 1.0}),
               Action(id="b", skill="move", parameters={"distance_m": 0.2}),
               Action(id="s", skill="speak", parameters={"text": "hello"}))  # fmt: skip
    found = ground_plan(Plan(goal="x", actions=actions), home.ask())
    assert {one.id: one.earlier for one in found.actions} == {
        "a": (),
        "b": ("a",),
        "s": (),
    }


def test_the_plan_says_how_it_was_understood(home: "Home") -> None:
    found = grounded(home, ("pick_up", {"object": "the left cup"}), scene=("cup_1", "cup_2"))
    assert '"left cup" is cup_2 (blue cup) (the only one that fits)' in found.reasoning
    assert [one.id for one in found.actions if one.description == PUT_IN] == [
        "a1_find_object",
        "a1_navigate_to",
    ]
    assert found.actions[-1].preconditions[:2] == ("object known", "not held")


def test_what_is_ambiguous_or_unknown_is_not_grounded(home: "Home") -> None:
    with pytest.raises(Ambiguous):
        grounded(home, ("pick_up", {"object": "the cup"}), scene=("cup_1", "cup_2"))
    with pytest.raises(UnknownPlace):
        grounded(home, ("navigate_to", {"place": "moon"}))
    with pytest.raises(PlanInvalid):
        grounded(home, ("place", {"destination": 7}))
    with pytest.raises(Ambiguous, match="Which one, the coffee table"):
        grounded(home, ("navigate_to", {"place": "table"}), here=(6.0, 2.0, 0.0))
    with pytest.raises(PlanInvalid):
        ground_plan(Plan(goal="x", actions=(Action(id="a", skill="stop", depends_on=("b",)),)),
                    home.ask())  # fmt: skip


VALUES = st.one_of(
    st.text(max_size=20), st.none(), st.booleans(), st.floats(), st.integers(-10, 10),
    st.sampled_from(["it", "them", "the red cup", "both cups", "there", "here", "box", "kitchen",
                     "the other one", "left", "cup_1", "everything"]),
)  # fmt: skip
NAMES = sorted({name for spec in SKILLS.values() for name in spec.parameters})


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([*SKILLS, "fly"]), st.dictionaries(st.sampled_from(NAMES), VALUES)
        ),
        max_size=5,
    )
)
def test_any_plan_is_refused_by_name_or_grounded_and_then_judged(
    home: "Home", steps: list[Step]
) -> None:
    request = home.ask("cup_1", "cup_2", "ball_1", "box_1", conversation=home.spoke_of("cup_1"))
    try:
        found = ground_plan(plan_of(*steps), request)
    except PlanError as error:
        assert str(error)
        return
    with suppress(PlanInvalid):
        check_plan(found, request.world, request.scene, request.here)


def test_a_box_that_nobody_can_get_at_is_not_the_one_to_put_into(home: "Home") -> None:
    in_the_wall = replace(home.things["box_1"], thing_id="box_9", position_m=(-3.0, -3.0, 1.18))
    world = replace(home.world, is_free=lambda x_m, y_m: x_m > 0.0 and y_m > 0.0)
    put = ("place", {"object": "red cup", "destination": "the box", "relation": "in"})
    for boxes, name in (((in_the_wall, "box_1"), "box_1"), ((in_the_wall,), "box")):
        found = steps_of(grounded(home, put, scene=("cup_1", *boxes), world=world))
        assert ("place", {"destination": name, "relation": "in"}) in found, found
        looks = ("find_object", {"object": name}) in found
        assert looks, found
