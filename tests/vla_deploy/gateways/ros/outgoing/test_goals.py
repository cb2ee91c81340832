"""Goals with real servers in processes of their own: how each of them ends."""

import os
import signal

import pytest

from vla_deploy.ipc.ros_goals import GoalState

pytestmark = [pytest.mark.stack, pytest.mark.timeout(180)]


@pytest.fixture
def under_way(gateway, serve, drive):
    """Start a server with a goal that it has accepted."""

    def begin(mode: str, **changed):
        server = serve("nav", "navigate_to_pose", mode)
        gateway.claim("base")
        gateway.send(drive(**changed))
        gateway.wait_for(GoalState.ACCEPTED)
        return server

    return begin


@pytest.mark.parametrize(
    ("mode", "state", "words"),
    [
        ("succeed", GoalState.SUCCEEDED, ""),
        ("abort", GoalState.ABORTED, "error code 7"),
        ("code", GoalState.ABORTED, "error code 9"),
        ("reject", GoalState.REJECTED, "rejected the goal"),
        ("mute", GoalState.LOST, "did not answer the goal within 5 s"),
    ],
)
def test_a_goal_ends_as_its_server_says(gateway, serve, drive, mode, state, words) -> None:
    server = serve("nav", "navigate_to_pose", mode)
    gateway.claim("base")
    gateway.send(drive())
    assert server.stdout.readline() == "goal\n"
    ended = gateway.final()
    assert (ended.state, words in ended.text) == (state, True), ended


def test_a_server_that_is_not_there_is_waited_for_five_seconds(gateway, drive) -> None:
    gateway.claim("base")
    asked_ns = gateway.clock.now_ns()
    gateway.send(drive())
    ended = gateway.final()
    assert ended.state is GoalState.ABORTED
    assert "is not there after 5 s" in ended.text
    assert gateway.clock.now_ns() - asked_ns >= 5 * 10**9


def test_a_server_that_comes_in_time_gets_the_goal(gateway, serve, drive) -> None:
    gateway.claim("base")
    gateway.send(drive(server_wait_s=60.0))
    serve("nav", "navigate_to_pose", "succeed")
    assert gateway.final().state is GoalState.SUCCEEDED


def test_a_cancel_is_done_when_the_server_has_ended_the_goal(gateway, serve, reach) -> None:
    server = serve("fjt", "left_arm_controller/follow_joint_trajectory", "hang")
    gateway.claim("left_arm")
    gateway.send(reach())
    gateway.wait_for(GoalState.ACCEPTED)
    gateway.ask("cancel")
    ended = gateway.final()
    assert ended.state is GoalState.CANCELLED
    assert [server.stdout.readline() for _ in range(3)] == ["goal\n", "cancel\n", "canceled\n"]


@pytest.mark.parametrize(
    ("mode", "answer", "words", "why"),
    [
        (
            *("refuse_cancel", GoalState.CANCEL_REJECTED, "rejected the cancel"),
            "moves nothing of this robot",
        ),
        ("ignore_cancel", GoalState.CANCELLING, "", "has not ended it within 10 s"),
    ],
)
def test_a_cancel_that_is_not_followed_ends_the_goal_as_lost(
    gateway, under_way, mode, answer, words, why
) -> None:
    under_way(mode)
    gateway.ask("cancel")
    assert words in gateway.wait_for(answer).text
    ended = gateway.final()
    assert ended.state is GoalState.LOST
    assert why in ended.text


def test_a_goal_that_takes_too_long_is_cancelled_and_aborted(gateway, under_way) -> None:
    server = under_way("hang", timeout_s=1.0)
    ended = gateway.final()
    assert ended.state is GoalState.ABORTED
    assert "took longer than 1 s" in ended.text
    assert [server.stdout.readline() for _ in range(3)] == ["goal\n", "cancel\n", "canceled\n"]


def test_a_second_goal_waits_until_its_server_has_ended_the_first(
    gateway, under_way, drive
) -> None:
    server = under_way("hang", request_id="g1")
    gateway.send(drive("g2"))
    gateway.ask("cancel", "g1")
    assert gateway.final().request_id == "g1"

    def is_second_accepted() -> bool:
        gateway.wait_for(GoalState.ACCEPTED)
        return ("g2", GoalState.ACCEPTED) in [(one.request_id, one.state) for one in gateway.told]

    assert gateway.wait_until(is_second_accepted)
    gateway.ask("cancel", "g2")
    lines = [server.stdout.readline() for _ in range(4)]
    assert lines == ["goal\n", "cancel\n", "canceled\n", "goal\n"]


def test_a_goal_without_its_claim_is_not_sent(gateway, serve, drive) -> None:
    serve("nav", "navigate_to_pose", "succeed")
    gateway.claim("base", holder="another")
    gateway.send(drive())
    ended = gateway.final()
    assert ended.state is GoalState.ABORTED
    assert "does not hold base" in ended.text


def test_a_goal_whose_claim_is_given_back_is_cancelled(gateway, under_way) -> None:
    server = under_way("hang")
    gateway.claims.release("navigate_to (c1, a1)")
    assert gateway.final().state is GoalState.CANCELLED
    assert [server.stdout.readline() for _ in range(3)] == ["goal\n", "cancel\n", "canceled\n"]


def test_a_request_that_makes_no_sense_is_rejected(gateway, drive) -> None:
    gateway.requests.publish(drive().document() | {"pose": [1.0]})
    ended = gateway.final()
    assert ended.state is GoalState.REJECTED
    assert "expected x, y, yaw" in ended.text


def test_a_server_that_is_killed_has_lost_its_goal(gateway, under_way) -> None:
    server = under_way("hang")
    os.kill(server.pid, signal.SIGKILL)
    ended = gateway.final(timeout_s=60.0)
    assert ended.state is GoalState.LOST
    assert "has gone while it had the goal" in ended.text
