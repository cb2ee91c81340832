"""A command over ROS is followed to its end, a mission with all its parts."""

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.inward.orders import CommandOrders, OrderProgress, error_of, words_of

SUMMARY = {"total_actions": 3, "successful_actions": 2, "failed_actions": 1, "success_rate": 0.667}


class Robot:
    def __init__(self, run_dir):
        self.link = RobotLink(run_dir, MonotonicClock())
        self.orders = CommandOrders(self.link)

    def tell(self, command_id, event, **details):
        told = {"command_id": command_id, "event": event} | details
        self.link.writer("task_event").publish(told)
        self.orders.step()

    def carry_out(self, command_id, *skills, success=True):
        """Tell what planner and executor tell of one plan."""
        actions = [
            {"id": f"a{place}", "skill": one, "parameters": {}}
            for place, one in enumerate(skills, 1)
        ]
        self.tell(command_id, "accepted")
        self.tell(command_id, "plan", plan={"goal": "do it", "actions": actions})
        for one in actions:
            self.tell(command_id, "action", **one, action_id=one["id"], status="active")
        ended = [{**one, "status": "succeeded" if success else "aborted"} for one in actions]
        error = None if success else "it fell"
        self.tell(command_id, "finished", success=success, error=error, actions=ended)

    def part(self, mission, name, state, error=None):
        self.tell(
            mission, "objective", part=name, words=f"do {name}", state=state, error=error, note=None
        )


@pytest.fixture
def robot(tmp_path):
    world = Robot(tmp_path / "run")
    yield world
    world.orders.close()
    world.link.close()


def test_a_mission_is_followed_with_its_parts_and_ends_once(robot) -> None:
    order = robot.orders.give(text="go there; take it; say done")
    mission = order.command_id
    robot.tell(mission, "accepted")
    robot.part(mission, "o1", "executing")
    robot.carry_out(f"{mission}/o1.s1", "navigate_to", "look_at")
    for speaker in (f"{mission}/o1.s1", mission):  # the mission passes on what its parts say
        robot.tell(speaker, "said", text="I am there")
    robot.part(mission, "o1", "completed")
    assert order.last is None  # the end of a part is not the end
    robot.part(mission, "o2", "executing")
    robot.carry_out(f"{mission}/o2.s1+2", "pick_up", success=False)
    robot.tell("other-1/o2.s1", "accepted")  # somebody else's mission
    robot.tell(mission, "finished", success=False, error="1 of 3", summary=SUMMARY, actions=[])
    robot.tell(mission, "finished", success=True, error=None, summary=SUMMARY, actions=[])
    assert (order.last["event"], error_of(order.last)) == ("finished", "1 of 3")

    progress, told = OrderProgress(), []
    while order.news:
        event = order.news.popleft()
        place = progress.note(event)
        told.append((event["event"], place.action_id, f"{place.index}/{place.total}"))
    assert [one[0] for one in told].count("finished") == 3  # two parts, and the mission once
    assert [one[0] for one in told].count("said") == 1
    assert [one[1:] for one in told if one[0] == "action"] == [
        ("o1.s1/a1", "0/2"), ("o1.s1/a2", "1/2"), ("o2.s1/a1", "0/1"),
    ]  # fmt: skip
    assert [(one["id"], one["status"]) for one in progress.results] == [
        ("o1.s1/a1", "succeeded"), ("o1.s1/a2", "succeeded"), ("o2.s1/a1", "aborted"),
    ]  # fmt: skip


def test_a_plain_command_keeps_the_ids_of_its_actions(robot) -> None:
    order = robot.orders.give(text="turn left")
    robot.carry_out(order.command_id, "turn")
    progress = OrderProgress()
    places = [progress.note(event).action_id for event in order.news]
    assert places == ["", "", "a1", ""]
    assert [one["id"] for one in progress.results] == ["a1"]
    assert error_of(order.last) == ""


def test_a_cancel_is_an_utterance_of_its_own_so_that_the_command_ends_once(robot) -> None:
    heard = robot.link.events("utterance", from_start=True)
    mission = {"objectives": ["turn left"]}
    order = robot.orders.give(mission=mission, source="ros:/teleop")
    order.cancel()
    given, cancel = (event.payload for event in heard.drain())
    assert (given["mission"], given["source"]) == (mission, "ros:/teleop")
    assert "text" not in given
    assert cancel["cancel"] is True
    assert cancel["command_id"] != given["command_id"]
    heard.close()


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ({"event": "asked", "question": "which cup?"}, "which cup?"),
        ({"event": "said", "text": "I see two"}, "I see two"),
        ({"event": "action", "error": "it fell"}, "it fell"),
        ({"event": "accepted"}, ""),
        (
            {"event": "objective", "words": "go", "state": "completed", "error": None},
            "go: completed",
        ),
        (
            {"event": "objective", "words": "go", "state": "failed", "error": "no way"},
            "go: failed: no way",
        ),
    ],
)
def test_an_event_in_words(event, words) -> None:
    assert words_of(event) == words
