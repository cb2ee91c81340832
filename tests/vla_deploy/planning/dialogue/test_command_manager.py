"""Commands queue, a stop overtakes, questions wait for their answer: all seen from the topics."""

import pytest

from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.errors import Ambiguous, Declined
from vla_deploy.planning.understanding import Candidate

GO = ("navigate_to", {"place": "kitchen"})
PICK = ("pick_up", {"object": "red cup"})
RED = Candidate(name="cup_1", words="the red one", features=frozenset({"red"}))
BLUE = Candidate(name="cup_2", words="the blue one", features=frozenset({"blue"}))
WHICH = Ambiguous("Which cup, the red one or the blue one?", (RED, BLUE), "cup")


def events(told: list[dict]) -> list[tuple[str, str]]:
    return [(one["command_id"], one["event"]) for one in told]


def test_a_step_does_not_wait_for_a_slow_plan_and_commands_keep_their_order(
    open_desk, later, back_end, propose
):
    desk = open_desk(back_end("model", propose(GO), Declined("no idea")), executor=later)
    desk.give(text="sing one")
    desk.give(text="sing two")
    assert events(desk.answers_to("go to the kitchen")) == [("c1", "planning")]
    assert desk.status()["commands"] == ["c1", "c2", "c3"]
    later.do_one()
    assert events(desk.answers()) == [("c1", "accepted"), ("c1", "plan"), ("c2", "planning")]
    later.do_one()
    assert events(desk.answers()) == [("c2", "rejected"), ("c3", "queued")]
    desk.ends("c1")
    assert events(desk.answers()) == [("c1", "finished"), ("c3", "accepted"), ("c3", "plan")]


def test_a_command_that_comes_while_another_is_planned_is_told_that_it_waits(
    open_desk, later, back_end, propose
):
    desk = open_desk(back_end("model", propose(GO)), executor=later)
    desk.answers_to("sing one")
    assert events(desk.answers_to("go to the kitchen")) == [("c2", "queued")]


def test_a_stop_overtakes_all_that_is_planned_and_waits(open_desk, later, back_end, propose):
    model = back_end("model", propose(GO))
    desk = open_desk(model, executor=later)
    desk.give(text="sing one")
    desk.answers_to("go to the kitchen")
    assert events(desk.answers_to("stop")) == [("c1", "rejected"), ("c2", "rejected")]
    assert desk.plans() == [{"command_id": "c3", "cancel": True}]
    later.do_one()
    assert desk.answers() == []
    assert desk.plans() == []
    assert model.asked == [], "its deadline was called in"


def test_to_forbid_something_ends_what_is_planned(open_desk, later, back_end, propose):
    desk = open_desk(back_end("model", propose(GO)), executor=later)
    desk.answers_to("sing one")
    told = desk.answers_to("stay out of the kitchen")
    assert events(told) == [("c1", "rejected"), ("c2", "accepted"), ("c2", "plan")]
    later.do_one()
    assert desk.answers() == []
    (refused,) = desk.answers_to("go to the kitchen")
    assert "you told me not to go into the kitchen" in refused["reason"]


def test_too_many_commands_are_refused_at_once(open_desk, later, back_end, propose):
    desk = open_desk(back_end("model", propose(GO)), executor=later)
    for number in range(10):
        desk.give(command_id=f"c{number}", text=f"sing {number}")
    refused = [one for one in desk.answers() if one["event"] == "rejected"]
    assert [one["command_id"] for one in refused] == ["c8", "c9"]
    assert refused[0]["reason"] == Says.MANY_WAIT


def test_a_rung_that_breaks_ends_its_command_and_no_other(open_desk, back_end, propose):
    desk = open_desk(back_end("model", RuntimeError("out of memory"), propose(GO)))
    desk.give(text="sing one")
    told = desk.answers_to("sing two")
    assert events(told)[1:3] == [("c1", "rejected"), ("c2", "planning")]
    assert told[1]["reason"] == "the planner failed: RuntimeError"
    assert events(told)[-1] == ("c2", "plan")
    assert desk.status()["failed"] == 1


def test_a_fault_of_what_plans_at_once_ends_its_command_and_not_the_planner(open_desk):
    def check(plan, request):
        raise ZeroDivisionError(request.text)

    desk = open_desk(check=check)
    desk.give(text="go to the kitchen")
    told = desk.answers_to("sing")
    assert events(told) == [("c1", "rejected"), ("c2", "rejected")]
    assert told[0]["reason"] == "the planner failed: ZeroDivisionError"


