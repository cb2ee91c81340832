"""Words that make no sense are tried as what may have been said instead, and read back."""

import pytest

from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.errors import Declined

KITTENS = [(f"go to the kitten {number}", 0.5) for number in range(60)]


def spoken(text, *others, confidence=0.8, **heard):
    told = [{"text": other, "odds": odds} for other, odds in others]
    heard |= {"confidence": confidence, "others": told}
    return {"text": text, "source": "voice", "heard": heard}


def events(desk, *words, **heard):
    told = desk.answers_to(**spoken(*words, **heard))
    return [(one["event"], one.get("question", one.get("reason", ""))) for one in told]


def place_of(plan):
    return plan["plan"]["actions"][0]["parameters"]["place"]


@pytest.mark.parametrize(
    ("words", "heard"),
    [
        (("go to the chicken", ("go to the kitten", 0.6), ("go to the kitchen", 0.5)), {}),
        (("go to the kitchen", ("don't go to the kitchen", 0.6)), {}),
        (("go to the kitchen",), {"confidence": 0.3, "doubted": True, "ask_again": True}),
        (("go to the kitchen",), {"confidence": 0.72, "doubted": True}),
    ],
    ids=["another reading makes sense", "maybe a don't", "doubted", "doubted, for a lax profile"],
)
def test_what_may_have_been_said_is_read_back_and_done_after_a_yes(desk, words, heard):
    ((event, question),) = events(desk, *words, **heard)
    assert event == "asked"
    assert question.startswith("Shall I go to the kitchen?")
    assert desk.plans() == [], "nothing moves before the person agrees"
    (plan,) = desk.plans_for("yes", source="voice")
    assert (plan["command_id"], place_of(plan)) == ("c1", "kitchen")


@pytest.mark.parametrize(
    ("text", "other", "asks"),
    [
        ("turn left 19 degrees", "turn left 90 degrees", True),
        ("turn left ninety degrees", "turn left nineteen degrees", True),
        ("turn left", "turn left twenty degrees", True),
        ("turn left ninety degrees", "turn left 90 degrees", False),
        ("turn left ninety degrees", "turn left mighty degrees", False),
        ("go to the kitchen", "go to the kitchen one", False),
    ],
)
def test_a_number_that_may_have_been_another_one_is_read_back(desk, text, other, asks):
    told = events(desk, text, (other, 0.05), confidence=0.99)
    assert ("asked" in [event for event, _ in told]) is asks
    assert (desk.plans() == []) is asks
    assert len(desk.plans_for("yes", source="voice")) == int(asks)


@pytest.mark.parametrize(
    ("confidence", "odds", "asks"), [(0.65, 0.4, True), (0.65, 0.1, False), (0.9, 0.4, False)]
)
def test_unsure_words_that_may_well_have_been_others_are_read_back(desk, confidence, odds, asks):
    desk.sees("red cup")
    told = events(desk, "find the red can", ("find the red cup", odds), confidence=confidence)
    assert told[-1][0] == ("asked" if asks else "plan")
    assert (desk.plans() == []) is asks


def test_where_nothing_makes_sense_the_first_reading_is_refused(open_desk):
    ((event, reason),) = events(open_desk(), "go to the chicken", ("go to the kitten", 0.6))
    assert event == "rejected"
    assert "chicken" in reason


def test_words_that_make_sense_are_not_replaced(open_desk):
    (plan,) = open_desk().plans_for(**spoken("go to the bedroom", ("go to the kitchen", 0.9)))
    assert place_of(plan) == "bedroom"


def test_a_model_is_asked_of_the_words_before_other_words_are_tried(open_desk, back_end, propose):
    desk = open_desk(back_end("model", propose(("navigate_to", {"place": "kitchen"}))))
    (plan,) = desk.plans_for(**spoken("go where one cooks", ("go to the bedroom", 0.9)))
    assert place_of(plan) == "kitchen"


def test_a_breath_within_a_command_does_not_spoil_it(open_desk):
    (plan,) = open_desk().plans_for(**spoken("go to, the kitchen"))
    assert place_of(plan) == "kitchen"


@pytest.mark.parametrize(("ask_again", "said"), [(True, [Says.HEARD_BADLY.value]), (False, [])])
def test_doubted_words_without_sense_are_asked_for_again_where_that_is_welcome(
    desk, ask_again, said
):
    told = events(desk, "so to the weather", confidence=0.3, doubted=True, ask_again=ask_again)
    assert [event for event, _ in told] == ["rejected"]
    assert desk.said_aloud() == said


def test_doubted_words_answer_no_question(desk):
    doubt = {"confidence": 0.3, "doubted": True}
    events(desk, "go to the kitchen", **doubt)
    assert [event for event, _ in events(desk, "yes", **doubt)] == ["rejected"]
    assert desk.plans() == []
    assert [plan["command_id"] for plan in desk.plans_for(**spoken("yes"))] == ["c1"]


@pytest.mark.parametrize(
    "others", ["kitchen", [1, {"text": 5, "odds": 1}, {"text": "x"}, {"odds": 1}], None]
)
def test_what_is_told_of_other_readings_is_not_trusted(open_desk, others):
    heard = {"confidence": 0.9, "others": others}
    told = open_desk().answers_to("go to the chicken", source="voice", heard=heard)
    assert [one["event"] for one in told] == ["rejected"]


def test_what_was_typed_is_taken_as_it_is(open_desk):
    told = open_desk().answers_to("go to the, kitten", source="cli")
    assert [one["event"] for one in told] == ["rejected"]


@pytest.mark.parametrize(
    ("words", "takes_s", "event", "most_asked"),
    [
        (("Go to the chicken.", ("Go to the kitchen.", 0.6)), 0.0, "asked", 1),
        (("go to the chicken", *KITTENS[:8]), 0.7, "rejected", 3),
        (("go to the chicken", *KITTENS), 0.0, "rejected", 9),
    ],
    ids=["its full stop is no other reading", "for a second", "of the likeliest"],
)
def test_models_are_asked_of_a_few_other_readings(
    open_desk, back_end, words, takes_s, event, most_asked
):
    model = back_end("model", *[Declined("no idea")] * 99, takes_s=takes_s)
    assert events(open_desk(model), *words)[-1][0] == event
    assert len(model.asked) == most_asked
