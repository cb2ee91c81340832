"""Missions seen from the topics: order, what goes on side by side, times, restarts, the end."""

import json
from typing import Any

import pytest

from vla_deploy.planning.dialogue.phrasing import Says


def events(told: list[dict]) -> list[tuple[str, str]]:
    return [(one["command_id"], one["event"]) for one in told if one["event"] != "objective"]


class Flat:
    """Play the executor of a mission: end its commands, and let time pass."""

    def __init__(self, desk: Any) -> None:
        self.desk = desk
        self.executor: tuple[str, dict] | None = None

    def executor_is(self, state: str, **holding: str | None) -> None:
        """Let the executor tell from now on what it does."""
        self.executor = state, holding

    def pass_s(self, seconds: float = 0.75) -> list[dict]:
        """Let time pass, and return what the planner told."""
        told = []
        for _ in range(max(1, round(seconds / 0.25))):
            self.desk.clock.pass_s(0.25)
            self.desk.control("armed")
            if self.executor:
                self.desk.executor_is(self.executor[0], **self.executor[1])
            told += self.desk.answers()
        return told

    def given(self) -> list[str]:
        """Return which subtasks the executor was given since the last look."""
        return [one["command_id"] for one in self.desk.plans() if "plan" in one]

    def ends(self, command_id: str, error: str = "") -> list[dict]:
        self.desk.executor_tells(
            command_id=command_id,
            event="finished",
            success=not error,
            error=error or None,
            actions=[{"status": "aborted" if error else "succeeded"}],
        )
        return self.pass_s()

    def state(self) -> tuple[str, dict[str, str]]:
        mission = self.desk.missions()[0]
        return mission["state"], {name: one["state"] for name, one in mission["objectives"].items()}


@pytest.fixture
def flat(desk):
    desk.sees("red cup_1")
    return Flat(desk)


def give(flat: Flat, *objectives: Any, **rest: Any) -> list[dict]:
    flat.desk.give(mission={"objectives": list(objectives)} | rest)
    return flat.pass_s()


def test_words_become_a_mission_whose_objectives_come_one_after_the_other(flat) -> None:
    flat.desk.give(text="go to the kitchen; look left; say done", source="voice")
    assert events(flat.pass_s())[0] == ("c1", "accepted")
    assert flat.given() == ["c1/o1.s1"]
    assert flat.desk.status()["commands"] == ["c1"]
    flat.ends("c1/o1.s1")
    assert flat.given() == ["c1/o2.s1"]
    flat.ends("c1/o2.s1")
    assert flat.given() == ["c1/o3.s1"]
    told = flat.ends("c1/o3.s1")
    finished = told[-1]
    assert (finished["command_id"], finished["success"]) == ("c1", True)
    assert finished["summary"]["successful_actions"] == 3
    assert flat.state()[0] == "completed"
    assert flat.desk.said_aloud()[-1].startswith("3 of 3 objectives done")


def test_what_needs_other_parts_goes_on_side_by_side_and_the_rest_in_its_turn(flat) -> None:
    give(
        flat,
        {"id": "drive", "words": "go to the kitchen"},
        {"id": "left", "actions": [{"id": "a", "skill": "open_gripper",
                                    "parameters": {"arm": "left"}}]},
        {"id": "right", "actions": [{"id": "a", "skill": "open_gripper",
                                     "parameters": {"arm": "right"}}]},
        {"id": "say", "words": "say hello"},
        {"id": "first", "priority": 1, "words": "turn left 90 degrees"},
    )  # fmt: skip
    assert flat.given() == ["c1/first.s1", "c1/left.s1", "c1/right.s1", "c1/say.s1"]
    for name in ("first", "left", "right"):
        flat.ends(f"c1/{name}.s1")
    assert flat.given() == ["c1/drive.s1"]


def test_a_criterion_that_is_not_met_fails_its_objective_and_what_depends_on_it(flat) -> None:
    give(
        flat,
        {"id": "take", "words": "pick up the red cup", "success_criteria": "holding the red cup"},
        {"id": "bring", "words": "go to the kitchen", "depends_on": ["take"]},
        {"id": "look", "words": "look left"},
    )
    flat.desk.carried_out = ["c1/look.s1"]
    flat.executor_is("executing", left=None, right=None)
    flat.ends("c1/take.s1")
    flat.pass_s(5.0)
    assert flat.state()[1]["take"] == "failed"
    assert flat.state()[1]["bring"] == "cancelled"
    told = flat.ends("c1/look.s1")
    assert 'take.s1 "holding the red cup" is not met' not in told[-1]["error"]
    assert '"holding the red cup" is not met: the hands hold nothing' in told[-1]["error"]
    assert "1 of 3 objectives done" in told[-1]["error"]