class TestObjecting:
    @pytest.mark.parametrize(
        "said",
        ["no!", "don't pick it up", "Don\u2019t touch the cups", "leave it", "stop this"],
    )
    def test_what_objects_to_what_is_under_way_ends_it(self, desk, said):
        desk.sees("red cup_1")
        desk.plans_for("pick up the red cup", source="voice")
        assert desk.plans_for(said, source="voice") == [{"command_id": "c2", "cancel": True}]
        assert desk.said_aloud() == [Says.LEFT]

    @pytest.mark.parametrize(
        "said",
        ["no, the banana", "Wrong, somewhere", "no! go home", "don't go there, look left"],
    )
    def test_what_is_to_be_done_instead_is_a_command_of_its_own(self, desk, said):
        desk.sees("red cup_1")
        desk.plans_for("pick up the red cup")
        assert events(desk.answers_to(said))[-1][0] == "c2"
        assert desk.plans()[0] == {"command_id": "c2-objects", "cancel": True}

    @pytest.mark.parametrize("said", ["don't worry", "don't stop", "don't drop it"])
    def test_an_idiom_ends_nothing(self, desk, said):
        desk.plans_for("go to the kitchen")
        assert desk.plans_for(said) == []

    def test_a_plan_that_begins_with_standing_still_ends_what_is_under_way(
        self, open_desk, back_end, propose
    ):
        halt = propose(("stop", {}), is_unsure=True)
        desk = open_desk(back_end("model", halt))
        desk.plans_for("go to the kitchen")
        assert events(desk.answers_to("oh my word, make it halt somehow"))[-1] == ("c2", "asked")
        assert desk.plans() == [{"command_id": "c2-stops", "cancel": True}]

    def test_it_overtakes_what_is_planned(self, open_desk, later, back_end, propose):
        desk = open_desk(back_end("model", propose(GO)), executor=later)
        desk.answers_to("sing one")
        assert events(desk.answers_to("don't do that")) == [("c1", "rejected")]
        later.do_one()
        desk.answers()
        assert desk.plans() == [{"command_id": "c2", "cancel": True}]

    @pytest.mark.parametrize("said", ["don't!", "don't touch the red cup", "no, the banana"])
    def test_a_plan_of_a_planner_that_has_ended_ends_too(self, desk, said):
        desk.executor_is("executing")
        assert "cancel" in desk.plans_for(said)[0]

    def test_a_no_is_for_what_moves_too_and_not_for_what_is_held_alone(self, desk):
        desk.sees("red cup_1")
        desk.answers_to("when I say so, pick up the red cup")
        desk.plans_for("go to the kitchen")
        assert events(desk.answers_to("no!")) == [("c1", "rejected")]
        assert desk.plans() == [{"command_id": "c3", "cancel": True}]

    def test_it_drops_what_is_held_but_a_wait_does_not(self, desk):
        desk.sees("red cup_1")
        desk.answers_to("when I say so, pick up the red cup")
        assert events(desk.answers_to("wait"))[-1] == ("c2", "plan")
        desk.executor_tells(command_id="c2", event="finished", success=True, error=None)
        desk.answers()
        assert desk.status()["question"] is not None
        assert events(desk.answers_to("don't pick it up")) == [("c1", "rejected")]
        assert desk.status()["question"] is None


