"""Steps become actions in the speaker's words; what cannot be done says so."""

import math
from dataclasses import replace

import pytest

from vla_deploy.planning.builders.steps import Steps
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.errors import CannotBeDone, Declined
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding import Conversation, ConversationTurn
from vla_deploy.plans.errors import PlanInvalid, UnknownPlace
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import chained
from vla_deploy.robots import load_robot
from vla_deploy.world import Snapshot

WORLD = world_of(load_robot("butler"), {})
HERE = (1.0, 2.0, 0.5)
Skills = list[tuple[str, dict[str, object]]]


def planned(command: str, *steps: Step, request: PlanRequest | None = None) -> Skills:
    request = request or PlanRequest(command_id="c", text=command, world=WORLD, here=HERE)
    made = Steps(command.split(), request)
    actions = chained([skill for step in steps for skill in made.skills(step)])
    assert [one.depends_on for one in actions[1:]] == [(one.id,) for one in actions[:-1]]
    return [(one.skill, dict(one.parameters)) for one in actions]


@pytest.mark.parametrize(
    ("command", "step", "skills"),
    [
        ("take a cup on the table", {"do": "pick", "what": "cup on table"},
         [("pick_up", {"object": "a cup on the table"})]),
        ("put the cup and the ball in the box",
         {"do": "put", "what": "cup and ball", "how": "in", "where": "box"},
         [("place", {"object": one, "destination": "the box", "relation": "in"})
          for one in ("the cup", "the ball")]),
        ("get my phone from the bedroom", {"do": "pick", "what": "phone", "from": "bedroom"},
         [("navigate_to", {"place": "bedroom"}), ("pick_up", {"object": "my phone"})]),
        ("move the can from the coffee table to the box",
         {"do": "put", "what": "can from coffee table", "how": "to", "where": "box"},
         [("place", {"object": "the can on the coffee table", "destination": "the box"})]),
        ("bring me all the cups but the red cup and the blue cup",
         {"do": "bring", "what": "all cups", "except": "red cup and blue cup"},
         [("hand_over", {"object": "all the cups but the red cup and the blue cup"})]),
        *(
            ("get a grip of the cup", {"do": "pick", "what": what},
             [("pick_up", {"object": "the cup"})])
            for what in ("grip cup", "a grip of the cup", "of the cup")
        ),
    ],
)  # fmt: skip
def test_a_step_becomes_actions_in_the_speakers_words(
    command: str, step: Step, skills: Skills
) -> None:
    assert planned(command, step) == skills


@pytest.mark.parametrize(
    ("name", "poses", "pose"),
    [
        ("fold", {"tuck", "rest"}, "tuck"),
        ("fold", {"folded", "rest"}, "folded"),
        ("folded", {"folded", "tuck"}, "folded"),
        ("look ahead", {"look_ahead"}, "look_ahead"),
        ("dance", {"rest"}, "dance"),
    ],
)
def test_a_pose_is_the_one_that_the_robot_has(name: str, poses: set[str], pose: str) -> None:
    world = replace(WORLD, poses=frozenset(poses))
    request = PlanRequest(command_id="c", text=name, world=world, here=HERE)
    assert planned(name, {"do": "pose", "name": name}, request=request) == [
        ("move_arm", {"pose": pose})
    ]


@pytest.mark.parametrize(
    ("to", "skills"),
    [
        ({}, [("hand_over", {"object": "bottle"})]),
        ({"to": "me"}, [("hand_over", {"object": "bottle"})]),
        ({"to": "coffee table"}, [("place", {"object": "bottle", "destination": "coffee table"})]),
        ({"to": "entrance"},
         [("pick_up", {"object": "bottle"}), ("navigate_to", {"place": "entrance"})]),
    ],
)  # fmt: skip
def test_what_is_brought_is_handed_to_a_person_and_taken_to_a_place(
    to: Step, skills: Skills
) -> None:
    assert planned("bring bottle", {"do": "bring", "what": "bottle", **to}) == skills