def test_a_report_says_what_is_done_and_what_is_not(flat) -> None:
    give(flat, {"id": "a", "words": "look left"}, {"id": "b", "words": "bring me the unicorn"},
         {"id": "c", "words": "Report back", "depends_on": ["a"]})  # fmt: skip
    flat.desk.plans()
    flat.ends("c1/a.s1")
    (plan,) = flat.desk.plans()
    text = plan["plan"]["actions"][0]["parameters"]["text"]
    flat.desk.executor_tells(command_id="c1/c.s1", event="said", text=text)
    assert ("c1", "said") in events(flat.pass_s())
    assert text.startswith("Done: look left. Not done: bring me the unicorn, because ")


@pytest.mark.parametrize("words", ["bring me the unicorn", "fly to the moon"])
def test_an_objective_that_nobody_can_plan_fails_with_its_reason(flat, words) -> None:
    told = give(flat, words) + flat.pass_s()
    assert (told[-1]["event"], told[-1]["success"]) == ("finished", False)
    assert words in told[-1]["error"]


def test_a_mission_begins_at_its_time_and_again_and_again(flat) -> None:
    flat.desk.give(text="every ten minutes, go to the kitchen", source="voice")
    told = flat.pass_s()
    assert events(told)[:3] == [("c1", "accepted"), ("c1", "said"), ("c1", "finished")]
    for _ in range(2):
        assert flat.given() == ["c1/o1.s1"]
        flat.ends("c1/o1.s1")
        flat.pass_s(590.0)
        assert flat.given() == []
        flat.pass_s(10.0)
    assert flat.desk.missions()[0]["cycles"] == 3


def test_a_mission_waits_for_its_condition(flat) -> None:
    flat.desk.give(text="when the hands are empty, go to the kitchen")
    flat.executor_is("idle", left="cup", right=None)
    flat.pass_s(2.0)
    assert flat.given() == []
    flat.executor_is("idle", left=None, right=None)
    flat.pass_s()
    assert flat.given() == ["c1/o1.s1"]


def test_a_stop_ends_what_is_carried_out_and_not_what_waits_for_its_time(flat) -> None:
    flat.desk.give(text="go to the kitchen at 23:59")
    give(flat, "go to the kitchen", "look left")
    told = flat.desk.answers_to("stop")
    assert ("c2", "finished") in events(told)
    assert [one["state"] for one in flat.desk.missions()] == ["planning", "cancelled"]
    assert flat.pass_s(2.0) == []


def test_one_mission_is_cancelled_by_its_id(flat) -> None:
    give(flat, "go to the kitchen", "drive back 0.1 m")
    assert flat.given() == ["c1/o1.s1"]
    told = flat.desk.answers_to(mission_act={"cancel": "c1"})
    assert flat.desk.plans() == [
        {"command_id": "c1/o1.s1-cancel", "cancel": True, "of": "c1/o1.s1"}
    ]
    assert events(told)[-1] == ("c2", "finished")
    assert told[-1]["success"]
    (told,) = flat.desk.answers_to(mission_act={"cancel": "c9"})
    assert 'no mission "c9"' in told["error"]


def test_a_pause_shows_and_nothing_new_begins(flat) -> None:
    give(flat, "go to the kitchen", "say hello")
    flat.desk.carried_out = ["c1/o1.s1"]
    flat.executor_is("paused")
    flat.given()
    flat.ends("c1/o2.s1")
    assert flat.state()[0] == "paused"
    flat.executor_is("executing")
    flat.pass_s()
    assert flat.state()[0] == "executing"


def test_a_planner_that_is_started_again_goes_on_where_it_was(flat) -> None:
    give(flat, "go to the kitchen", {"id": "o2", "words": "look left", "depends_on": ["o1"]})
    flat.executor_is("idle")
    # It ended while no planner was there to hear it.
    flat.desk.executor_tells(command_id="c1/o1.s1", event="finished", success=True, error=None,
                             actions=[])  # fmt: skip
    flat.desk.start()
    flat.pass_s(1.0)
    assert flat.given() == ["c1/o1.s1", "c1/o2.s1"]
    # Nobody carries this one out any more: it is begun again, once.
    flat.desk.start()
    flat.pass_s(1.0)
    assert flat.given() == ["c1/o2.s1+2"]
    flat.desk.start()
    flat.pass_s(1.0)
    assert flat.given() == []
    assert "o1: completed" not in json.dumps(flat.desk.missions())
    assert flat.state() == ("failed", {"o1": "completed", "o2": "failed"})