class TestQuestions:
    @pytest.fixture
    def model(self, back_end, propose):
        return back_end("model", WHICH, propose(PICK))

    @pytest.fixture
    def desk(self, open_desk, model):
        desk = open_desk(model)
        desk.answers_to("hand it over")
        return desk

    def test_what_is_unclear_is_asked_and_left_if_nobody_answers(self, open_desk, model):
        desk = open_desk(model)
        planning, asked = desk.answers_to("hand it over")
        assert (planning["event"], asked["event"]) == ("planning", "asked")
        assert asked["question"] == "Which cup, the red one or the blue one?"
        assert asked["choices"] == ["the red one", "the blue one"]
        assert desk.plans() == []
        assert desk.status()["question"] == asked["question"]
        desk.clock.pass_s(asked["answer_within_s"] - 0.6)
        assert desk.answers() == []
        desk.clock.pass_s(0.2)
        (left,) = desk.answers()
        assert (left["command_id"], left["reason"]) == ("c1", Says.NO_ANSWER)

    def test_the_answer_is_the_next_utterance(self, desk, model):
        told = desk.answers_to("the red one, please")
        assert events(told) == [
            ("c2", "answered"), ("c1", "planning"), ("c1", "accepted"), ("c1", "plan"),
        ]  # fmt: skip
        assert told[0]["of"] == "c1"
        assert model.asked[1].text == "hand it over"
        assert dict(model.asked[1].conversation.choices) == {"cup": "cup_1"}
        assert desk.plans()[0]["command_id"] == "c1"

    @pytest.mark.parametrize("no", ["never mind", "cancel", "no"])
    def test_no_leaves_it_and_stops_nothing_else(self, desk, no):
        told = desk.answers_to(no)
        assert events(told) == [("c2", "answered"), ("c1", "rejected")]
        assert told[1]["reason"] == Says.LEFT
        assert desk.plans() == []

    def test_stop_ends_everything_also_while_a_question_waits(self, desk):
        assert events(desk.answers_to("stop")) == [("c1", "rejected")]
        assert desk.plans() == [{"command_id": "c2", "cancel": True}]

    def test_another_command_takes_the_place_of_the_question(self, desk):
        told = desk.answers_to("go to the kitchen")
        assert events(told) == [("c1", "rejected"), ("c2", "accepted"), ("c2", "plan")]
        assert told[0]["reason"] == Says.REPLACED

    def test_an_answer_that_picks_none_is_asked_again_but_not_for_ever(self, desk):
        for number in (2, 3):
            told = desk.answers_to("the red one or the blue one, who knows")
            assert events(told) == [(f"c{number}", "answered"), ("c1", "asked")]
            assert told[1]["question"].startswith("Sorry, I did not get that. Which cup")
        told = desk.answers_to("that one")
        assert (told[1]["event"], told[1]["reason"]) == ("rejected", Says.STILL_UNCLEAR)

    def test_what_is_meant_as_an_answer_only_is_never_a_command(self, desk):
        (told,) = desk.answers_to("go to the kitchen", answer=True)
        assert (told["command_id"], told["event"]) == ("c2", "rejected")
        assert told["reason"].startswith("that does not answer: Which cup")
        desk.answers_to("no", answer=True)
        (told,) = desk.answers_to("yes", answer=True)
        assert (told["command_id"], told["reason"]) == ("c4", Says.NOTHING_ASKED)


class TestWaitingForAWord:
    COMMAND = "when I say so, pick up the red cup"

    @pytest.fixture
    def desk(self, open_desk):
        desk = open_desk()
        desk.sees("red cup_1")
        desk.answers_to(self.COMMAND)
        return desk

    def test_the_plan_is_read_back_and_held(self, open_desk):
        desk = open_desk()
        desk.sees("red cup_1")
        (asked,) = desk.answers_to(self.COMMAND)
        assert asked["question"] == "Shall I pick up the red cup? I wait for you to say go."
        assert asked["plan"]["actions"][-1]["skill"] == "pick_up"
        assert asked["choices"] == ["go"]
        assert desk.plans() == []
        desk.clock.pass_s(600.0)
        assert desk.answers() == []
        assert desk.status()["question"] == asked["question"]
        assert desk.status()["commands"] == ["c1"]

    @pytest.mark.parametrize(
        ("word", "end"),
        [
            ("go", ("c1", "plan")),
            ("Yes, go!", ("c1", "plan")),
            ("now, please", ("c1", "plan")),
            ("not now", ("c1", "rejected")),
            ("never mind", ("c1", "rejected")),
            ("look left", ("c2", "plan")),
        ],
    )
    def test_a_word_begins_or_drops_it_and_anything_else_does_not(self, desk, word, end):
        assert events(desk.answers_to(word))[-1] == end
        is_held = desk.status()["question"] is not None
        assert is_held == (end[0] == "c2")

    @pytest.mark.parametrize(
        "said",
        [
            {"text": "yes"},
            {"text": "okay"},
            {"text": "That's right."},
            {"text": "go, but only when I say so"},
            {"text": "go", "heard": {"doubted": True, "ask_again": True}},
            {"text": "go", "heard": {"confidence": 0.8, "others": [{"text": "no", "odds": 0.4}]}},
        ],
    )
    def test_what_agrees_or_is_heard_badly_begins_nothing_and_drops_nothing(self, desk, said):
        (told,) = desk.answers_to(**said)
        assert (told["command_id"], told["reason"]) == ("c2", Says.STILL_HELD)
        assert desk.plans() == []
        assert events(desk.answers_to("go"))[-1] == ("c1", "plan")

    @pytest.mark.parametrize(
        ("command", "answer"),
        [
            ({"text": "pick up the cup"}, "the red one, but only when I say so"),
            (
                {"text": "pick up the red cup", "heard": {"confidence": 0.4}},
                "yes, not before I call",
            ),
        ],
    )
    def test_an_answer_may_say_that_it_waits(self, open_desk, command, answer):
        desk = open_desk()
        desk.sees("red cup_1", "blue cup_2")
        desk.answers_to(**command)
        answered, asked = desk.answers_to(answer)
        assert (answered["event"], asked["event"]) == ("answered", "asked")
        assert asked["question"].endswith("I wait for you to say go.")
        assert desk.plans() == []
        assert events(desk.answers_to("go"))[-1] == ("c1", "plan")

    def test_a_correction_changes_what_is_held_and_ends_nothing(self, desk):
        desk.sees("red cup_1", "blue cup_2")
        desk.give(text="look left")
        desk.plans_for(self.COMMAND)
        told = desk.answers_to("no, the blue one")
        assert events(told) == [("c4", "answered"), ("c3", "asked")]
        assert told[1]["question"] == "Shall I pick up the blue cup? I wait for you to say go."
        assert desk.plans() == []

    def test_what_no_hand_is_free_for_meanwhile_is_refused(self, desk):
        desk.executor_is("idle", left="ball", right="book")
        told = desk.answers_to("go")
        assert events(told) == [("c2", "answered"), ("c1", "rejected")]
        assert "no hand is free" in told[-1]["reason"]
        assert desk.plans() == []

    def test_another_takes_its_place_and_none_waits_for_ever(self, desk):
        told = desk.answers_to("look left when I call")
        assert events(told) == [("c1", "rejected"), ("c2", "asked")]
        desk.clock.pass_s(3601.0)
        (left,) = desk.answers()
        assert (left["command_id"], left["reason"]) == ("c2", Says.NO_ANSWER)


