"""The gateway knows which plan is under way, whatever else is asked meanwhile."""

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.commands import RobotCommands


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