def test_what_is_excepted_from_tidying_stays(scene: Snapshot) -> None:
    command = "tidy up everything except the red cup"
    request = PlanRequest(command_id="c", text=command, world=WORLD, here=HERE, scene=scene)
    found = planned(command, {"do": "tidy", "except": "red cup"}, request=request)
    assert [given.get("object") for skill, given in found if skill == "place"] == ["cup_2"]


def test_what_is_too_wide_for_any_hand_stays_and_is_told(scene: Snapshot) -> None:
    wide = replace(scene.things[0], thing_id="bowl_1", kind="bowl", size_m=(0.14, 0.14, 0.06))
    for things, places, said in (
        ((*scene.things, wide), ["cup_1", "cup_2"], "That is put away. "),
        ((wide,), [], ""),
    ):
        known = replace(scene, things=things)
        request = PlanRequest(command_id="c", text="tidy up", world=WORLD, here=HERE, scene=known)
        *puts, (_, spoken) = planned("tidy up", {"do": "tidy"}, request=request)
        assert [given["object"] for _, given in puts] == places
        assert spoken == {"text": f"{said}What is too wide for my hands stays: bowl."}


def test_back_is_where_the_command_before_was_told() -> None:
    turn = ConversationTurn(said="go to the kitchen", here=(4.0, 5.0, 0.0))
    talk = Conversation(turns=(turn,))
    request = PlanRequest(command_id="c", text="go back", world=WORLD, conversation=talk)
    found = planned("go back", {"do": "go", "where": "back"}, request=request)
    assert found == [("navigate_to", {"x_m": 4.0, "y_m": 5.0, "yaw_rad": 0.0})]


@pytest.mark.parametrize(
    ("step", "skill", "name", "value"),
    [
        ({"do": "move", "way": "backward", "by": "50 cm"}, "move", "distance_m", -0.5),
        ({"do": "move", "way": "forward"}, "move", "distance_m", 0.5),
        ({"do": "turn", "way": "right", "by": "ninety degrees"}, "turn", "angle_rad", -math.pi / 2),
        ({"do": "turn", "way": "around"}, "turn", "angle_rad", math.pi),
        ({"do": "turn", "way": "around", "by": "about"}, "turn", "angle_rad", math.pi),
        ({"do": "wait", "by": "half a minute"}, "wait", "duration_s", 30.0),
    ],
)
def test_amounts_become_numbers(step: Step, skill: str, name: str, value: float) -> None:
    ((found, parameters),) = planned("whatever was said", step)
    assert found == skill
    assert parameters[name] == pytest.approx(value)


@pytest.mark.parametrize(
    ("step", "error"),
    [
        ({"do": "unknown"}, Declined),
        ({"do": "impossible"}, CannotBeDone),
        ({"do": "nothing"}, CannotBeDone),
        ({"do": "put", "what": "cup", "how": "behind", "where": "box"}, CannotBeDone),
        ({"do": "bring", "what": "cup", "to": "anna"}, UnknownPlace),
        ({"do": "go", "where": "back"}, UnknownPlace),
        ({"do": "wait", "by": "blue"}, PlanInvalid),
        ({"do": "turn", "way": "left", "by": "a quarter of glare"}, PlanInvalid),
        ({"do": "move", "way": "forward", "by": "1 e9 metres"}, PlanInvalid),
        ({"do": "turn", "way": "left", "by": "kitchen degrees"}, PlanInvalid),
    ],
)
def test_what_cannot_be_done_is_refused_with_its_reason(step: Step, error: type[Exception]) -> None:
    with pytest.raises(error):
        planned("whatever was said", step)


def test_one_step_that_is_none_leaves_no_plan_at_all() -> None:
    with pytest.raises(CannotBeDone):
        planned("go home and fly", {"do": "go", "where": "home"}, {"do": "impossible"})


def test_what_it_can_do_is_what_its_body_can() -> None:
    world = world_of(load_robot("so101"), {})
    request = PlanRequest(command_id="c", text="what can you do", world=world)
    assert planned("what can you do", {"do": "ask", "about": "able"}, request=request) == [
        ("speak", {"text": "I can look for things and tell you what I see, pick things up and put "
                           "them in a box or on a table, give them to you, tidy up, bring my arm "
                           "to a pose, open and close my hand and stand still when you tell me "
                           "to."})
    ]  # fmt: skip
