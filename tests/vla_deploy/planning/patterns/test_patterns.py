"""The commonest commands are planned by whole patterns, whose slots hold known names alone."""

from dataclasses import replace

import pytest

from vla_deploy.planning.errors import Declined, NotAble, NotUnderstood
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.patterns.backend import pattern_plan
from vla_deploy.planning.patterns.steering import awaiting, is_stop, is_word, objects, only_objects
from vla_deploy.planning.understanding import Conversation, ConversationTurn
from vla_deploy.plans.errors import UnknownDevice, UnknownPlace
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot

WORLD = world_of(load_robot("butler"), {"left": None, "right": None}, devices_on={"lamp": True})
HERE = (1.0, 2.0, 0.5)


def request_for(text: str, *turns: ConversationTurn) -> PlanRequest:
    conversation = Conversation(turns=turns)
    return PlanRequest(command_id="c", text=text, world=WORLD, here=HERE, conversation=conversation)


def does(text: str, *turns: ConversationTurn) -> str:
    actions = pattern_plan(request_for(text, *turns)).actions
    told = (" ".join(map(str, (one.skill, *one.parameters.values()))) for one in actions)
    return "; ".join(told)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("go to the kitchen", "navigate_to the kitchen"),
        ("Could you please drive to the living room?", "navigate_to the living room"),
        ("come here", "navigate_to here"),
        ("dock", "charge"),
        ("go and charge", "charge"),
        ("charge yourself", "charge"),
        ("go to the charging station", "charge"),
        ("follow me", "follow_person"),
        ("Please come with me for two minutes.", "follow_person 120.0"),
        ("follow that person", "follow_person"),
        ("inspect the box", "inspect the box"),
        ("look at the cup from both sides", "inspect the cup"),
        ("set the kitchen table for one", "place cup the kitchen table on"),
        ("guard the kitchen", "guard the kitchen"),
        ("watch the door for ten minutes", "guard the door 600.0"),
        ("keep watch here for ten minutes", "guard 600.0"),
        ("stand guard", "guard"),
        ("vacuum the kitchen", "sweep the kitchen"),
        ("clean the floor of the living room", "sweep the living room"),
        ("move back a bit", "move -0.2"),
        ("turn right a bit", "turn -0.3490658503988659"),
        ("drive forward 50 cm", "move 0.5"),
        ("turn left 90 degrees", "turn 1.5707963267948966"),
        ("turn on the lamp", "turn_on lamp"),
        ("please switch the floor lamp off", "turn_off lamp"),
        ("put the light on", "turn_on lamp"),
        ("turn on the lamp in the living room", "turn_on lamp"),
        ("switch all the lights off", "turn_off lamp"),
        ("turn off both of the lamps", "turn_off lamp"),
        ("turn everything off", "turn_off lamp; turn_off socket"),
        ("are the lights on", "speak The lamp is on."),
        ("is the lamp on?", "speak The lamp is on."),
        (
            "are the light and the socket off",
            "speak The lamp is on. I do not know whether the socket is on: it does not answer.",
        ),
        ("turn off the lamp and the socket", "turn_off lamp; turn_off socket"),
        ("go to the kitchen and switch on the plug", "navigate_to the kitchen; turn_on socket"),
        (
            "patrol the kitchen and the bedroom",
            "navigate_to the kitchen; look_at left; look_at ahead; look_at right; look_at down; "
            "navigate_to the bedroom; look_at left; look_at ahead; look_at right; look_at down",
        ),
        ("look up", "look_at up"),
        ("look at the blue cup", "look_at the blue cup"),
        ("find my keys", "find_object my keys"),
        ("pick up the red cup", "pick_up the red cup"),
        ("grab the ball with your left hand", "pick_up the ball left"),
        ("put it down", "place it"),
        ("free your right hand", "place right"),
        ("empty the gripper", "place"),
        ("put the cup in the box", "place the cup the box in"),
        ("put the red cup next to the book", "place the red cup the book next to"),
        ("open your right gripper", "open_gripper right"),
        ("tuck your arms", "move_arm tuck"),
        ("say good morning", "speak Good morning."),
        ("wait 5 seconds", "wait 5.0"),
        ("turn around", "turn 3.141592653589793"),
        ("spin around once", "turn 6.283185307179586"),
        ("bring the cup to the entrance", "pick_up the cup; navigate_to the entrance"),
        ("bring the cup to the coffee table", "place the cup the coffee table"),
        (
            "put the red cup and the ball into the box",
            "place the red cup the box in; place the ball the box in",
        ),
        (
            "pick up the red cup and put it in the box, then go to the kitchen",
            "pick_up the red cup; place it the box in; navigate_to the kitchen",
        ),
    ],
)
def test_a_common_command_is_planned_as_it_is_said(text: str, expected: str) -> None:
    said = does(text)
    assert said == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("go to the stretched out pose", "stretched_out"),
        ("bring your arm to the pose stretched out", "stretched_out"),
        ("move your left arm into the resting position", "rest left"),
        ("put both arms into your folded posture", "folded"),
        ("go back to the tucked pose", "folded"),
        ("go to the moon pose", "moon"),  # the validator lists those there are
    ],
)
def test_a_pose_is_said_with_its_words(text: str, expected: str) -> None:
    robot = load_robot("so101_pair")
    robot = replace(robot, poses={**robot.poses, "stretched_out": robot.poses["ready"]})
    request = replace(request_for(text), world=world_of(robot, {}))
    (action,) = pattern_plan(request).actions
    assert action.skill == "move_arm"
    assert " ".join(map(str, action.parameters.values())) == expected