def test_what_an_executor_took_with_it_is_begun_again(flat) -> None:
    give(flat, "go to the kitchen")
    assert flat.given() == ["c1/o1.s1"]
    flat.executor_is("idle")
    flat.pass_s(4.0)
    assert flat.given() == ["c1/o1.s1+2"]


@pytest.mark.parametrize(
    ("mission", "why"),
    [
        ([], "at least 1 item"),
        ({"objectives": [{"words": "go", "required_resources": ["third_arm"]}]}, "third_arm"),
        ({"objectives": ["go"], "schedule": {"at_unix_s": 7}}, "give a time that is to come"),
        ({"objectives": [{"words": "go", "criteria": "all is well"}]}, "cannot be checked"),
        ("7", "expected a JSON object or a list"),
    ],
)
def test_a_mission_with_faults_is_refused_in_one_line(flat, mission, why) -> None:
    flat.desk.give(mission=mission)
    (told,) = flat.pass_s()
    assert told["event"] == "rejected"
    assert why in told["reason"]
    assert "\n" not in told["reason"]


def test_a_command_waits_for_the_mission_and_an_answer_does_not(flat) -> None:
    give(flat, "go to the kitchen")
    assert events(flat.desk.answers_to("go to the bedroom", source="voice")) == [("c2", "queued")]
    assert events(flat.desk.answers_to("what do you see"))[-1] == ("c3", "plan")
    assert flat.desk.said_aloud() == [Says.AFTERWARDS]


def test_words_that_were_heard_badly_are_no_mission_and_those_heard_well_keep_their_doubt(flat):
    flat.desk.give(text="look left; look right", source="voice", heard={"confidence": 0.4})
    flat.pass_s()
    assert flat.desk.missions() == []
    flat.desk.answers_to("stop")
    flat.desk.give(text="look left; look right", source="voice", heard={"confidence": 0.9})
    flat.pass_s()
    assert flat.desk.missions()[0]["heard_confidence"] == 0.9


def test_the_largest_missions_are_shown_as_far_as_there_is_room(flat) -> None:
    words = "look left and " * 60
    for _ in range(10):
        give(flat, *[{"subtasks": [words] * 3} for _ in range(12)])
    shown = flat.desk.missions()
    assert shown[0]["mission_id"] == "c10"
    assert 2 <= len(shown) < 10
    assert len(json.dumps(shown)) < 262_144


def test_what_an_objective_takes_with_it_is_told(flat) -> None:
    give(flat, {"id": "a", "subtasks": ["bring me the unicorn", "look left"]},
         {"id": "b", "words": "look left", "depends_on": ["a"]})  # fmt: skip
    told = flat.desk.missions()[0]
    assert {name: one["state"] for name, one in told["objectives"].items()} == {
        "a": "failed",
        "b": "cancelled",
    }


@pytest.mark.parametrize("act", [None, 7, "c1", [], {}, {"cancel": None}, {"cancel": {"a": 1}}])
def test_an_act_of_any_form_has_a_clear_outcome(flat, act) -> None:
    (told,) = flat.desk.answers_to(mission_act=act)
    assert (told["event"], told["success"]) == ("finished", False)


# --- what a person stops, pauses or cancels stays so ---------------------------------------------


def test_an_emergency_stop_ends_a_mission_for_good_a_repeating_one_too(flat) -> None:
    flat.desk.give(text="every thirty seconds, go to the kitchen")
    flat.pass_s()
    assert flat.given() == ["c1/o1.s1"]
    flat.desk.control("stopped")
    told = flat.desk.answers()
    flat.desk.clock.pass_s(0.25)
    told += flat.desk.answers()
    assert ("c1", "finished") in events(told)
    assert "reset and arm" in next(one for one in told if one["event"] == "finished")["error"]
    flat.pass_s(60.0)
    assert flat.given() == []
    assert (flat.state()[0], flat.desk.missions()[0]["due_unix_s"]) == ("cancelled", None)


