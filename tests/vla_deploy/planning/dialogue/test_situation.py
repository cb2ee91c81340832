"""What a back end is told of the robot, gathered from the topics of its processes."""

from collections.abc import Callable
from typing import Any

from vla_deploy.planning.errors import Declined


def test_a_back_end_is_told_the_task_and_how_the_last_actions_ended(
    open_desk: Callable[..., Any], back_end: Callable[..., Any]
) -> None:
    listening = back_end("model", Declined("it only listens"))
    desk = open_desk(listening)
    desk.give(text="tidy up", command_id="c7")
    desk.answers()
    for status, error in (("active", None), ("aborted", "the way is blocked")):
        desk.executor_tells(
            command_id="c7", event="action", action_id="a1", skill="navigate_to",
            parameters={"place": "kitchen"}, status=status, execution_time_s=4.0, error=error,
            retries=1, note=None,
        )  # fmt: skip
    desk.executor_is("executing", ("c7", "navigate_to"), left=None, right=None)
    desk.answers_to("sing a sea shanty")
    request = listening.asked[-1]
    assert request.task == "tidy up: navigate_to"
    (ended,) = request.last_actions
    assert (ended.skill, ended.status, ended.error) == (
        "navigate_to", "aborted", "the way is blocked",
    )  # fmt: skip
    assert request.battery is None
    desk.executor_is("idle", left=None, right=None)
    desk.answers_to("sing another one")
    assert listening.asked[-1].task == ""