class TestReadingBack:
    @pytest.fixture
    def desk(self, open_desk, back_end, propose):
        go = propose(GO, is_unsure=True)
        return open_desk(back_end("model", go))

    def test_an_unsure_plan_is_read_back_before_anything_moves(self, desk):
        asked = desk.answers_to("kitchen, like, you know")[-1]
        assert (asked["event"], asked["question"]) == ("asked", "Shall I go to the kitchen?")
        assert asked["plan"]["actions"][0]["skill"] == "navigate_to"
        assert desk.plans() == []
        told = desk.answers_to("yes please")
        assert events(told) == [("c2", "answered"), ("c1", "accepted"), ("c1", "plan")]
        assert len(desk.plans()) == 1

    def test_a_correction_changes_the_command_that_was_read_back(
        self, open_desk, back_end, propose
    ):
        blue = propose(("pick_up", {"object": "blue cup"}), ("speak", {"text": "Here is it."}))
        model = back_end("model", propose(PICK, is_unsure=True), blue)
        desk = open_desk(model)
        desk.sees("red cup_1", "blue cup_2")
        assert desk.answers_to("cup, like, you know")[-1]["event"] == "asked"
        told = desk.answers_to("no, the blue one")
        assert events(told) == [("c2", "answered"), ("c1", "planning"), ("c1", "asked")]
        assert told[-1]["question"] == 'Shall I pick up the blue cup and say "Here is it"?'
        assert model.asked[-1].text == "the blue cup, like, you know"
        assert events(desk.answers_to("yes"))[1:] == [("c1", "accepted"), ("c1", "plan")]

    @pytest.mark.parametrize(
        ("said", "question"),
        [
            ("no, the blue one", "Shall I pick up the blue cup?"),
            ("I mean the ball", "Shall I pick up the ball? The green ball may weigh 0.5 kg."),
            ("the other one", "Shall I pick up the blue cup?"),
        ],
    )
    def test_a_correction_ends_what_has_begun_and_is_read_back(self, open_desk, said, question):
        desk = open_desk()
        desk.sees("red cup_1", "blue cup_2", "green ball_1")
        desk.plans_for("pick up the red cup")
        (asked,) = desk.answers_to(said)
        assert (asked["event"], asked["question"]) == ("asked", question)
        assert desk.plans() == [{"command_id": "c2-objects", "cancel": True}]
        assert events(desk.answers_to("yes"))[-1] == ("c2", "plan")

    def test_a_correction_of_what_was_not_done_is_a_command_of_its_own(self, open_desk):
        desk = open_desk()
        desk.sees("red cup_1", "blue cup_2")
        desk.answers_to("go to narnia")
        assert events(desk.answers_to("no, the blue cup")) == [("c2", "rejected")]

    def test_a_robot_that_was_disarmed_meanwhile_does_not_move(self, desk):
        desk.answers_to("kitchen, like, you know")
        desk.control("disarmed")
        refused = desk.answers_to("yes")[-1]
        assert refused["event"] == "rejected"
        assert "vla-deploy arm" in refused["reason"]
        assert desk.plans() == []


