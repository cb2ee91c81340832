"""Commands as people give them, and what each does; the way there is left out."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.planning.errors import (
    Ambiguous,
    NotAble,
    NotUnderstood,
    PlanInvalid,
    PlanningError,
    UnknownObject,
    UnknownPlace,
)
from vla_deploy.planning.rules import is_stop
from vla_deploy.planning.understanding import Conversation, Turn

if TYPE_CHECKING:
    from conftest import Flat

Does = Callable[..., str]
BOX = "place box in"
BACK = "navigate_to 2.15 2.05 -1.571"

COMMANDS = {
    "going": {
        "could you please go to the kitchen?": "navigate_to kitchen",
        "drive to the bedroom at 0.3 m/s": "navigate_to bedroom 0.3",
        "go to where the red cup is": "navigate_to red cup",
        "charge yourself": "navigate_to charging_station",
        "go to the kitchen, wait five seconds and come back":
            f"navigate_to kitchen; wait 5.0; {BACK}",
    },
    "moving": {
        "spin around once": "turn 6.283185307179586",
        "turn a quarter to the right": "turn -1.5707963267948966",
        "back up a metre and a half": "move -1.5",
        "look up at the blue cup": "look_at blue cup",
        "glance down at the side table": "look_at down",
    },
    "taking": {
        "pick up the leftmost cup": "pick_up cup_2",
        "pick up the cup closest to you": "pick_up cup_2",
        "pick up the book with your right hand and the ball with the left":
            "pick_up book right; pick_up ball left",
        "grab the red cup and the blue one": "pick_up red cup left; pick_up cup_2 right",
        "dig the ball out of the box": "pick_up ball in box",
    },
    "bringing": {
        "bring me the red one": f"pick_up cup_1; {BACK}; speak Here is the red one.",
        "gimme the book, will you": f"pick_up book; {BACK}; speak Here is the book.",
    },
    "putting": {
        "put everything on the coffee table into the box": f"{BOX}; {BOX}; {BOX}; {BOX}",
        "take the ball to the bedroom": "place bedside_table on",
        "put away the ball": BOX,
        "deliver the ball to the front door": "pick_up ball; navigate_to entrance",
        "take the ball to the kitchen table, put it down, then go home":
            "place kitchen_table on; navigate_to charging_station",
        "take the red cup and the ball and put both on the side table":
            "pick_up red cup left; pick_up ball right; place side_table on left; "
            "place side_table on",
        "put the ball next to the book": "place book next to",
        "leave the book here and take the ball to the side table":
            "speak I leave it where it is.; place side_table on",
        "pick up the red cup, go to the kitchen, and put it on the table":
            "pick_up red cup; navigate_to kitchen; place kitchen_table on",
    },
    "searching": {
        "where did I leave my keys?": "find_object keys",
        "look for the bottle in the kitchen": "find_object bottle",
    },
    "asking": {
        "where is the ball": "speak The green ball is on the coffee table, in view.",
        "what do you see?": "speak I see a red cup, a blue cup, a green ball, a purple book and "
                            "an orange box.",
        "what is on the side table": "speak I see an orange box on the side table.",
        "is the ball on the table?": "speak Yes, I see a green ball.",
        "is the ball in the kitchen or not?":
            "speak The green ball is on the coffee table, in view.",
        "is there a bottle?": "speak No, I do not see that.",
        "how many cups are there?": "speak I see 2.",
        "which ball is on the coffee table?": "speak It is a green ball.",
        "what are you holding?": "speak My hands are empty.",
        "where are you": "speak I am near the coffee table.",
    },
    "cleaning": {
        "patrol the kitchen, the bedroom and the hallway":
            "navigate_to kitchen; navigate_to bedroom; navigate_to entrance",
        "tidy up": f"{BOX}; {BOX}; {BOX}; {BOX}; speak That is put away.",
        "tidy up the living room please": f"{BOX}; {BOX}; {BOX}; {BOX}; speak That is put away.",
        "clear the bedside table": "speak I know of nothing there to put away. I look around.; "
            "navigate_to bedside_table; look_at left; look_at ahead; look_at right; look_at down",
    },
    "hesitating": {
        "pick up the red cup, no wait, the blue one": "pick_up blue cup",
        "turn left, no, turn right": "turn -1.5707963267948966",
        "move forward one metre, I mean half a metre": "move 0.5",
        "put the ball on the side table, or rather in the box": BOX,
    },
    "the rest": {
        "open your left hand": "open_gripper left",
        "tuck in your arms": "move_arm tuck",
        "move your arms to the rest position": "move_arm rest",
        "tell Anna that dinner is ready": "speak dinner is ready",
        "hold this": "open_gripper; speak Put it between my fingers.; wait 4.0; close_gripper",
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "expected"),
    [pair for kind in COMMANDS.values() for pair in kind.items()],
)
def test_a_command_does_what_it_says(does: Does, text: str, expected: str) -> None:
    assert does(text) == expected


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("come a little closer", UnknownPlace),
        ("put the cup on the shelf", UnknownObject),
        ("tidy up the garage", UnknownPlace),
        ("pick up the cup", Ambiguous),
        ("pick up the red cap", Ambiguous),
        ("turn on the light", NotAble),
        ("put the red cup next to the coffee table", NotAble),
        ("put the book back where it was", NotAble),
        ("visit these rooms: kitchen, narnia", NotUnderstood),
        ("put the ball in the red cup", PlanInvalid),
        ("put it down", PlanInvalid),
        ("drive to the kitchen at 0.9 m/s", PlanInvalid),
        ("go back", NotUnderstood),
        ("no, the blue one", NotUnderstood),
        ("pick up the red cup, no wait", NotUnderstood),
        ("go there", Ambiguous),
        ("repeat forever turn left", NotUnderstood),
    ],
)
def test_what_it_cannot_do_or_know_is_refused(
    does: Does, text: str, error: type[PlanningError]
) -> None:
    with pytest.raises(error):
        does(text)


@pytest.mark.parametrize(
    "said",
    [
        "hand me the cup",
        "I'll take that cup off you now",
        "let go of what you are holding",
        "let me take it",
    ],
)
def test_what_is_held_is_handed_over(does: Does, said: str) -> None:
    assert does(said, holding={"left": "cup"}) == "hand_over"


@pytest.mark.parametrize(
    "said",
    ["pass the bottle over to your right hand", "swap it from your left hand to your right",
     "move the bottle into your other hand"],
)  # fmt: skip
def test_a_thing_changes_hands_by_being_put_down(does: Does, said: str) -> None:
    told = does(said, holding={"left": "bottle", "right": None})
    assert told.startswith("place coffee_table on") and told.endswith("right")


def test_of_two_things_the_hand_with_the_one_meant_gives(does: Does) -> None:
    holding = {"left": "cup", "right": "bottle"}
    assert does("hand me the bottle", holding=holding) == "hand_over right"


@pytest.mark.parametrize("said", ["hand me the ball", "give me another cup", "give me both cups"])
def test_what_is_not_held_is_brought(does: Does, said: str) -> None:
    assert "hand_over" not in does(said, holding={"left": "cup"})


@pytest.mark.parametrize(
    "said",
    [
        "you can let go of the idea",
        "I can take the ball",
        "let go of the ball",
    ],
)
def test_what_is_not_in_a_hand_is_not_let_go(does: Does, said: str) -> None:
    with pytest.raises(PlanningError):
        does(said, holding={"left": "cup"})


def test_what_is_taken_before_is_not_what_is_held(does: Does) -> None:
    told = does("pick up the ball and give it to me", holding={"left": "cup"})
    assert told.startswith("pick_up ball")


def test_in_a_longer_command_letting_go_is_putting_down(does: Does) -> None:
    told = does("let go of that and then drive over to the kitchen", holding={"left": "cup"})
    assert told.startswith("place coffee_table on")


def test_what_is_held_is_put_down_and_never_dropped(does: Does) -> None:
    holding = {"left": "cup"}
    assert does("put it down", holding=holding) == "place coffee_table on"
    assert does("drop it", holding=holding) == "place coffee_table on"
    assert does("free your left hand", holding=holding) == "place left coffee_table on"
    assert does("leave what you are holding here", holding=holding) == "place coffee_table on"
    assert does("put what you are holding into the box", holding=holding) == BOX
    assert does("put everything down", holding=holding) == "place coffee_table on"
    with pytest.raises(PlanInvalid, match="no hand holds the green ball"):
        does("put the ball down", holding=holding)
    assert does("what do you have in your hands", holding=holding) == (
        "speak I hold a cup in my left hand."
    )
    with pytest.raises(PlanInvalid, match="would drop what is held"):
        does("open your left hand", holding=holding)


@pytest.mark.parametrize("held", ["cup", "object"])
def test_with_one_hand_full_it_is_what_the_command_speaks_of(does: Does, held: str) -> None:
    assert does("pick up the green ball and put it in the box", holding={"right": held}) == (
        "pick_up green ball left; place box in left"
    )
    assert does("put it in the box", holding={"right": held}) == "place box in"


@pytest.mark.parametrize("kinds", [("cup", "ball"), ("object", "object")], ids=" and ".join)
def test_with_two_full_hands_the_one_that_is_meant_is_emptied(
    does: Does, kinds: tuple[str, str]
) -> None:
    holding = dict(zip(("left", "right"), kinds, strict=True))
    assert does("put down what is in your left hand", holding=holding) == (
        "place coffee_table on left"
    )
    assert does("put the thing in your right hand down", holding=holding) == (
        "place coffee_table on right"
    )
    for both in ("put everything down", "put down both", "put them down"):
        assert does(both, holding=holding) == "place coffee_table on left; place coffee_table on"
    with pytest.raises(Ambiguous, match=f"the {kinds[0]} in my left hand or the {kinds[1]} in my"):
        does("put it down", holding=holding)
    assert does("what is in your left hand", holding=holding) == (
        f"speak I hold {_a(kinds[0])} in my left hand and {_a(kinds[1])} in my right hand."
    )


def _a(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


def test_go_back_leads_to_where_the_robot_was_before(does: Does) -> None:
    talk = Conversation().after(Turn(said="go to the kitchen", here=(1.0, 2.0, 0.0)))
    assert does("go back", conversation=talk) == "navigate_to 1.0 2.0 0.0"


def test_half_a_turn_is_no_more_than_half_a_turn_when_rounded(does: Does) -> None:
    assert "3.141" in does("bring me the ball", here=(2.2, 2.05, 3.14159))


def test_an_area_is_driven_over_in_rows(flat: "Flat") -> None:
    steps = flat.plan("sweep the living room floor").actions
    points = [(one.parameters["x_m"], one.parameters["y_m"]) for one in steps]
    assert points[:3] == [(1.8, 1.5), (3.8, 1.5), (3.8, 2.0)]
    assert len(points) == 10


def test_what_is_urgent_ranks_before_what_is_not(flat: "Flat") -> None:
    assert {one.priority.value for one in flat.plan("tidy up").actions} == {"low"}
    assert flat.plan("stop and go to the kitchen").actions[0].priority.value == "high"
    assert flat.plan("go to the kitchen").summary == "navigation: navigate to the kitchen"


@pytest.mark.parametrize(
    "text",
    [
        "please don't move",
        "hold it",
        "no, no, stop!",
        "please quit looking for the cup",
    ],
)
def test_ways_to_say_stop(text: str) -> None:
    assert is_stop(text)


@pytest.mark.parametrize(
    "text",
    [
        "no, never mind",
        "again",
        "stop nothing",
    ],
)
def test_what_is_no_stop(text: str) -> None:
    assert not is_stop(text)


VOCABULARY = (
    "go to the kitchen pick up red cup and then put it in box left one other turn right 5 metres "
    "bring me them table look find keys where is all both on say hello tidy closer a my not there "
    "here down away drop slowly no wait mean from at 0.2 m/s 50 cm second hold your hand open what "
    "you see are holding how many hands patrol little back come , . everything cup_1 nearest"
)
WORDS = st.sampled_from(sorted(set(VOCABULARY.split())))
SENTENCES = st.one_of(st.text(max_size=80), st.lists(WORDS, max_size=14).map(" ".join))


@settings(max_examples=150, deadline=None)
@given(SENTENCES)
def test_any_words_are_refused_by_name_or_make_a_valid_plan(flat: "Flat", text: str) -> None:
    flat.refuses_or_plans(text)


def test_a_side_said_last_is_no_courtesy(flat: "Flat") -> None:
    with pytest.raises(NotUnderstood):
        flat.plan("turn left and right")
