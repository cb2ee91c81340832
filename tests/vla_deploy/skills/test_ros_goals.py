"""The executor's goals for servers beyond the robot; the test tells what a gateway would."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.ros_goals import (
    MOST_POINTS,
    GoalAct,
    GoalAnswer,
    GoalKind,
    GoalRequest,
    GoalState,
)
from vla_deploy.skills.actions.beyond import conclude, thinned
from vla_deploy.skills.errors import ServerLost
from vla_deploy.skills.ros_goals import RosGoals, SentGoal

REQUEST = GoalRequest(
    request_id="",
    kind=GoalKind.NAVIGATE,
    server="navigate_to_pose",
    holder="navigate_to (c1, a1)",
    parts=("base",),
    timeout_s=300.0,
    pose=(1.0, 2.0, 0.0),
)


class StepClock:
    def __init__(self) -> None:
        self.ns = 1000 * NS_PER_S

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = deadline_ns


class Ends:
    """Both ends of the topics."""

    def __init__(self, folder: Path) -> None:
        self.clock = StepClock()
        self.space = SharedSpace(folder, self.clock)
        self.goals = RosGoals(self.space, self.clock)
        self.status = self.space.cell_writer("ros_status")
        self.asked = self.space.ring_reader("ros_request", from_start=True)
        self.answers = self.space.ring_writer("ros_answer")

    def send(self) -> SentGoal:
        return self.goals.send("a1", REQUEST)

    def acts(self) -> list[str]:
        return [str(event.payload["act"]) for event in self.asked.drain()]

    def answer(self, goal: SentGoal, state: GoalState, text: str = "") -> None:
        told = GoalAnswer(request_id=goal.request.request_id, state=state, text=text)
        self.answers.publish(told.document())
        self.goals.refresh()

    def pass_time(self, seconds: float, *, gateway: bool = True) -> None:
        self.clock.ns += round(seconds * NS_PER_S)
        if gateway:
            self.status.put_document({})
        self.goals.refresh()


@pytest.fixture
def ends(tmp_path: Path) -> Iterator[Ends]:
    made = Ends(tmp_path)
    made.status.put_document({})
    yield made
    made.goals.close()
    made.space.close()


def test_a_goal_goes_out_at_once_where_a_gateway_runs(ends: Ends) -> None:
    ends.send()
    assert ends.acts() == [GoalAct.SEND]


def test_a_gateway_that_does_not_run_is_waited_for_five_seconds(ends: Ends) -> None:
    ends.pass_time(100.0, gateway=False)
    goal = ends.send()
    ends.pass_time(4.9, gateway=False)
    assert not goal.is_final
    ends.pass_time(0.2, gateway=False)
    assert goal.state is GoalState.ABORTED
    assert "does not run" in goal.text
    assert ends.acts() == []


def test_a_gateway_that_comes_in_time_gets_the_goal(ends: Ends) -> None:
    ends.pass_time(100.0, gateway=False)
    ends.send()
    ends.pass_time(3.0)
    assert ends.acts() == [GoalAct.SEND]


def test_a_gateway_that_falls_silent_has_lost_the_goal(ends: Ends) -> None:
    goal = ends.send()
    ends.pass_time(1.9, gateway=False)
    assert not goal.is_final
    ends.pass_time(0.2, gateway=False)
    assert goal.state is GoalState.LOST
    with pytest.raises(ServerLost, match=r"^lost: the ROS gateway has been silent"):
        conclude(goal)


def test_leave_to_drive_is_given_ten_times_a_second_and_withdrawn_at_once(ends: Ends) -> None:
    goal = ends.send()
    ends.acts()
    for hindrance in ("", "", "lost", "lost", ""):
        ends.goals.permit(goal, hindrance)
        ends.pass_time(0.02)
    assert ends.acts() == [GoalAct.PERMIT, GoalAct.HOLD, GoalAct.PERMIT]
    ends.pass_time(0.1)
    ends.goals.permit(goal)
    assert ends.acts() == [GoalAct.PERMIT]


def test_a_cancel_is_asked_for_once_and_awaited(ends: Ends) -> None:
    goal = ends.send()
    for _ in range(2):
        ends.goals.cancel(goal, "enough")
    assert ends.acts() == [GoalAct.SEND, GoalAct.CANCEL]
    assert ends.goals.is_ending("a1")
    ends.answer(goal, GoalState.CANCELLING)
    assert ends.goals.is_ending("a1")
    ends.answer(goal, GoalState.CANCELLED)
    assert not ends.goals.is_ending("a1")
    assert ends.goals.words_of("a1") == ""


def test_a_rejected_cancel_is_told_once(ends: Ends) -> None:
    goal = ends.send()
    ends.goals.cancel(goal, "enough")
    ends.answer(goal, GoalState.CANCEL_REJECTED, "the server rejected the cancel")
    ends.answer(goal, GoalState.LOST, "it may go on")
    told = ends.goals.words_of("a1")
    assert "rejected the cancel" in told
    assert "it may go on" in told
    assert ends.goals.words_of("a1") == ""


def test_a_goal_that_was_not_sent_yet_is_cancelled_at_once(ends: Ends) -> None:
    ends.pass_time(100.0, gateway=False)
    goal = ends.send()
    ends.goals.cancel(goal, "enough")
    assert goal.state is GoalState.CANCELLED
    assert ends.acts() == []


def test_an_answer_that_makes_no_sense_loses_the_goals(ends: Ends) -> None:
    goal = ends.send()
    ends.answers.publish({"request_id": "g", "state": "dancing"})
    ends.goals.refresh()
    assert goal.state is GoalState.LOST


@pytest.mark.parametrize("count", [2, 3, MOST_POINTS, MOST_POINTS + 1, MOST_POINTS + 2, 1000])
def test_thinning_keeps_both_ends_and_the_bound(count: int) -> None:
    times_s = np.arange(count, dtype=np.float64)
    kept, positions = thinned(times_s, times_s[:, None])
    assert (kept[0], kept[-1]) == (0.0, count - 1.0)
    assert len(kept) - 1 <= MOST_POINTS
    assert (positions[:, 0] == kept).all()


def test_requests_of_both_kinds_fit_a_slot(ends: Ends) -> None:
    row: tuple[Any, ...] = (-1.234567,) * 12
    ends.goals.send(
        "a1",
        GoalRequest(
            request_id="",
            kind=GoalKind.FOLLOW,
            server="joint_trajectory_controller/follow_joint_trajectory",
            holder="x" * 80,
            parts=("left_arm", "right_arm"),
            timeout_s=120.0,
            joints=tuple(f"a_rather_long_joint_{i}" for i in range(12)),
            times_s=tuple(i + 0.123456 for i in range(MOST_POINTS)),
            positions=(row,) * MOST_POINTS,
        ),
    )
    assert ends.acts() == [GoalAct.SEND]