class TestAQuestionOfAModel:
    @pytest.fixture
    def model(self, back_end, propose):
        return back_end("model", Ambiguous("Where shall I put it?"), propose(GO))

    @pytest.fixture
    def desk(self, open_desk, model):
        desk = open_desk(model)
        desk.answers_to("clear away that thing")
        return desk

    def test_any_words_may_answer_it(self, desk, model):
        assert events(desk.answers_to("somewhere warm"))[-1] == ("c1", "plan")
        assert model.asked[1].text == "clear away that thing: somewhere warm"

    def test_but_a_command_is_a_command(self, desk, model):
        assert events(desk.answers_to("go to the kitchen"))[0] == ("c1", "rejected")
        assert len(model.asked) == 1


class TestSpokenCommands:
    def test_what_was_typed_is_not_answered_aloud(self, desk):
        desk.answers_to("sing a sea shanty")
        assert desk.said_aloud() == []

    def test_a_refusal_is_told_aloud_in_a_sentence(self, desk):
        desk.give(text="sing a sea shanty", source="voice")
        desk.answers_to("go to narnia", source="voice")
        first, second = desk.said_aloud()
        assert first == Says.NOT_UNDERSTOOD
        assert second == 'Sorry, I cannot do that: I do not know the place "narnia".'

    def test_a_question_is_asked_aloud_and_no_is_acknowledged(self, open_desk, back_end):
        desk = open_desk(back_end("model", WHICH))
        desk.answers_to("hand it over", source="voice")
        desk.answers_to("no", source="voice")
        assert desk.said_aloud() == [str(WHICH), Says.LEFT]

    def test_a_long_wait_is_announced_once(self, open_desk, later, back_end, propose):
        desk = open_desk(back_end("model", propose(GO)), executor=later)
        desk.answers_to("sing one", source="voice")
        assert desk.said_aloud() == []
        for _ in range(3):
            desk.clock.pass_s(1.0)
            desk.answers()
        assert desk.said_aloud() == [Says.WORKING]

    @pytest.mark.parametrize(
        ("end", "said"),
        [
            ({"success": True, "error": None}, [Says.DONE]),
            ({"success": False, "error": "no way; try again"},
             ["Sorry, that did not work: no way."]),
        ],
    )  # fmt: skip
    def test_the_end_is_told_aloud(self, desk, end, said):
        desk.answers_to("go to the kitchen", source="voice")
        desk.executor_tells(command_id="c1", event="finished", **end)
        desk.answers()
        assert desk.said_aloud() == said

    def test_whoever_says_stop_is_not_told_that_it_failed(self, desk):
        desk.give(text="go to the kitchen", source="voice")
        desk.answers_to("stop", source="voice")
        desk.executor_tells(command_id="c1", event="finished", success=False, error="cancelled")
        desk.answers()
        assert desk.said_aloud() == []


class TestRepeating:
    @pytest.fixture
    def desk(self, open_desk):
        desk = open_desk()
        desk.plans_for("turn left")
        return desk

    def test_again_does_what_was_done(self, desk):
        desk.executor_tells(command_id="c1", event="finished", success=True)
        assert events(desk.answers_to("again"))[-1] == ("c2", "plan")
        assert desk.plans()[-1]["plan"]["goal"] == "turn left"

    def test_after_a_stop_nothing_is_done_again(self, desk):
        desk.executor_tells(command_id="c1", event="finished", success=True)
        desk.plans_for("stop")
        for number, text in enumerate(("again", "once more", "the same")):
            desk.give(command_id=f"d{number}", text=text)
        told = desk.answers()
        assert events(told) == [("d0", "rejected"), ("d1", "rejected"), ("d2", "rejected")]
        assert told[0]["reason"].startswith("nothing was done before that I could repeat")
        assert desk.plans() == []

    @pytest.mark.parametrize(
        "ended",
        [
            {"event": "finished", "success": False, "error": "the bumper was pressed"},
            {"event": "rejected", "reason": "not armed"},
        ],
    )
    def test_what_the_executor_could_not_or_would_not_do_is_not_done_again(self, desk, ended):
        desk.executor_tells(command_id="c1", **ended)
        desk.answers()
        told = desk.answers_to("again")
        assert told[-1]["event"] == "rejected"
        assert told[-1]["reason"].startswith("nothing was done before that I could repeat")
        assert desk.plans() == []


