"""The gateway knows which plan is under way, whatever else is asked meanwhile."""

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.commands import RobotCommands
from vla_deploy.gateways.ros.outward.feedback import feedback_of


class Robot:
    def __init__(self, run_dir):
        self.clock = MonotonicClock()
        self.link = RobotLink(run_dir, self.clock)
        self.commands = RobotCommands(self.link, self.clock.now_ns)

    def tell(self, command_id, event, **details):
        told = {"command_id": command_id, "event": event} | details
        self.link.writer("task_event").publish(told)
        self.commands.step(self.clock.now_ns())

    def plan(self, command_id, *skills):
        actions = [{"id": one, "skill": one, "parameters": {}} for one in skills]
        self.tell(command_id, "plan", plan={"goal": "do it", "actions": actions})

    def action(self, command_id, skill, status):
        told = {"skill": skill, "parameters": {}, "execution_time_s": 1.0}
        told |= {"error": None, "retries": 0, "note": None}
        self.tell(command_id, "action", action_id=skill, status=status, **told)


@pytest.fixture
def robot(tmp_path):
    world = Robot(tmp_path / "run")
    yield world
    world.commands.stop()
    world.link.close()


def test_a_command_that_is_refused_meanwhile_leaves_the_one_under_way(robot) -> None:
    first, second = robot.link.utter(text="tidy up"), robot.link.utter(text="come here")
    robot.plan(first, "move", "speak")
    robot.action(first, "move", "active")
    robot.plan(second, "turn")
    assert robot.commands.current.text == "tidy up"
    robot.tell(second, "rejected", reason="busy")
    assert dict(robot.commands.current.statuses) == {"move": "active", "speak": "pending"}
    assert robot.commands.actions_left == 2
    robot.action(first, "move", "succeeded")
    assert robot.commands.actions_left == 1
    assert [one["skill"] for one in robot.commands.recent] == ["move"]
    robot.tell(first, "finished", success=True, error=None, actions=[])
    assert (robot.commands.current.text, robot.commands.has_succeeded) == ("", True)


def test_another_plan_for_the_same_command_takes_the_place_of_the_failed_one(robot) -> None:
    command = robot.link.utter(text="tidy up")
    robot.plan(command, "move", "speak")
    robot.action(command, "move", "aborted")
    robot.plan(command, "turn")
    assert dict(robot.commands.current.statuses) == {"turn": "pending"}
    assert robot.commands.current.text == "tidy up"


def test_a_stop_completes_nothing(robot) -> None:
    stop = robot.link.utter(text="stop")
    robot.tell(stop, "finished", success=True, error=None, actions=[])
    assert robot.commands.has_succeeded is None


def test_news_are_of_one_step(robot) -> None:
    command = robot.link.utter(text="tidy up")
    robot.tell(command, "accepted")
    assert [one.event["event"] for one in robot.commands.news] == ["accepted"]
    assert robot.commands.news[0].record.text == "tidy up"
    robot.commands.step(robot.clock.now_ns())
    assert robot.commands.news == ()


def feedback(robot, command_id, event, **details):
    """Return the feedback that an event is worth."""
    robot.tell(command_id, event, **details)
    found = [feedback_of(news) for news in robot.commands.news]
    return [one for one in found if one is not None]


def test_a_mission_has_feedback_for_each_plan_and_objective_and_one_end(robot) -> None:
    mission = robot.link.utter(text="go there; take it")
    part, summary = f"{mission}/o1.s1", {"total_actions": 2, "successful_actions": 2}
    objective = {"part": "o1", "words": "go there", "note": None}
    plan = {"goal": "go", "actions": [{"id": "a1", "skill": "move", "parameters": {}}]}
    robot.tell(mission, "accepted")
    executing = feedback(robot, mission, "objective", state="executing", error=None, **objective)
    (planned,) = feedback(robot, part, "plan", plan=plan)
    robot.action(part, "a1", "active")
    assert robot.commands.current.text == "go there"
    ended = feedback(robot, part, "finished", success=True, error=None, actions=[])
    (reached,) = feedback(robot, mission, "objective", state="completed", error=None, **objective)
    (failed,) = feedback(
        robot, mission, "objective", state="failed", error="it fell", **objective | {"part": "o2"}
    )
    (last,) = feedback(
        robot, mission, "finished", success=False, error="1 of 2", summary=summary, actions=[]
    )
    assert (executing, ended) == ([], [])
    assert (planned["stage"], planned["command_id"]) == ("planning", part)
    assert (planned["command"], planned["source"]) == ("go there", last["source"])
    assert (reached["stage"], reached["status"], reached["part"]) == ("objective", "success", "o1")
    assert (failed["status"], failed["error"]) == ("failure", "it fell")
    assert (last["stage"], last["status"], last["summary"]) == ("execution", "failure", summary)
    assert last["command"] == "go there; take it"
    assert robot.commands.has_succeeded is False


@pytest.mark.parametrize(
    "said", [{"cancel": True}, {"pause": True}, {"mission_act": {"cancel": "m"}}]
)
def test_that_a_cancel_or_a_pause_is_done_is_no_feedback_on_a_command(robot, said) -> None:
    command = robot.link.utter(**said)
    done = {"success": True, "error": None, "actions": []}
    assert feedback(robot, command, "finished", **done) == []
    assert feedback(robot, "m/o1.s1-cancel", "finished", **done) == []  # the planner's own
    assert robot.commands.has_succeeded is None
