"""Requests and answers between executor and ROS gateway survive the ring, and bad ones do not."""

import json
import math
from typing import Any

import pytest

from vla_deploy.ipc.ros_goals import (
    MOST_POINTS,
    GoalAnswer,
    GoalKind,
    GoalRequest,
    GoalState,
    RosGoalUnreadable,
    read_answer,
    read_request,
)


def request(**changed: Any) -> GoalRequest:
    chosen: dict[str, Any] = {
        "request_id": "g1",
        "kind": GoalKind.FOLLOW,
        "server": "left_arm_controller/follow_joint_trajectory",
        "holder": "pick_up (c1, a1)",
        "parts": ("left_arm",),
        "timeout_s": 120.0,
        "joints": ("a", "b"),
        "times_s": (0.5, 1.0),
        "positions": ((0.0, 1.0), (1.0, 2.0)),
    }
    return GoalRequest(**(chosen | changed))


def test_a_request_is_read_as_it_was_written() -> None:
    assert read_request(json.loads(json.dumps(request().document()))) == request()


def test_an_answer_is_read_as_it_was_written() -> None:
    answer = GoalAnswer(request_id="g1", state=GoalState.FEEDBACK, text="on its way", left_m=1.5)
    assert read_answer(json.loads(json.dumps(answer.document()))) == answer


def test_a_long_text_is_cut() -> None:
    answer = GoalAnswer(request_id="g1", state=GoalState.LOST, text="x" * 5000)
    assert len(json.dumps(answer.document())) < 2048


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"kind": GoalKind.NAVIGATE}, "expected x, y, yaw"),
        ({"kind": GoalKind.NAVIGATE, "pose": (1.0, math.nan, 0.0)}, "finite"),
        ({"timeout_s": 0.0}, "timeout_s"),
        ({"joints": ()}, "joints"),
        ({"times_s": (), "positions": ()}, "times_s"),
        ({"times_s": (0.0, 1.0)}, "rise"),
        ({"times_s": (1.0, 1.0)}, "rise"),
        ({"positions": ((0.0, 1.0), (1.0,))}, "2 rows of 2"),
        (
            {
                "times_s": tuple(map(float, range(1, MOST_POINTS + 2))),
                "positions": ((0.0, 1.0),) * (MOST_POINTS + 1),
            },
            f"1 to {MOST_POINTS}",
        ),
    ],
)
def test_a_request_out_of_bounds_is_refused(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(RosGoalUnreadable, match=words):
        read_request(request(**changed).document())


@pytest.mark.parametrize("document", [{}, {"kind": "fly"}, {"kind": "navigate_to_pose"}])
def test_what_is_no_request_is_refused(document: dict[str, Any]) -> None:
    with pytest.raises(RosGoalUnreadable):
        read_request(document)


def test_the_last_five_states_are_final() -> None:
    assert [state.value for state in GoalState if state.is_final] == [
        "succeeded",
        "rejected",
        "aborted",
        "cancelled",
        "lost",
    ]