class TestTurns:
    """The coffee table has a red cup; the robot goes to the kitchen by c1."""

    @pytest.fixture
    def busy(self, desk):
        desk.sees("red cup_1")
        desk.plans_for("go to the kitchen", source="voice")
        desk.said_aloud()
        return desk

    def test_what_would_disturb_waits_in_its_order_and_is_planned_as_the_world_is_then(self, busy):
        told = busy.answers_to("pick up the cup", source="voice")
        assert (events(told), told[0]["place"]) == ([("c2", "queued")], 1)
        assert busy.said_aloud() == [Says.AFTERWARDS]
        assert busy.answers_to("go to the bedroom")[-1]["place"] == 2
        assert busy.status()["commands"] == ["c2", "c3"]
        busy.executor_is("idle", left="ball", right="book")
        busy.ends("c1")
        told = busy.answers()
        assert events(told)[1:] == [("c2", "rejected"), ("c3", "accepted"), ("c3", "plan")]
        assert "no hand is free" in told[1]["reason"]

    def test_what_only_speaks_is_answered_at_once(self, busy):
        assert events(busy.answers_to("what do you see"))[-1] == ("c2", "plan")

    @pytest.mark.parametrize("text", ["sing a song", "go to the moon", "bring me the unicorn"])
    def test_what_will_never_be_possible_is_refused_at_once(self, busy, text):
        assert events(busy.answers_to(text)) == [("c2", "rejected")]

    def test_a_stop_ends_what_waits_too(self, busy):
        busy.answers_to("pick up the cup")
        assert busy.plans_for("stop") == [{"command_id": "c3", "cancel": True}]
        busy.ends("c1")
        assert busy.plans_for("hello")[0]["command_id"] == "c4"

    def test_what_was_agreed_to_meanwhile_waits_without_being_asked_again(self, busy):
        busy.ends("c1")
        assert events(busy.answers_to("drive backwards 1.05 m"))[-1] == ("c2", "asked")
        busy.executor_is("executing")
        assert events(busy.answers_to("yes")) == [("c3", "answered"), ("c2", "queued")]
        busy.executor_is("idle")
        assert events(busy.answers()) == [("c2", "accepted"), ("c2", "plan")]

    def test_a_command_of_which_the_executor_knows_nothing_holds_nobody_up(self, busy):
        busy.answers_to("pick up the cup")
        told = []
        for _ in range(8):
            busy.executor_is("idle")
            busy.control("armed")
            told += busy.answers()
            busy.clock.pass_s(0.5)
        assert events(told) == [("c1", "finished"), ("c2", "accepted"), ("c2", "plan")]
        assert "does not know of it any more" in told[0]["error"]

    def test_while_another_plan_goes_on_nobody_knows_what_it_uses(self, desk):
        desk.executor_is("executing")
        assert events(desk.answers_to("go to the kitchen")) == [("c1", "queued")]
        desk.executor_is("idle")
        assert events(desk.answers()) == [("c1", "accepted"), ("c1", "plan")]

    @pytest.mark.parametrize("text", ["wait", "Hold on a second!", "pause, please", "hang on"])
    def test_a_pause_and_its_end_are_for_the_executor(self, busy, text):
        assert busy.plans_for(text, source="voice") == [{"command_id": "c2", "pause": True}]
        busy.executor_is("paused")
        assert busy.plans_for("go on", source="voice") == [{"command_id": "c3", "pause": False}]
        assert busy.said_aloud() == [Says.PAUSED, Says.GOES_ON]

    def test_words_for_a_pause_mean_a_while_where_nothing_goes_on(self, desk):
        assert desk.plans_for("wait 5 seconds")[0]["plan"]["actions"][0]["skill"] == "wait"

    def test_one_that_comes_while_others_wait_for_nothing_any_more_holds_nobody_up(self, busy):
        busy.answers_to("pick up the cup")
        busy.carried_out = ["c1"]
        busy.executor_is("executing")
        busy.ends("c1")
        busy.answers()  # the executor's status still names it
        busy.executor_is("idle")
        busy.give(text="go to the bedroom")
        told = busy.answers() + busy.answers()
        assert ("c2", "plan") in events(told)
        busy.ends("c2")
        assert ("c3", "plan") in events(busy.answers() + busy.answers())