def test_a_position_that_is_no_pose_is_a_place() -> None:
    with pytest.raises(UnknownPlace, match="parking position"):
        does("go to the parking position")


@pytest.mark.parametrize(
    "text",
    [
        "don't go to the kitchen",
        "go to the kitchen unless I am there",
        "pick up the cup but not the blue one",
        "bring me the cup or the ball",
        "bring me the cup when I call",
        "put everything except the cup in the box",
        "go to the kitchen instead of the bedroom",
        "tell Anna to go to the kitchen",
        "pick up the cup that my sister gave me",
        "put the cup on the table next to the book",
        "don't turn on the lamp",
        "turn on the lamp when it gets dark",
        "turn on the spot",
        "switch off all the lights except the lamp",
        "turn off every lamp but the floor lamp",
        "put the cup on",
        "colourless green ideas",
        "x" * 5000,
        "",
    ],
)
def test_what_no_pattern_covers_whole_is_declined(text: str) -> None:
    with pytest.raises(Declined):
        pattern_plan(request_for(text))


def test_a_place_that_nobody_knows_is_named() -> None:
    with pytest.raises(UnknownPlace, match="narnia"):
        pattern_plan(request_for("go to narnia"))


def test_a_device_that_nobody_knows_is_named_with_those_there_are() -> None:
    with pytest.raises(UnknownDevice, match=r'"the radio"; I can switch: lamp, socket'):
        pattern_plan(request_for("turn on the radio"))
    without = replace(WORLD, devices={})
    with pytest.raises(Declined):
        pattern_plan(replace(request_for("turn on the radio"), world=without))


def test_again_does_what_was_done_last() -> None:
    plan = pattern_plan(request_for("turn left 30 degrees"))
    last = ConversationTurn(said="turn left 30 degrees", plan=plan)
    assert does("again", last) == does("do it once again", last) == does(last.said)
    with pytest.raises(NotAble):
        pattern_plan(request_for("again"))


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        ("When I say so, bring me the cup.", "bring me the cup"),
        ("when I tell you go to the kitchen", "go to the kitchen"),
        ("when I tell you to, go to the kitchen", "go to the kitchen"),
        ("bring me the cup, but only when I say so", "bring me the cup"),
        ("wait until I give you the word and then go home", "go home"),
        ("go home the moment I say so", "go home"),
        ("when I tell you to go to bed, turn left", None),
        ("when I come home, turn left", None),
        ("bring me the cup", None),
    ],
)
def test_a_command_that_waits_for_a_word_is_found(text: str, rest: str | None) -> None:
    assert awaiting(text) == rest


@pytest.mark.parametrize(
    ("text", "begins"),
    [
        ("Go!", True), ("okay robot, go ahead", True), ("right now, please", True),
        ("do it now", True), ("now", True), ("yes", False), ("okay then", False),
        ("go to the kitchen", False), ("no go", False), ("not now", False), ("don't go", False),
        ("go on holiday", False), ("do it later", False), ("", False),
    ],
)  # fmt: skip
def test_the_word_that_begins_is_no_mere_yes(text: str, begins: bool) -> None:
    assert is_word(text) == begins


@pytest.mark.parametrize(
    ("text", "stops"),
    [
        ("stop", True), ("Stop!", True), ("no, stop it now", True), ("robot, halt", True),
        ("stop stop stop", True), ("please don't move", True), ("never mind", True),
        ("stop driving to the kitchen", True), ("freeze.", True),
        ("could you stop please", True), ("Can you please stop now?", True),
        ("stop what youre doing", True), ("okay butler, would you stop that", True),
        ("stop at the kitchen", False), ("stop looking and come here", False),
        ("go to the kitchen", False), ("", False), ("don't stop", False),
    ],
)  # fmt: skip
def test_words_that_only_stop_are_known(text: str, stops: bool) -> None:
    assert is_stop(text) is stops


@pytest.mark.parametrize(
    ("text", "is_objection", "has_more"),
    [
        ("no!", True, False), ("No, don't!", True, False), ("please don't do that", True, False),
        ("that's wrong", True, False), ("not the red one", True, False),
        ("hold on a second", True, False), ("stop this", True, False),
        ("don't go there, come here", True, True), ("stop and come here", True, True),
        ("don't worry", False, True), ("don't stop", False, True), ("no problem", False, True),
        ("bring it, don't drop it", False, True), ("wait 5 seconds", False, True),
        ("go to the bus stop", False, True), ("no, the blue one", True, True),
        ("no the blue one", True, False), ("wait, come here", True, True),
    ],
)  # fmt: skip
def test_words_that_object_are_told_from_idioms_and_from_what_is_to_be_done(
    text: str, is_objection: bool, has_more: bool
) -> None:
    assert (objects(text), not only_objects(text)) == (is_objection, has_more)


@pytest.mark.parametrize("sees", [True, False])
def test_what_is_not_understood_is_answered_by_what_the_robot_can_do(sees: bool) -> None:
    robot = load_robot("so101")
    if not sees:
        robot = replace(robot, parts=replace(robot.parts, camera=None))
    said = str(NotUnderstood("dance", world_of(robot, {})))
    assert "open your hand" in said
    assert ("find" in said) is ("put" in said) is sees
