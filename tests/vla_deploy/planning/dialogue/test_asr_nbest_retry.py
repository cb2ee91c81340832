"""Words that make no sense are tried as what may have been said instead, and read back."""

import pytest

from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.errors import Declined

GO = ("navigate_to", {"place": "kitchen"})
SAYS_AGAIN = [Says.HEARD_BADLY.value]


def spoken(text, *others, confidence=0.8, **heard):
    told = [{"text": other, "odds": odds} for other, odds in others]
    return {
        "text": text,
        "source": "voice",
        "heard": {"confidence": confidence, "others": told, **heard},
    }


def events(told):
    return [(one["event"], one.get("question", one.get("reason", ""))) for one in told]


def test_the_reading_that_makes_sense_is_read_back_and_done_after_a_yes(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the chicken", ("go to the kitten", 0.6), ("go to the kitchen", 0.5)))
    ((event, question),) = events(desk.answers())
    assert event == "asked"
    assert question.startswith("Shall I go to the kitchen?")
    assert desk.plans() == [], "nothing moves before the person agrees"
    desk.give(command_id="c2", text="yes", source="voice")
    desk.answers()
    (plan,) = desk.plans()
    assert plan["command_id"] == "c1"


def test_a_dont_that_may_not_have_been_heard_is_asked_about(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the kitchen", ("don't go to the kitchen", 0.6)))
    ((event, question),) = events(desk.answers())
    assert event == "asked"
    assert question.startswith("Shall I go to the kitchen?")
    assert desk.plans() == []


def test_words_that_make_sense_are_not_replaced(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the bedroom", ("go to the kitchen", 0.9)))
    desk.answers()
    (plan,) = desk.plans()
    assert plan["plan"]["actions"][0]["parameters"]["place"] == "bedroom"


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
def test_a_number_that_may_have_been_another_one_is_read_back(open_desk, text, other, asks):
    desk = open_desk()
    desk.give(**spoken(text, (other, 0.05), confidence=0.99))
    assert ("asked" in [event for event, _ in events(desk.answers())]) is asks
    assert (desk.plans() == []) is asks
    desk.give(command_id="c2", text="yes", source="voice")
    desk.answers()
    assert len(desk.plans()) == int(asks)


def test_where_nothing_makes_sense_the_first_reading_is_refused(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the chicken", ("go to the kitten", 0.6)))
    ((event, reason),) = events(desk.answers())
    assert event == "rejected"
    assert "chicken" in reason


def test_a_model_is_asked_of_the_words_before_other_words_are_tried(open_desk, back_end, propose):
    model = back_end("model", propose(GO))
    desk = open_desk(model)
    desk.give(**spoken("go where one cooks", ("go to the bedroom", 0.9)))
    desk.answers()
    (plan,) = desk.plans()
    assert plan["plan"]["actions"][0]["parameters"]["place"] == "kitchen"


def test_after_models_that_have_no_plan_the_other_words_are_tried(open_desk, back_end, propose):
    desk = open_desk(back_end("model", Declined("no idea"), Declined("no idea")))
    desk.give(**spoken("go to the chicken", ("go to the kitchen", 0.5)))
    assert [event for event, _ in events(desk.answers())][-1] == "asked"


def test_doubted_words_are_read_back_even_where_they_make_sense(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the kitchen", confidence=0.3, doubted=True, ask_again=True))
    ((event, _),) = events(desk.answers())
    assert event == "asked"
    assert desk.plans() == []


@pytest.mark.parametrize(("ask_again", "said"), [(True, SAYS_AGAIN), (False, [])])
def test_doubted_words_without_sense_are_asked_for_again_where_that_is_welcome(
    open_desk, ask_again, said
):
    desk = open_desk()
    desk.give(**spoken("so to the weather", confidence=0.3, doubted=True, ask_again=ask_again))
    assert [event for event, _ in events(desk.answers())] == ["rejected"]
    assert desk.said_aloud() == said


def test_doubted_words_answer_no_question(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the kitchen", confidence=0.3, doubted=True))
    desk.answers()
    desk.give(command_id="c2", **spoken("yes", confidence=0.3, doubted=True))
    assert [event for event, _ in events(desk.answers())] == ["rejected"]
    assert desk.plans() == []
    desk.give(command_id="c3", **spoken("yes"))
    desk.answers()
    assert [plan["command_id"] for plan in desk.plans()] == ["c1"]


def test_what_is_told_of_other_readings_is_not_trusted(open_desk):
    desk = open_desk()
    for others in ("kitchen", [1, {"text": 5, "odds": 1}, {"text": "x"}, {"odds": 1}], None):
        heard = {"confidence": 0.9, "others": others}
        desk.give(text="go to the chicken", source="voice", heard=heard)
        assert [event for event, _ in events(desk.answers())] == ["rejected"]


def test_a_breath_within_a_command_does_not_spoil_it(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to, the kitchen"))
    assert "asked" not in [event for event, _ in events(desk.answers())]
    (plan,) = desk.plans()
    assert plan["plan"]["actions"][0]["parameters"]["place"] == "kitchen"


def test_what_was_typed_is_taken_as_it_is(open_desk):
    desk = open_desk()
    desk.give(text="go to the, kitten", source="cli")
    assert [event for event, _ in events(desk.answers())] == ["rejected"]


def test_a_planner_that_takes_long_is_not_asked_about_every_reading(open_desk, back_end):
    model = back_end("model", *[Declined("no idea")] * 9, takes_s=0.7)
    desk = open_desk(model)
    others = [(f"go to the kitten {number}", 0.5) for number in range(8)]
    desk.give(**spoken("go to the chicken", *others))
    assert [event for event, _ in events(desk.answers())][-1] == "rejected"
    assert len(model.asked) == 3, "of the words, and of others within a second"


def test_doubted_words_are_read_back_however_sure_the_profile_wants_them(open_desk):
    desk = open_desk()
    desk.give(**spoken("go to the kitchen", confidence=0.72, doubted=True))
    assert [event for event, _ in events(desk.answers())] == ["asked"]


def test_a_full_stop_is_no_other_reading(open_desk, back_end):
    model = back_end("model", *[Declined("no idea")] * 9)
    desk = open_desk(model)
    desk.give(**spoken("Go to the chicken.", ("Go to the kitchen.", 0.6)))
    assert [event for event, _ in events(desk.answers())][-1] == "asked"
    assert len(model.asked) == 1


def test_of_many_other_readings_only_the_likeliest_are_tried(open_desk, back_end):
    model = back_end("model", *[Declined("no idea")] * 99)
    desk = open_desk(model)
    desk.give(**spoken("go to the chicken", *[(f"go to kitten {n}", 0.5) for n in range(60)]))
    desk.answers()
    assert len(model.asked) <= 9


@pytest.mark.parametrize(
    ("confidence", "odds", "asks"), [(0.65, 0.4, True), (0.65, 0.1, False), (0.9, 0.4, False)]
)
def test_unsure_words_that_may_well_have_been_others_are_read_back(
    open_desk, confidence, odds, asks
):
    desk = open_desk()
    desk.sees("red cup")
    desk.give(**spoken("find the red can", ("find the red cup", odds), confidence=confidence))
    assert [event for event, _ in events(desk.answers())][-1] == ("asked" if asks else "plan")
    assert (desk.plans() == []) is asks