@pytest.mark.parametrize("said", ["no, don't do that!", "stand still"])
def test_an_objection_ends_missions_too(flat, said) -> None:
    flat.desk.give(text="every thirty seconds, go to the kitchen")
    flat.pass_s()
    flat.given()
    flat.desk.answers_to(said)
    flat.pass_s(60.0)
    assert [one for one in flat.given() if one.startswith("c1/")] == []
    assert flat.state()[0] == "cancelled"


def start_planner_again(flat) -> None:
    """Start it again while the executor carries out the first subtask."""
    flat.desk.carried_out = ["c1/o1.s1"]
    flat.desk.executor_is("executing")
    flat.desk.start()


def test_a_mission_is_cancelled_by_a_planner_that_was_started_again(flat) -> None:
    give(flat, "go to the kitchen")
    start_planner_again(flat)
    flat.desk.plans()
    assert flat.desk.plans_for(mission_act={"cancel": "c1"}) == [
        {"command_id": "c1/o1.s1-cancel", "cancel": True, "of": "c1/o1.s1"}
    ]


def test_what_no_executor_carries_out_after_both_were_started_again_is_begun_again(flat) -> None:
    give(flat, "go to the kitchen")
    start_planner_again(flat)
    flat.desk.plans()
    flat.executor_is("idle")
    flat.pass_s(5.0)
    assert flat.given() == ["c1/o1.s1+2"]


def test_a_pause_between_two_subtasks_holds_until_somebody_says_go_on(flat) -> None:
    give(flat, {"id": "a", "words": "look left", "criteria": "the keys are in the box"},
         {"id": "b", "words": "go to the kitchen", "depends_on": ["a"]})  # fmt: skip
    flat.given()
    flat.ends("c1/a.s1")  # nobody can see whether it is so: it waits for a moment
    told = flat.desk.answers_to("hold on")
    assert (events(told)[-1], told[-1]["success"]) == (("c2", "finished"), True)
    flat.pass_s(10.0)
    assert (flat.given(), flat.state()[0]) == ([], "paused")
    flat.desk.answers_to("go on")
    flat.pass_s(1.5)
    assert flat.given() == ["c1/b.s1"]


def test_no_more_are_carried_out_at_a_time_than_the_executor_takes(flat) -> None:
    give(
        flat,
        *[
            f"say {word}"
            for word in ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine"]
        ],
    )
    first = flat.given()
    assert len(first) == 6
    flat.ends(first[0])
    assert len(flat.given()) == 1


def test_the_parts_of_a_mission_take_nobody_elses_place(flat) -> None:
    flat.desk.carried_out = ["c1/o1.s1"]
    give(flat, *["go to the kitchen"] * 10)
    assert events(flat.desk.answers_to("go to the bedroom")) == [("c2", "queued")]


def test_the_end_of_a_cycle_before_ends_nothing_now(flat) -> None:
    flat.desk.give(text="every thirty seconds, go to the kitchen")
    flat.pass_s()
    flat.ends("c1/o1.s1")
    flat.pass_s(30.0)
    assert flat.given() == ["c1/o1.s1", "c1/o1.s1"]
    start_planner_again(flat)  # it reads all that was told before
    assert flat.desk.missions()[0]["subtasks"]["o1.s1"]["state"] == "executing"


def test_an_id_that_is_in_use_is_refused(flat) -> None:
    give(flat, "go to the kitchen")
    flat.desk.give(command_id="c1", mission=["look left"])
    told = flat.pass_s()
    assert (told[0]["event"], told[0]["reason"]) == (
        "rejected",
        'a mission "c1" is open already',
    )


def test_what_a_server_beyond_the_robot_lost_is_not_begun_again(flat) -> None:
    give(flat, "go to the kitchen")
    flat.given()
    told = flat.ends("c1/o1.s1", "lost: the ROS gateway has been silent for 2 s")
    assert (told[-1]["event"], told[-1]["success"]) == ("finished", False)
    assert flat.given() == []


def test_a_pause_of_an_executor_that_ended_holds_until_somebody_says_go_on(flat) -> None:
    give(flat, "go to the kitchen")
    flat.given()
    flat.desk.answers_to("hold on")
    flat.executor_is("idle")
    flat.pass_s(6.0)
    assert (flat.given(), flat.state()[0]) == ([], "paused")
    flat.desk.answers_to("go on")
    flat.pass_s()
    assert flat.given() == ["c1/o1.s1+2"]
